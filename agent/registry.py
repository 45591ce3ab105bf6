"""Where behaviours are found: entry points of installed packages, and files of the user's own."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable, Iterator
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType

from visup.agent.behaviour import Behaviour, Contract
from visup.agent.errors import BehaviourError

GROUP = "visup.behaviours"
Factory = Callable[[], Behaviour]


class Registry:
    """Behaviours that can be made, by name. Made by whoever wires an agent; never global."""

    def __init__(self) -> None:
        self._factories: dict[str, Factory] = {}

    def add(self, name: str, factory: Factory) -> None:
        """Add what makes a behaviour.

        Raises:
            BehaviourError: The name is taken.
        """
        if name in self._factories:
            raise BehaviourError(f"a behaviour called '{name}' is registered already")
        self._factories[name] = factory

    def names(self) -> list[str]:
        """Names in alphabetical order."""
        return sorted(self._factories)

    def make(self, name: str) -> Behaviour:
        """A new behaviour.

        Raises:
            BehaviourError: No such name, or its maker failed.
        """
        if name not in self._factories:
            raise BehaviourError(
                f"there is no behaviour called '{name}'",
                expected=f"one of: {', '.join(self.names())}",
            )
        try:
            made = self._factories[name]()
        except BehaviourError:
            raise
        except Exception as fault:
            said = f"{type(fault).__name__}: {fault}"
            raise BehaviourError(f"behaviour '{name}' cannot be made: {said}") from fault
        return checked(made, name)


def checked(made: object, where: str) -> Behaviour:
    """The same object, once it is known to be a behaviour.

    Raises:
        BehaviourError: It has no contract or no `perceive`.
    """
    if not isinstance(getattr(made, "contract", None), Contract):
        raise BehaviourError(
            f"{type(made).__name__} has no contract",
            where=where,
            expected="an attribute `contract = Contract(name, gives=(...))`",
        )
    if not callable(getattr(made, "perceive", None)):
        raise BehaviourError(
            f"{type(made).__name__} has no method `perceive`",
            where=where,
            expected="perceive(self, frame, seen, directives) -> percepts",
        )
    return made  # type: ignore[return-value]  # just checked, member by member


def discover() -> Registry:
    """A registry of all behaviours that installed packages offer under `visup.behaviours`."""
    registry = Registry()
    for point in sorted(entry_points(group=GROUP), key=lambda p: (p.name, p.value)):
        if point.name not in registry.names():
            registry.add(point.name, _loader(point))
    return registry


def _loader(point: EntryPoint) -> Factory:
    def load() -> Behaviour:
        made: Behaviour = point.load()()
        return made

    return load


def from_file(path: Path) -> list[Behaviour]:
    """Behaviours of a Python file: every class of its own that has a contract, one of each.

    Args:
        path: The file.

    Raises:
        BehaviourError: It is missing, does not run, or holds no behaviour.
    """
    if not path.is_file():
        raise BehaviourError("there is no such file", where=str(path), expected="a Python file")
    module = _module(path)
    offered = [c for c in _own_classes(module) if hasattr(c, "contract")]
    if not offered:
        raise BehaviourError(
            "the file holds no behaviour",
            where=str(path),
            expected="a class with `contract = Contract(name, gives=(...))` and `perceive`",
            hint="docs/plugins.md has a complete example",
        )
    return [_made(c, path) for c in offered]


def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"visup_plugin_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise BehaviourError("the file is not Python", where=str(path), expected="a .py file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses of the plug-in look their module up here
    try:
        spec.loader.exec_module(module)
    except Exception as fault:
        raise BehaviourError(
            f"the file does not run: {type(fault).__name__}: {fault}", where=str(path)
        ) from fault
    return module


def _own_classes(module: ModuleType) -> Iterator[type]:
    for value in vars(module).values():
        if isinstance(value, type) and value.__module__ == module.__name__:
            yield value


def _made(kind: type, path: Path) -> Behaviour:
    try:
        made = kind()
    except Exception as fault:
        raise BehaviourError(
            f"{kind.__name__}() failed: {type(fault).__name__}: {fault}",
            where=str(path),
            expected="a class that is made without arguments",
        ) from fault
    return checked(made, str(path))
