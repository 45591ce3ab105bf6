"""The state of a taught object from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.rest_memory import RestMemory


class TrackState(StrEnum):
    """The state of an object, as far as observed."""

    ABSENT = "absent"
    MOVING = "moving"
    RESTING = "resting"
    HIDDEN = "hidden"


IN_VIEW = (TrackState.MOVING, TrackState.RESTING)


@dataclass(frozen=True, slots=True, eq=False)
class TaughtObjectTrack:
    """The track of one object.

    Attributes:
        name: Name as taught.
        view_number: Number of the view that it matches, among all taught views.
        id: Id of its region, 0 until it is detected.
        state: Its state.
        pose: Its current or last pose, working pixels.
        appearance: Its current appearance.
        visible: Its visible part; None when there is none.
        rest: Its rest memory; kept when it is covered at rest.
        path: (time, pose) of the last `PATH_S`, oldest first.
        peak: Last peak of its filter.
        explained_share: Share of its pixels that looked as expected.
        colour_excess: Excess of its colours over those of the surroundings.
        last_seen: Time of the last observation, seconds.
        first_seen: Time of the first observation, seconds.
        confirmed: Whether it has clearly matched a taught view.
        compared_at: Time of the last search of the whole image for it, seconds.
        instance: Number of the instance, from 1: several objects may look as taught (`instances.py`).
    """

    name: str
    view_number: int
    id: int = 0
    state: TrackState = TrackState.ABSENT
    pose: PatchPose | None = None
    appearance: Appearance | None = None
    visible: Blob | None = None
    rest: RestMemory | None = None
    path: tuple[tuple[float, PatchPose], ...] = ()
    peak: float = 0.0
    explained_share: float = 0.0
    colour_excess: float = 0.0
    last_seen: float = -np.inf
    first_seen: float = 0.0
    confirmed: bool = False
    compared_at: float = -np.inf
    instance: int = 1

    @property
    def key(self) -> str:
        """Its name among all tracks: the name as taught, and the number of a further instance."""
        return self.name if self.instance == 1 else f"{self.name} #{self.instance}"
