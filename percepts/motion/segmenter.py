"""Seeing motion: frames in, regions out, causally (paper, section 3).

Region and boundary work together: constraints are gathered where the image has structure, layers
of motion are fitted to them, superpixels between image edges are given to the layer that explains
them best, and the outlines so found say which constraints a layer may use in the next frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import cv2
import numpy as np

from visup.agent import Directive, Frame, Region
from visup.agent.contract.saving import saved_attributes
from visup.percepts.motion.features.constraints import (
    Constraints,
    Points,
    find_points,
    track,
    with_flow,
)
from visup.percepts.motion.features.image import Floats, History, WorkImage, prepare
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels, superpixels
from visup.percepts.motion.layers.camera_model import bare_ground, find_background
from visup.percepts.motion.layers.dense import label, looks
from visup.percepts.motion.layers.discovery import rate_of
from visup.percepts.motion.layers.layers import Affine
from visup.percepts.motion.layers.rate import Rate
from visup.percepts.motion.output.report import chosen, evidence_of, obey, report, sought
from visup.percepts.motion.static_camera.static_segmenter import RestingView
from visup.percepts.motion.tracks.lifecycle import bear, bury, confirm, update
from visup.percepts.motion.tracks.merge_split import absorb, merge, release
from visup.percepts.motion.tracks.salience import rests, weigh
from visup.percepts.motion.tracks.scene import (
    Measured,
    Scene,
    expected,
    explain,
    fit_tracks,
    outside,
    reach_of,
)
from visup.percepts.motion.tracks.trace import Looked
from visup.percepts.motion.tracks.tracking import Tracks, carry, priors
from visup.percepts.motion.tracks.warping import flow_back, warped

FARTHEST = 0.02  # share of the image that the camera may move over a baseline


class MotionSegmenter:
    """Finds and follows what moves by itself; one per video.

    Args:
        settings: What can be set.

    Attributes:
        settings: As given.
        looked: How the last frame was understood; None before the second one of a size.
    """

    def __init__(self, settings: MotionSettings | None = None) -> None:
        self.settings = settings or MotionSettings()
        # Cells and points do not need each other: one core each. What is found is the same.
        self._beside = ThreadPoolExecutor(max_workers=1, thread_name_prefix="motion")
        self._engine = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
        self._ids = 0  # never begun anew: a number that was told stays the region's
        self._reset((0, 0))

    def _reset(self, size: tuple[int, int]) -> None:
        self._size = size
        self.looked: Looked | None = None
        self._history = History(max(self.settings.lags_s) * 1.1)
        self._tracks: Tracks = ()
        self._cells: Superpixels | None = None
        self._ground = bare_ground((1, 1))
        self._camera: dict[int, Rate] = {}
        self._fixed_until: float | None = None
        self._resting = RestingView()
        self._count = self._born = 0

    @property
    def resting(self) -> bool:
        """Whether the camera is seen to rest, and what moves is told before the picture of that."""
        return self._resting.active

    def save(self) -> dict[str, Any]:
        """All that is remembered of the frames so far; see `visup.agent.storage.checkpoint`."""
        return saved_attributes(self, "settings", "looked", "_beside", "_engine")

    def load(self, state: Mapping[str, Any]) -> None:
        """Take on what a segmenter of the same settings remembered."""
        vars(self).update(state)

    def used(self, region_id: int) -> None:
        """A region of this id was told before: none is called so anew."""
        self._ids = max(self._ids, region_id)

    def step(self, frame: Frame, directives: Sequence[Directive] = ()) -> tuple[Region, ...]:
        """Segment one frame.

        Args:
            frame: The next frame of the video; (H, W), (H, W, 1) or (H, W, 3) uint8.
            directives: 'expect_regions', 'look_at' and 'ignore' are obeyed.

        Returns:
            The regions, by id. None in the first frame, or when the image size has changed.
        """
        if frame.size != self._size:
            self._reset(frame.size)
        image = prepare(frame, self.settings.work_size)
        self._history.push(image)
        self._count += 1
        before = self._cells
        if before is None:
            self._cells = superpixels(image, self.settings.cell, self.settings.contrast)
            self._ground = bare_ground(image.shape)
            return ()
        scene, carried, prior = self._look(image, before)
        cells = self._cells = scene.cells
        known = fit_tracks(carried, scene)
        tracks = bear(known, scene, self.settings, self._born)
        self._born = max([self._born, *(t.key for t in tracks)])
        if tracks != known:  # what was seen before is expected where it was
            prior = priors(tracks, cells)
        near = reach_of(scene, tracks, prior)
        old = self._history.back(scene.measured[-1].constraints.lag)
        dense = self._beside.submit(warped, scene, tracks, old, near, self.settings.noise)
        likelihood, has = explain(scene, tracks, near, self.settings)
        likelihood = obey(directives, scene, likelihood)
        look = looks(cells, prior)
        more = dense.result()
        stay = np.zeros(cells.count, dtype=bool)
        for t in tracks:
            if rests(t, scene):
                stay |= t.share > 0.5
        posterior = label(
            cells, scene.points, likelihood, has, prior, look, more, stay, self.settings
        )
        keys = tuple(t.key for t in tracks)
        winner = posterior.argmax(axis=1)
        tracks = update(tracks, scene, posterior, winner, likelihood, self.settings)
        tracks = weigh(tracks, scene, winner)
        evidence = evidence_of(scene, winner, likelihood, has)
        tracks = absorb(tracks, scene, winner, self.settings, self._born)
        self._born = max([self._born, *(t.key for t in tracks)])
        tracks = release(tracks, scene, winner)
        tracks = merge(tracks, scene, winner, self.settings)
        tracks = bury(tracks, scene, self.settings)
        wanted = sought(directives, tracks, scene)
        tracks, self._ids = confirm(tracks, scene, self._ids, self.settings, wanted)
        self._tracks = tracks
        self.looked = Looked(scene, tracks, keys, posterior)
        seen = report(tracks, scene, self._size, self.settings, self._beside)
        seen, self._ids = self._resting.step(frame, scene, seen, self._ids, self.settings, evidence)
        return chosen(seen, directives)

    def _look(self, image: WorkImage, before: Superpixels) -> tuple[Scene, Tracks, Floats]:
        """Measure motion, and carry the tracks to the newest image, with where they are expected."""
        cell, old = self.settings.cell, self._history.back(1)
        seconds = image.time - old.time
        found = self._beside.submit(find_points, image, cell, self.settings.noise)
        coming = self._beside.submit(superpixels, image, cell, self.settings.contrast)
        flow = flow_back(image.grey, old.grey, self._engine)
        carried = self._beside.submit(self._carried, flow, before, coming, seconds)
        points = found.result()
        first = self._follow(points, flow, old, image)
        cells, tracks, prior = carried.result()
        owner = prior.argmax(axis=1)
        scene = Scene(image, points, cells, owner, seconds, ())
        later = [self._later(scene, tracks, lag) for lag in self._turn(image)]
        measured = [self._measure(scene, first)]
        measured += [self._measure(scene, c.result()) for c in later]
        return Scene(image, points, cells, owner, seconds, tuple(measured)), tracks, prior

    def _carried(
        self, flow: Floats, before: Superpixels, coming: Future[Superpixels], seconds: float
    ) -> tuple[Superpixels, Tracks, Floats]:
        """The newest cells, the tracks carried there, and the labels expected of the cells."""
        cells = coming.result()  # one worker does one thing after the other: it is there
        tracks = carry(self._tracks, flow, before, cells, seconds)
        return cells, tracks, priors(tracks, cells)

    def _turn(self, image: WorkImage) -> list[int]:
        """The longer baseline whose turn it is: they are measured one in each frame.

        Long ones are for slow things. When the camera has turned far away since, there is little to
        compare, and what there is misleads.
        """
        far = FARTHEST * max(image.shape)
        lags = [
            lag
            for lag in self._history.lags(self.settings.lags_s)
            if lag > 1 and self._turned(image, lag) < far
        ]
        return [lags[self._count % len(lags)]] if lags else []

    def _turned(self, image: WorkImage, lag: int) -> float:
        """How far the camera is predicted to have moved the middle of the image, pixels."""
        camera = self._predicted(image.time, image.time - self._history.back(lag).time)
        middle = np.asarray([image.shape[::-1]], dtype=np.float32) / np.float32(2)
        return float(np.hypot(*camera.at(middle)[0]))

    def _follow(
        self, points: Points, flow: Floats, old: WorkImage, image: WorkImage
    ) -> Constraints:
        """Constraints over one frame, from where dense flow expects the points."""
        x, y = points.xy.astype(np.int64).T
        c = track(points, points.xy + flow[y, x], old, image, 1, self.settings.noise)
        return with_flow(c, points, flow, old, image, self.settings.noise)

    def _later(self, scene: Scene, tracks: Tracks, lag: int) -> Future[Constraints]:
        """Begin to look for the points over a longer baseline, where known motions expect them."""
        old = self._history.back(lag)
        span = scene.time - old.time
        guess = expected(scene, tracks, self._predicted(scene.time, span), lag, span)
        noise = self.settings.noise
        return self._beside.submit(track, scene.points, guess, old, scene.image, lag, noise)

    def _measure(self, scene: Scene, c: Constraints) -> Measured:
        """The background that constraints over one baseline show."""
        image, lag = scene.image, c.lag
        camera = self._predicted(image.time, c.span_s)
        # Until a baseline is long enough to tell, what is still in the image may be background.
        still_too = self._fixed_until is None or image.time < self._fixed_until
        clear = outside(scene)[c.index]
        bg = find_background(c, clear, image.shape, camera, still_too, self._ground, lag)
        self._ground = bg.ground
        if bg.fixed is not None:
            until = self._fixed_until or 0.0
            hold = image.time + 2 * max(self.settings.lags_s)
            self._fixed_until = max(until, hold) if bg.fixed else until
        if bg.sure:
            self._camera[lag] = rate_of(bg.models[-1], c, image.time)
        return Measured(c, bg)

    def _predicted(self, now: float, span: float) -> Affine:
        """The camera's motion over a baseline, from the nearest baseline that showed it of late."""
        fresh = [r for r in self._camera.values() if now - r.time < 1.0]
        if not fresh:
            return Affine(np.zeros((2, 3)))
        nearest = min(fresh, key=lambda r: abs(np.log(r.span_s / span)))
        bend = None if nearest.bend is None else nearest.bend * span
        return Affine(nearest.matrix * span, bend=bend)
