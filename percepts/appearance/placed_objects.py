"""The behaviour that learns, from the first frame, the objects that a task identifies only by position."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from visup.agent import Contract, Directive, Frame, Observation, Percept
from visup.agent.contract.contract import COMPILING_HANG_S
from visup.agent.model.errors import SettingsError
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.motion.behaviour import image_is_sound
from visup.percepts.taught.point_segmentation import outline_at_point
from visup.percepts.taught.taught_view import TaughtView, taught_view


class PlacedObjectBehaviour:
    """Reports taught objects, other motion, and the objects at given positions of the first valid frame.

    Nothing is taught at a position where no outline is found; an object that moves away from there can
    still be matched to the position by where it was first seen (`tasks/casting/fitness.py`).

    Args:
        places: Name -> (x, y), frame pixels.
        taught: Views of other objects.
    """

    contract = Contract(
        "appearance", gives=("region", "hypothesis", "camera"), hang_s=COMPILING_HANG_S
    )

    def __init__(
        self, places: Mapping[str, tuple[float, float]], taught: Sequence[TaughtView] = ()
    ) -> None:
        self._places = dict(places)
        self._given = tuple(taught)
        self._views: tuple[TaughtView, ...] | None = None
        self._inner = AppearanceBehaviour(self._given)

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far; see `visup.agent.storage.checkpoint`."""
        return {"views": self._views, "inner": self._inner.save()}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same settings."""
        self._views = state["views"]
        self._inner = AppearanceBehaviour((*self._given, *(self._views or ())))
        self._inner.load(state["inner"])

    def missed(self, observation: Observation) -> None:
        """Reserve the ids of regions reported since the restored state."""
        self._inner.missed(observation)

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Report the objects and the other moving regions of one frame; see `AppearanceBehaviour`."""
        if self._views is None and image_is_sound(observation):
            self._views = tuple(self._views_at_places(frame))
            self._inner = AppearanceBehaviour((*self._given, *self._views))
        return self._inner.perceive(frame, observation, directives)

    def _views_at_places(self, frame: Frame) -> Iterable[TaughtView]:
        for name, at in sorted(self._places.items()):
            outline = outline_at_point(frame.image, at)
            try:
                if outline is not None:
                    yield taught_view(name, frame.image, outline)
            except SettingsError:
                continue  # too small to be recognised
