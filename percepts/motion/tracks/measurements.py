"""The measurements of one frame: points, superpixels, and motion over several baselines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.motion_constraints import Constraints, Points
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.layers.affine import Affine
from visup.percepts.motion.layers.background_motion import BackgroundMotion
from visup.percepts.motion.layers.dense_labelling import PointEvidence
from visup.percepts.motion.layers.layer_discovery import layer_slack
from visup.percepts.motion.tracks._track_points_jit import Motions, add_track_likelihoods
from visup.percepts.motion.tracks.track import Indices, Track

REACH_STEPS = 2


@dataclass(frozen=True, slots=True, eq=False)
class BaselineMotion:
    """Motion over one baseline.

    Attributes:
        constraints: The measured constraints.
        background: The motions of the background.
    """

    constraints: Constraints
    background: BackgroundMotion


@dataclass(frozen=True, eq=False)
class FrameMeasurements:
    """One frame as measured.

    Attributes:
        image: The working image.
        points: Points with structure.
        cells: Superpixels.
        owner: (count,) label that each superpixel is expected to have; 0 is background.
        seconds: Since the previous frame.
        flow: (h, w, 2) float32, dense flow from the newest image back to the previous one, pixels.
        measured: Motions, the shortest baseline first.
    """

    image: WorkImage
    points: Points
    cells: Superpixels
    owner: Indices
    seconds: float
    flow: Floats
    measured: tuple[BaselineMotion, ...]

    @property
    def time(self) -> float:
        """Seconds."""
        return self.image.time

    @cached_property
    def at(self) -> NDArray[np.int32]:
        """(N,) number of the superpixel at each point."""
        x, y = self.points.xy.astype(np.int64).T
        return np.asarray(self.cells.labels[y, x])

    def parts(self, t: Track, c: Constraints) -> tuple[Affine, ...]:
        """`Track.predicted` over the baseline of some constraints; cached, since several steps ask for it."""
        known = self._parts.get((id(t), c.lag))
        if known is None:
            known = self._parts[id(t), c.lag] = t, t.predicted(c.lag, c.span_s)
        return known[1]

    @cached_property
    def _parts(self) -> dict[tuple[int, int], tuple[Track, tuple[Affine, ...]]]:
        """The tracks, so that none takes the number of another, and the motions of their parts."""
        return {}

    def cell_of(self, c: Constraints) -> NDArray[np.int32]:
        """Number of the superpixel at each constraint; cached, since each track asks for it."""
        known = self._cells_of.get(id(c))
        if known is None:
            known = self._cells_of[id(c)] = c, np.asarray(self.at[c.index])
        return known[1]

    @cached_property
    def _cells_of(self) -> dict[int, tuple[Constraints, NDArray[np.int32]]]:
        """The constraints, so that none takes the number of others, and their superpixels."""
        return {}


def min_region_area(scene: FrameMeasurements, settings: MotionSettings) -> float:
    """Least area of a region, working pixels."""
    return settings.min_area * scene.image.grey.size


def background_weights(scene: FrameMeasurements) -> Floats:
    """(N,) float32: 1 for points away from all objects, 0 for those in or beside one."""
    owner = scene.owner > 0
    near = scene.cells.dilated(owner[:, None], 1)[:, 0] if owner.any() else owner
    return (~near[scene.at]).astype(np.float32)


def predicted_positions(
    scene: FrameMeasurements, tracks: tuple[Track, ...], camera: Affine, lag: int, span: float
) -> Floats:
    """The predicted position of each point in an older image, (N, 2) float32."""
    at = scene.owner[scene.at]
    moved = camera.at(scene.points.xy)
    for k, t in enumerate(tracks, 1):
        mine = at == k
        if mine.any():
            main = max(range(len(t.motions)), key=lambda i: t.motions[i].support)
            moved[mine] = t.predicted(lag, span)[main].at(scene.points.xy[mine])
    return np.asarray(scene.points.xy - moved)


def claimable_cells(
    scene: FrameMeasurements, tracks: tuple[Track, ...], prior: Floats
) -> NDArray[np.bool_]:
    """Which cells each track may claim, (count, K) bool: its own, their neighbours, where it is hidden."""
    members = prior[:, 1:-1] > 0.3
    for k, t in enumerate(tracks):
        if t.occluded is not None:
            members[:, k] |= scene.cells.mean(t.occluded) > 0.3
    return scene.cells.dilated(members, REACH_STEPS)


def part_motions(scene: FrameMeasurements, tracks: Sequence[Track], c: Constraints) -> Motions:
    """The motions of the parts of K tracks over the baseline of some constraints, for compiled loops.

    Returns:
        (P, 2, 3) displacements, (P,) errors to allow for them, and (K + 1,) where the parts of each begin.
    """
    parts = [scene.parts(t, c) for t in tracks]
    slacks = [layer_slack(p, t.centre) for t, own in zip(tracks, parts, strict=True) for p in own]
    begin = np.cumsum([0, *map(len, parts)])
    matrices = np.array([p.matrix for own in parts for p in own]).reshape(-1, 2, 3)
    return matrices, np.array(slacks, dtype=np.float64), begin


def point_likelihoods(
    scene: FrameMeasurements,
    tracks: tuple[Track, ...],
    reach: NDArray[np.bool_],
    settings: MotionSettings,
) -> PointEvidence:
    """Log likelihood of every point under every label (the E step).

    Args:
        scene: The frame.
        tracks: K tracks.
        reach: (count, K) bool, which cells each track may claim.
        settings: Its `outlier` is the distance beyond which a motion no longer explains a point.

    Returns:
        For background, tracks and unknown motion. Only corners count as evidence for what is visible there:
        edges help to fit layers, but as evidence for labels they worsen silhouettes (docs/benchmarks.md).
    """
    n = len(scene.points)
    out = np.zeros((n, len(tracks) + 2), dtype=np.float32)
    has = np.zeros(n, dtype=bool)
    near = reach[scene.at]
    least = -0.5 * settings.outlier**2
    for m in scene.measured:
        c = m.constraints
        has[c.index] = True
        zero = m.background.log_likelihood(c)
        measured, motions = (c.xy, c.moved, c.information), part_motions(scene, tracks, c)
        add_track_likelihoods(out, c.index, measured, near, motions, 3 * least)
        out[c.index, 0] += np.maximum(zero, 3 * least)
        out[c.index, -1] += least
    return PointEvidence(scene.points, out, has & scene.points.corners())
