"""The foreground of a video, frame by frame: cues, then the belief, then the objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.foreground.belief import Belief, unbiased, updated
from visup.percepts.motion.foreground.cues import (
    NAMES,
    CueMemory,
    FrameCues,
    TrackCues,
    frame_cues,
    track_cues,
)
from visup.percepts.motion.foreground.objects import (
    Admission,
    ForegroundObjects,
    TrackCells,
    follow_objects,
    no_objects,
)
from visup.percepts.motion.foreground.perceptron import ForegroundModel
from visup.percepts.motion.tracks.measurements import FrameMeasurements
from visup.percepts.motion.tracks.track import Track

GROUND_SPEED = NAMES.index("ground_speed")
CALM_PX = (
    0.25  # cameras at rest and in orbit: 0.00 in the median; those that travel or pan: 0.5 to 34
)
FOLLOW = 0.2  # weight of the newest frame in the running mean


@dataclass(frozen=True, slots=True, eq=False)
class ForegroundState:
    """What is known of the foreground after a frame.

    Attributes:
        memory: What the cues of the next frame need; None before the first.
        belief: Of its superpixels.
        objects: Those that it is made of.
        ground_px: Running mean of how far the ground goes from frame to frame, working pixels.
    """

    memory: CueMemory | None
    belief: Belief
    objects: ForegroundObjects
    ground_px: float = 0.0

    @property
    def calm(self) -> bool:
        """Whether the ground hardly moves: then tracks, over long baselines, tell more than single frames."""
        return self.ground_px < CALM_PX


def no_foreground() -> ForegroundState:
    """Before the first frame of a size."""
    return ForegroundState(None, unbiased(), no_objects())


@dataclass(frozen=True, slots=True, eq=False)
class TrackPosterior:
    """The tracks of a frame, and which superpixels are theirs.

    Attributes:
        tracks: After the frame.
        keys: Of the K tracks that superpixels were shared among.
        posterior: (count, K + 2) float32, shares of background, tracks and unknown motion.
    """

    tracks: tuple[Track, ...]
    keys: tuple[int, ...]
    posterior: Floats

    def cells(self, now: float) -> TrackCells:
        """The reported tracks that are seen at a time, seconds, and the cells where they prevail."""
        alive = [t for t in self.tracks if t.id > 0]
        seen = [t for t in alive if t.last_seen == now and t.key in self.keys]
        place = np.zeros(len(self.keys) + 2, dtype=np.int64)
        for number, t in enumerate(seen, 1):
            place[self.keys.index(t.key) + 1] = number
        winner = place[self.posterior.argmax(axis=1)]
        share = np.where(winner > 0, self.posterior.max(axis=1), 0).astype(np.float32)
        return TrackCells([t.id for t in seen], {t.id for t in alive}, winner, share)

    def cues(self) -> TrackCues:
        """What they say of the superpixels."""
        reported = {t.key for t in self.tracks if t.id > 0}
        confirmed = np.array([key in reported for key in self.keys], dtype=bool)
        return track_cues(self.posterior, confirmed)


def follow_foreground(
    state: ForegroundState,
    model: ForegroundModel,
    scene: FrameMeasurements,
    old: WorkImage,
    tracked: TrackPosterior,
    admission: Admission,
) -> tuple[FrameCues, ForegroundState]:
    """The foreground after a frame.

    Args:
        state: After the frame before.
        model: What was learnt.
        scene: The frame as measured.
        old: The image before.
        tracked: Its tracks.
        admission: What is asked of an object.

    Returns:
        The cues of the frame, and the state.
    """
    cues, memory = frame_cues(scene, scene.flow, old, tracked.cues(), state.memory)
    belief = updated(state.belief, cues, model)
    tracks = tracked.cells(scene.time)
    objects = follow_objects(state.objects, cues, belief, tracks, scene.time, admission)
    speed = float(np.exp(cues.values[0, GROUND_SPEED])) - 0.1
    known = state.ground_px if state.memory is not None else speed
    return cues, ForegroundState(memory, belief, objects, known + FOLLOW * (speed - known))
