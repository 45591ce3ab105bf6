"""The state of a taught object from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.blob import Blob
from visup.percepts.appearance.looks.pose import PatchPose
from visup.percepts.appearance.looks.thing_model import Appearance

Bytes = NDArray[np.uint8]


class State(StrEnum):
    """The state of an object, as far as observed."""

    ABSENT = "absent"
    MOVING = "moving"
    RESTING = "resting"
    HIDDEN = "hidden"


IN_VIEW = (State.MOVING, State.RESTING)


@dataclass(frozen=True, slots=True, eq=False)
class RestMemory:
    """The pixels of an object at rest, to be compared with later frames.

    Attributes:
        blob: The object, as completely as observed.
        lab: (h, w, 3) uint8, Lab, of the blob's window.
    """

    blob: Blob
    lab: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ThingTrack:
    """The track of one object.

    Attributes:
        name: Name as taught.
        number: Number of the view that it matches, among all taught views.
        id: Id of its region, 0 until it is detected.
        state: Its state.
        pose: Its current or last pose, working pixels.
        looks: Its current appearance.
        visible: Its visible part; None when there is none.
        rest: Its rest memory; kept when it is covered at rest.
        path: (time, pose) of the last `PATH_S`, oldest first.
        peak: Last peak of its filter.
        explained: Share of its pixels that looked as expected.
        colours: Excess of its colours over those of the surroundings.
        seen: Time of the last observation, seconds.
        since: Time of the first observation, seconds.
        proven: Whether it has clearly matched a taught view.
        asked: Time of the last search of the whole picture for it, seconds.
    """

    name: str
    number: int
    id: int = 0
    state: State = State.ABSENT
    pose: PatchPose | None = None
    looks: Appearance | None = None
    visible: Blob | None = None
    rest: RestMemory | None = None
    path: tuple[tuple[float, PatchPose], ...] = ()
    peak: float = 0.0
    explained: float = 0.0
    colours: float = 0.0
    seen: float = -np.inf
    since: float = 0.0
    proven: bool = False
    asked: float = -np.inf
