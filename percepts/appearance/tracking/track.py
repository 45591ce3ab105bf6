"""What is believed of a taught thing from frame to frame."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.pose import PatchPose, Window
from visup.percepts.appearance.looks.thing_model import Appearance

Bytes = NDArray[np.uint8]


class State(StrEnum):
    """What a thing is doing, as far as it is seen."""

    ABSENT = "absent"
    MOVING = "moving"
    RESTING = "resting"
    HIDDEN = "hidden"


IN_VIEW = (State.MOVING, State.RESTING)


@dataclass(frozen=True, slots=True, eq=False)
class Blob:
    """Pixels of the working picture.

    Attributes:
        window: (left, top, right, bottom), half open.
        mask: (bottom - top, right - left) bool.
    """

    window: Window
    mask: NDArray[np.bool_]

    @property
    def area(self) -> int:
        """Pixels in the mask."""
        return int(np.count_nonzero(self.mask))


@dataclass(frozen=True, slots=True, eq=False)
class RestMemory:
    """What the picture shows where a thing rests.

    Attributes:
        blob: The thing, whole as far as it was seen.
        lab: (h, w, 3) uint8, Lab, of the blob's window.
    """

    blob: Blob
    lab: Bytes


@dataclass(frozen=True, slots=True, eq=False)
class ThingTrack:
    """One thing.

    Attributes:
        name: As it was taught.
        number: Of the view that it looks like, among all taught views.
        id: Of its region, 0 until it is seen.
        state: What it is doing.
        pose: Where it is, or was last believed to be; working pixels.
        looks: How it looks now.
        visible: What is seen of it; None when nothing is.
        rest: What is remembered while it rests.
        path: (time, pose) of the last half second, oldest first.
        peak: How strongly its filter answered last.
        explained: Share of its pixels that looked as they should.
        colours: How much more of its colours it showed than what is around it.
        seen: When it was last seen, seconds.
        since: When it was first seen, seconds.
        proven: Whether it has looked beyond doubt as it was taught.
        asked: When the whole picture was last searched for it, seconds.
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
