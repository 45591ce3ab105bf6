"""The foreground of a video, frame by frame: cues, then belief, then objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground._cues_jit import nearest_lengths
from visup.percepts.motion.foreground.belief import Belief, initial_belief, update_belief
from visup.percepts.motion.foreground.cues import (
    CueMemory,
    FrameCues,
    TrackCues,
    track_cues,
    with_tracks,
)
from visup.percepts.motion.foreground.objects import (
    ForegroundObjects,
    ReportingConditions,
    TrackCells,
    initial_objects,
    update_objects,
)
from visup.percepts.motion.foreground.perceptron import ForegroundModel
from visup.percepts.motion.tracks.measurements import FrameMeasurements
from visup.percepts.motion.tracks.track import Track

CALM_PX = 0.25  # medians: cameras at rest and in orbit 0.00; travelling or panning ones 0.5 to 34
NEWEST_WEIGHT = 0.2  # weight of the newest frame in the running mean


@dataclass(frozen=True, slots=True, eq=False)
class ForegroundState:
    """The state of the foreground filter after a frame.

    Attributes:
        memory: State of the cues; None before the first frame.
        belief: The belief in its superpixels.
        objects: The objects formed from it.
        ground_px: Running mean of the background's displacement per frame, working pixels; None before it
            was measured.
    """

    memory: CueMemory | None
    belief: Belief
    objects: ForegroundObjects
    ground_px: float | None = None

    @property
    def calm(self) -> bool:
        """Whether the background hardly moves: then tracks over long baselines beat single frames."""
        return self.ground_px is not None and self.ground_px < CALM_PX

    @property
    def moves(self) -> bool:
        """Whether the background is known to move: then a quicker search for points does.

        While it is calm, tracks decide what is reported, and they lose by it.
        """
        return self.ground_px is not None and not self.calm


def with_ground_motion(state: ForegroundState, scene: FrameMeasurements) -> ForegroundState:
    """The state with the running mean of the background's displacement updated.

    Args:
        state: The state after the previous frame.
        scene: The frame as measured.
    """
    x, y = scene.cells.centre.astype(np.int64).T
    models = scene.measured[0].background.models
    ground = np.stack([model.at(scene.cells.centre) for model in models])
    speed = float(np.median(nearest_lengths(ground, scene.flow[y, x])))
    before = speed if state.ground_px is None else state.ground_px
    return replace(state, ground_px=before + NEWEST_WEIGHT * (speed - before))


def initial_foreground() -> ForegroundState:
    """The state before the first frame of a size."""
    return ForegroundState(None, initial_belief(), initial_objects())


@dataclass(frozen=True, slots=True, eq=False)
class TrackPosterior:
    """The tracks of a frame and the posterior of its superpixels over them.

    Attributes:
        tracks: The tracks after the frame.
        keys: Keys of the K tracks that superpixels were assigned to.
        posterior: (count, K + 2) float32, shares of background, tracks and unknown motion.
    """

    tracks: tuple[Track, ...]
    keys: tuple[int, ...]
    posterior: Floats

    def cells(self, now: float) -> TrackCells:
        """The reported tracks observed at `now`, seconds, and the cells where they prevail."""
        alive = [t for t in self.tracks if t.id > 0]
        seen = [t for t in alive if t.last_seen == now and t.key in self.keys]
        place = np.zeros(len(self.keys) + 2, dtype=np.int64)
        for number, t in enumerate(seen, 1):
            place[self.keys.index(t.key) + 1] = number
        winner = place[self.posterior.argmax(axis=1)]
        share = np.where(winner > 0, self.posterior.max(axis=1), 0).astype(np.float32)
        return TrackCells([t.id for t in seen], {t.id for t in alive}, winner, share)

    def cues(self) -> TrackCues:
        """Their evidence on the superpixels."""
        reported = {t.key for t in self.tracks if t.id > 0}
        confirmed = np.array([key in reported for key in self.keys], dtype=bool)
        return track_cues(self.posterior, confirmed)


def update_foreground(
    state: ForegroundState,
    model: ForegroundModel,
    scene: FrameMeasurements,
    shown: tuple[FrameCues, CueMemory],
    tracked: TrackPosterior,
    conditions: ReportingConditions,
) -> tuple[FrameCues, ForegroundState]:
    """The foreground after a frame.

    Args:
        state: The state after the previous frame, with the ground's motion in this one.
        model: The trained model.
        scene: The frame as measured.
        shown: Its cues that need no tracks, and their memory (`flow_cues`).
        tracked: Its tracks.
        conditions: Conditions on objects.

    Returns:
        The cues of the frame, and the state.
    """
    cues, memory = with_tracks(shown[0], tracked.cues()), shown[1]
    belief = update_belief(state.belief, cues, model)
    tracks = tracked.cells(scene.time)
    objects = update_objects(state.objects, cues, belief, tracks, scene.time, conditions)
    return cues, replace(state, memory=memory, belief=belief, objects=objects)
