"""The registry of installed behaviours, found through the entry points of packages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from visup.agent.contract.behaviour import Behaviour
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import BehaviourError
from visup.agent.plugins.factory import BehaviourFactory, Constructor

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "visup.behaviours"


class Registry:
    """Factories of behaviours by name. Created where an agent is wired; never global."""

    def __init__(self) -> None:
        self._factories: dict[str, BehaviourFactory | EntryPoint] = {}

    def add(self, name: str, kind: Constructor) -> None:
        """Add a behaviour class or factory function.

        Raises:
            BehaviourError: The name is taken.
        """
        self._add(name, BehaviourFactory(kind, name))

    def add_entry_point(self, point: EntryPoint) -> None:
        """Add an entry point of a package, which is imported when first used.

        Raises:
            BehaviourError: The name is taken.
        """
        # Entry points are not recognised by type: once some package imports the backport
        # `importlib_metadata`, entry points are of that one's class.
        self._add(point.name, point)

    def _add(self, name: str, factory: BehaviourFactory | EntryPoint) -> None:
        if name in self._factories:
            raise BehaviourError(f"a behaviour called '{name}' is already registered")
        self._factories[name] = factory

    def names(self) -> list[str]:
        """Names in alphabetical order."""
        return sorted(self._factories)

    def where(self, name: str) -> str:
        """Location of the behaviour of that name, `package.module:Class`; nothing is imported.

        Raises:
            BehaviourError: No such name.
        """
        if name not in self._factories:
            raise self._unknown(name)
        found = self._factories[name]
        return found.where if isinstance(found, BehaviourFactory) else found.value

    def _unknown(self, name: str) -> BehaviourError:
        return BehaviourError(
            f"there is no behaviour called '{name}'",
            expected=f"one of: {', '.join(self.names())}",
            hint=did_you_mean(name, self.names()),
        )

    def factory(self, name: str) -> BehaviourFactory:
        """The factory of the behaviour of that name; imports its entry point.

        Raises:
            BehaviourError: No such name, or it cannot be imported.
        """
        if name not in self._factories:
            raise self._unknown(name)
        found = self._factories[name]
        if isinstance(found, BehaviourFactory):
            return found
        try:
            factory = BehaviourFactory(found.load(), found.value)
        except Exception as fault:
            error_text = f"{type(fault).__name__}: {fault}"
            raise BehaviourError(
                f"behaviour '{name}' cannot be imported: {error_text}", where=found.value
            ) from fault
        self._factories[name] = factory
        return factory

    def make(self, name: str, settings: Mapping[str, Any] | None = None) -> Behaviour:
        """Create a behaviour.

        Args:
            name: Its name.
            settings: Its settings.

        Raises:
            BehaviourError: No such name, or it cannot be created.
            SettingsError: A setting is not valid.
        """
        return self.factory(name).make(settings)


def discover_behaviours() -> Registry:
    """A registry of all behaviours that installed packages offer under `visup.behaviours`."""
    from importlib.metadata import entry_points

    registry = Registry()
    for point in sorted(entry_points(group=GROUP), key=lambda p: (p.name, p.value)):
        if point.name not in registry.names():
            registry.add_entry_point(point)
    return registry
