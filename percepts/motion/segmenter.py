"""The motion segmenter: frames in, regions out, causally (paper, section 3).

Region and boundary cues work together: constraints are gathered where the image has structure, layers of
motion are fitted to them, superpixels between image edges are assigned to the layer that explains them
best, and the resulting outlines decide which constraints a layer may use in the next frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from typing import Any, TypeVar

import cv2
import numpy as np

from visup.agent import Directive, Frame, Region
from visup.agent.contract.saving import saved_attributes
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.sky_segmenter import DarkSkySegmenter
from visup.percepts.motion.executors import second_core
from visup.percepts.motion.features.motion_constraints import (
    Constraints,
    Points,
    add_flow_constraints,
    find_points,
    track_points,
)
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels, superpixels
from visup.percepts.motion.features.work_image import Floats, ImageHistory, WorkImage, prepare_image
from visup.percepts.motion.foreground.cues import CueMemory, FrameCues, flow_cues
from visup.percepts.motion.foreground.foreground_tracking import (
    TrackPosterior,
    initial_foreground,
    update_foreground,
    with_ground_motion,
)
from visup.percepts.motion.foreground.objects import ReportingConditions
from visup.percepts.motion.foreground.perceptron import (
    ForegroundModel,
    read_model,
    shipped_model,
)
from visup.percepts.motion.layers.affine import Affine
from visup.percepts.motion.layers.affine_rate import AffineRate
from visup.percepts.motion.layers.background_motion import (
    ExpectedBackground,
    empty_prevalence,
    fit_background,
)
from visup.percepts.motion.layers.camera_sway import CameraSway
from visup.percepts.motion.layers.dense_labelling import (
    Labelling,
    LabelPrior,
    PointEvidence,
    appearance_prior,
    label_cells,
)
from visup.percepts.motion.layers.layer_discovery import affine_rate
from visup.percepts.motion.output.cast_shadows import CastShadowFilter
from visup.percepts.motion.output.region_report import (
    OutlinedFrame,
    apply_ignore,
    motion_evidence,
    report_objects,
    report_regions,
    select_regions,
    tracks_to_look_at,
)
from visup.percepts.motion.output.segmentation_trace import SegmentationTrace
from visup.percepts.motion.static_camera.static_segmenter import StaticCameraSegmenter
from visup.percepts.motion.tracks import lifecycle
from visup.percepts.motion.tracks.id_allocator import IdAllocator
from visup.percepts.motion.tracks.measurements import (
    BaselineMotion,
    FrameMeasurements,
    background_weights,
    claimable_cells,
    min_region_area,
    point_likelihoods,
    predicted_positions,
)
from visup.percepts.motion.tracks.merge_split import assign_unknown, merge_tracks, split_occluded
from visup.percepts.motion.tracks.salience import (
    moves_like_standing,
    stationary_cells,
    update_salience,
)
from visup.percepts.motion.tracks.track import Track, Tracks
from visup.percepts.motion.tracks.track_fitting import fit_tracks
from visup.percepts.motion.tracks.track_prediction import label_priors, predict_tracks
from visup.percepts.motion.tracks.warping import dense_likelihood, flow_back

Numbered = TypeVar("Numbered", Track, Region)
FlowCues = Future[tuple[FrameCues, CueMemory]]
MAX_CAMERA_SHIFT = 0.02  # farthest the camera may move over a baseline, as a share of the image


class MotionSegmenter:
    """Segments and tracks independent motion; one per video.

    Args:
        settings: Settings.
        model: Foreground model; as the settings say when None. A given one is evaluated in every frame,
            else it is skipped while the background hardly moves, when its result would not be used.

    Attributes:
        settings: As given.
        trace: Intermediate results of the last frame; None before the second one of a size.
    """

    def __init__(
        self, settings: MotionSettings | None = None, model: ForegroundModel | None = None
    ) -> None:
        self.settings = settings or MotionSettings()
        # Cells and points are independent: one core each, with the same results.
        self._executor = second_core()
        self._engine = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
        self._ids = IdAllocator()
        self._model = model or _model(self.settings)
        self._always = model is not None
        self._reset((0, 0))

    def _reset(self, size: tuple[int, int]) -> None:
        self._size = size
        self.trace: SegmentationTrace | None = None
        self._history = ImageHistory(max(self.settings.lags_s) * 1.1)
        self._tracks: Tracks = ()
        self._cells: Superpixels | None = None
        self._prevalence = empty_prevalence((1, 1))
        self._camera: dict[int, AffineRate] = {}
        self._camera_fixed_until: float | None = None
        self._static = StaticCameraSegmenter()
        self._sway = CameraSway()
        self._shadows = CastShadowFilter()
        self._sky = DarkSkySegmenter()
        self._foreground = initial_foreground()
        self._count = self._last_key = 0

    @property
    def camera_static(self) -> bool:
        """Whether the camera appears static, so that background subtraction is in use."""
        return self._static.active

    def save(self) -> dict[str, Any]:
        """The state after the frames so far; see `visup.agent.storage.checkpoint`."""
        return saved_attributes(self, "settings", "trace", "_executor", "_engine", "_model")

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a segmenter with the same settings."""
        vars(self).update(state)

    def reserve_id(self, region_id: int) -> None:
        """Reserve the id of a region reported before."""
        self._ids.reserve(region_id)

    def new_id(self) -> int:
        """An id that no region has had, for objects detected by other means."""
        return self._ids.new()

    def step(self, frame: Frame, directives: Sequence[Directive] = ()) -> tuple[Region, ...]:
        """Segment one frame.

        Args:
            frame: The next frame of the video; (H, W), (H, W, 1) or (H, W, 3) uint8.
            directives: 'expect_regions', 'look_at' and 'ignore' are obeyed.

        Returns:
            The regions, by id. Empty in the first frame and after a change of image size.
        """
        if frame.size != self._size:
            self._reset(frame.size)
        image = prepare_image(frame, self.settings.work_size)
        self._history.push(image)
        self._count += 1
        if self._cells is None:
            self._begin(image)
            return ()
        scene, predicted, prior = self._measure(image, self._cells)
        self._cells = scene.cells
        tracks, prior = self._with_new_tracks(fit_tracks(predicted, scene), scene, prior)
        evidence, labelling, shown = self._label(scene, tracks, prior, directives)
        keys = tuple(t.key for t in tracks)
        tracks = self._updated(tracks, scene, evidence, labelling)
        ground = scene.measured[0].background.models[-1]
        self._sway = self._sway.after(ground.shift((image.shape[1] / 2, image.shape[0] / 2)))
        requested = tracks_to_look_at(directives, tracks, scene)
        context = lifecycle.ConfirmContext(requested, self._sway.in_place)
        tracks = self._tracks = lifecycle.confirm(tracks, scene, self._ids, self.settings, context)
        self._follow_foreground(scene, shown, TrackPosterior(tracks, keys, labelling.posterior))
        regions = self._report(scene, tracks)
        moving = motion_evidence(scene, labelling.winner, evidence)
        regions = self._static.step(frame, scene, regions, self._ids, self.settings, moving)
        regions = self._shadows.step(frame, scene, regions, static=self._static.active)
        regions = self._sky.step(frame, scene, regions, self._ids, self.settings)
        return select_regions(regions, directives)

    @property
    def _uses_model(self) -> bool:
        """Whether the foreground model is evaluated in this frame."""
        unused = self._static.active or self._foreground.calm
        return self._model is not None and (self._always or not unused)

    def _follow_foreground(
        self, scene: FrameMeasurements, shown: FlowCues | None, tracked: TrackPosterior
    ) -> None:
        """Update the foreground belief and its objects, if there is a model."""
        self._foreground = with_ground_motion(self._foreground, scene)
        if self._model is None or shown is None:
            self._foreground = replace(self._foreground, memory=None)
            tracks = self._with_object_ids(tracked.tracks)
            self.trace = SegmentationTrace(scene, tracks, tracked.keys, tracked.posterior)
            return
        least, stands = min_region_area(scene, self.settings), partial(moves_like_standing, scene)
        conditions = ReportingConditions(least, self._ids, stands, alone=not self._foreground.calm)
        cues, self._foreground = update_foreground(
            self._foreground, self._model, scene, shown.result(), tracked, conditions
        )
        tracks = self._with_object_ids(tracked.tracks)
        share = self._foreground.belief.share
        self.trace = SegmentationTrace(scene, tracks, tracked.keys, tracked.posterior, cues, share)

    def _report(self, scene: FrameMeasurements, tracks: Tracks) -> tuple[Region, ...]:
        """Regions of the foreground objects; of the tracks while the background hardly moves."""
        frame = OutlinedFrame(scene, self._history.back(1), self._size)
        asked = self._foreground.memory is not None
        if asked and not (self._static.active or self._foreground.calm):
            return report_objects(self._foreground, tracks, frame, self.settings, self._executor)
        found = report_regions(tracks, frame, self.settings, self._executor)
        return self._with_object_ids(found)

    def _with_object_ids(self, found: Sequence[Numbered]) -> tuple[Numbered, ...]:
        """Tracks, or their regions, under the ids of the objects they belong to."""
        known = self._foreground.objects
        return tuple(replace(one, id=known.id_of_track(one.id)) for one in found)

    def _begin(self, image: WorkImage) -> None:
        """Initialise from the first frame of a size, which has nothing to be compared with."""
        self._cells = superpixels(image, self.settings.cell, self.settings.contrast)
        self._prevalence = empty_prevalence(image.shape)

    def _with_new_tracks(
        self, known: Tracks, scene: FrameMeasurements, prior: Floats
    ) -> tuple[Tracks, Floats]:
        """The tracks with new ones added, and the label priors of all."""
        tracks = lifecycle.initiate(known, scene, self.settings, self._last_key)
        self._note_keys(tracks)
        # Without new tracks the prior is unchanged.
        return tracks, prior if tracks == known else label_priors(tracks, scene.cells)

    def _note_keys(self, tracks: Tracks) -> None:
        self._last_key = max([self._last_key, *(t.key for t in tracks)])

    def _label(
        self,
        scene: FrameMeasurements,
        tracks: Tracks,
        prior: Floats,
        directives: Sequence[Directive],
    ) -> tuple[PointEvidence, Labelling, FlowCues | None]:
        """Evidence of the points for the tracks, and the labels of the superpixels that follow (the E step).

        Also the foreground cues from flow, where they are needed: they are computed in parallel.
        """
        near, noise = claimable_cells(scene, tracks, prior), self.settings.noise
        old = self._history.back(scene.measured[-1].constraints.lag)
        dense = self._executor.submit(dense_likelihood, scene, tracks, old, near, noise)
        last, memory = self._history.back(1), self._foreground.memory
        shown = self._executor.submit(flow_cues, scene, last, memory) if self._uses_model else None
        evidence = point_likelihoods(scene, tracks, near, self.settings)
        evidence = apply_ignore(directives, scene, evidence)
        by_appearance = appearance_prior(scene.cells, prior)
        expected = LabelPrior(prior, by_appearance, stationary_cells(tracks, scene))
        found = label_cells(scene.cells, evidence, dense.result(), expected, self.settings)
        return evidence, found, shown

    def _updated(
        self,
        tracks: Tracks,
        scene: FrameMeasurements,
        evidence: PointEvidence,
        labelling: Labelling,
    ) -> Tracks:
        """The tracks updated from the labels; parts merged, occluded ones split, lost ones deleted."""
        winner, settings = labelling.winner, self.settings
        tracks = lifecycle.update_tracks(tracks, scene, labelling, evidence.likelihood, settings)
        tracks = update_salience(tracks, scene, winner)
        tracks = assign_unknown(tracks, scene, winner, settings, self._last_key)
        self._note_keys(tracks)
        tracks = split_occluded(tracks, scene, winner)
        tracks = merge_tracks(tracks, scene, winner, settings)
        return lifecycle.delete(tracks, scene, settings)

    def _measure(
        self, image: WorkImage, before: Superpixels
    ) -> tuple[FrameMeasurements, Tracks, Floats]:
        """Measure motion and predict the tracks, with the label priors, in the newest image."""
        cell, old = self.settings.cell, self._history.back(1)
        seconds = image.time - old.time
        found = self._executor.submit(find_points, image, cell, self.settings.noise)
        coming = self._executor.submit(superpixels, image, cell, self.settings.contrast)
        flow = flow_back(image.grey, old.grey, self._engine)
        carried = self._executor.submit(self._predict_tracks, flow, before, coming, seconds)
        points = found.result()
        first = self._track_one_frame(points, flow, old, image)
        cells, tracks, prior = carried.result()
        owner = prior.argmax(axis=1)
        scene = FrameMeasurements(image, points, cells, owner, seconds, flow, ())
        later = [self._begin_tracking(scene, tracks, lag) for lag in self._long_lags(image)]
        measured = [self._baseline(scene, first)]
        measured += [self._baseline(scene, c.result()) for c in later]
        return (
            FrameMeasurements(image, points, cells, owner, seconds, flow, tuple(measured)),
            tracks,
            prior,
        )

    def _predict_tracks(
        self, flow: Floats, before: Superpixels, coming: Future[Superpixels], seconds: float
    ) -> tuple[Superpixels, Tracks, Floats]:
        """The newest cells, the predicted tracks, and the label priors of the cells."""
        cells = coming.result()  # the single worker runs jobs in order, so this one is finished
        tracks = predict_tracks(self._tracks, flow, before, cells, seconds)
        return cells, tracks, label_priors(tracks, cells)

    def _long_lags(self, image: WorkImage) -> list[int]:
        """The longer baseline to measure in this frame: they take turns, one per frame.

        They serve slow motion. When the camera has turned far, there is little to compare, which misleads;
        while it moves, single frames decide what is reported, and every other frame is enough.
        """
        every, far = 2 if self._foreground.moves else 1, MAX_CAMERA_SHIFT * max(image.shape)
        wanted = () if self._count % every else self.settings.lags_s
        all_ = self._history.lags(wanted)
        lags = [lag for lag in all_ if lag > 1 and self._camera_shift(image, lag) < far]
        return [lags[self._count // every % len(lags)]] if lags else []

    def _camera_shift(self, image: WorkImage, lag: int) -> float:
        """Predicted displacement of the image centre by the camera, pixels."""
        camera = self._predict_camera(image.time, image.time - self._history.back(lag).time)
        middle = np.asarray([image.shape[::-1]], dtype=np.float32) / np.float32(2)
        return float(np.hypot(*camera.at(middle)[0]))

    def _track_one_frame(
        self, points: Points, flow: Floats, old: WorkImage, image: WorkImage
    ) -> Constraints:
        """Constraints over one frame, from where dense flow expects the points."""
        x, y = points.xy.astype(np.int64).T
        guess, noise = points.xy + flow[y, x], self.settings.noise
        c = track_points(points, guess, (old, image), 1, noise, nearby=self._foreground.moves)
        return add_flow_constraints(c, points, flow, old, image, self.settings.noise)

    def _begin_tracking(
        self, scene: FrameMeasurements, tracks: Tracks, lag: int
    ) -> Future[Constraints]:
        """Start tracking points over a longer baseline, from where known motions predict them."""
        old = self._history.back(lag)
        span = scene.time - old.time
        camera = self._predict_camera(scene.time, span)
        guess = predicted_positions(scene, tracks, camera, lag, span)
        noise = self.settings.noise
        track = partial(track_points, nearby=self._foreground.moves)
        return self._executor.submit(track, scene.points, guess, (old, scene.image), lag, noise)

    def _baseline(self, scene: FrameMeasurements, c: Constraints) -> BaselineMotion:
        """The background motion fitted to the constraints over one baseline."""
        image, lag = scene.image, c.lag
        camera = self._predict_camera(image.time, c.span_s)
        # Until some baseline is long enough to tell, what stays still in the image may be background.
        fixed_too = self._camera_fixed_until is None or image.time < self._camera_fixed_until
        clear = background_weights(scene)[c.index]
        expected = ExpectedBackground(camera, fixed_too, self._prevalence)
        bg = fit_background(c, clear, image.shape, expected, lag)
        self._prevalence = bg.prevalence
        if bg.fixed is not None:
            until = self._camera_fixed_until or 0.0
            hold = image.time + 2 * max(self.settings.lags_s)
            self._camera_fixed_until = max(until, hold) if bg.fixed else until
        if bg.sure:
            self._camera[lag] = affine_rate(bg.models[-1], c, image.time)
        return BaselineMotion(c, bg)

    def _predict_camera(self, now: float, span: float) -> Affine:
        """The camera's motion over a baseline, from the nearest baseline with a recent estimate."""
        fresh = [r for r in self._camera.values() if now - r.time < 1.0]
        if not fresh:
            return Affine(np.zeros((2, 3)))
        nearest = min(fresh, key=lambda r: abs(np.log(r.span_s / span)))
        bend = None if nearest.bend is None else nearest.bend * span
        return Affine(nearest.matrix * span, bend=bend)


def _model(settings: MotionSettings) -> ForegroundModel | None:
    """The foreground model, if the settings enable it."""
    if settings.foreground is not None:
        return read_model(settings.foreground)
    return shipped_model() if settings.learnt else None
