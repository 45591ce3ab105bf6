"""The interface of behaviours whose state can be saved in a checkpoint and restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class Saveable(Protocol):
    """A behaviour whose state can be saved, so that a killed run can be resumed."""

    def save(self) -> Mapping[str, Any]:
        """Its state between frames by name, without what its settings determine."""
        ...

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore a state saved by an object with the same settings."""
        ...


class Stateless:
    """A behaviour without state between frames."""

    def save(self) -> Mapping[str, Any]:
        """An empty state: each frame is processed on its own."""
        return {}

    def load(self, state: Mapping[str, Any]) -> None:
        """Nothing to restore."""


def saved_attributes(behaviour: object, *left_out: str) -> dict[str, Any]:
    """The attributes of an object except those left out: the result of most `save` methods."""
    return {name: value for name, value in vars(behaviour).items() if name not in left_out}
