"""The measurements of one frame: points, superpixels, and motion over several baselines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.motion_constraints import Constraints, Points
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.layers.affine import Affine, log_likelihood
from visup.percepts.motion.layers.background_motion import BackgroundMotion
from visup.percepts.motion.layers.dense_labelling import PointEvidence
from visup.percepts.motion.layers.layer_discovery import layer_slack
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

    def cell_of(self, c: Constraints) -> NDArray[np.int32]:
        """Number of the superpixel at each constraint."""
        return np.asarray(self.at[c.index])


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
        for k, t in enumerate(tracks, 1):
            parts = t.predicted(c.lag, c.span_s)
            within = np.flatnonzero(near[c.index, k - 1])
            some = c.take(within)
            each = [log_likelihood(p, some, layer_slack(p, t.centre)) for p in parts]
            fit = np.full(len(c), 3 * least, dtype=np.float32)
            fit[within] = np.maximum(np.max(each, axis=0), 3 * least)
            out[c.index, k] += fit
        out[c.index, 0] += np.maximum(zero, 3 * least)
        out[c.index, -1] += least
    return PointEvidence(scene.points, out, has & scene.points.corners())
