"""What a behaviour offers so that its state can be saved in a checkpoint and restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class Saveable(Protocol):
    """A behaviour whose state can be saved, so that a run that was killed can be resumed from it."""

    def save(self) -> Mapping[str, Any]:
        """All that it holds from frame to frame, by name; what its settings determine is left out."""
        ...

    def load(self, state: Mapping[str, Any]) -> None:
        """Take on a state that an object of the same settings gave."""
        ...


class Stateless:
    """A behaviour that holds nothing from frame to frame: saved, it is as it was made."""

    def save(self) -> Mapping[str, Any]:
        """No state: each frame is processed on its own."""
        return {}

    def load(self, state: Mapping[str, Any]) -> None:
        """Nothing is remembered."""


def saved_attributes(it: object, *left_out: str) -> dict[str, Any]:
    """The attributes of an object besides those left out: what most `save` methods give."""
    return {name: value for name, value in vars(it).items() if name not in left_out}
