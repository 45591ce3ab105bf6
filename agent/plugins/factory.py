"""Creates user behaviours with their settings, from a file or a module path."""

from __future__ import annotations

import hashlib
import importlib
import importlib.util
import inspect
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.model.errors import BehaviourError
from visup.agent.plugins.settings import validate_settings

Constructor = Callable[..., object]
"""A behaviour class, or a factory function."""

MODULE_PATH = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")


@dataclass(frozen=True, slots=True)
class BehaviourFactory:
    """A factory of a behaviour.

    Attributes:
        kind: The class or function.
        where: Its location, for messages.
    """

    kind: Constructor
    where: str

    @property
    def contract(self) -> Contract | None:
        """The contract, if it is known before the behaviour is created."""
        found = getattr(self.kind, "contract", None)
        return found if isinstance(found, Contract) else None

    @property
    def settings(self) -> type | None:
        """The model of its settings, or None."""
        found = getattr(self.kind, "Settings", None)
        return found if isinstance(found, type) else None

    def make(self, settings: Mapping[str, Any] | None = None) -> Behaviour:
        """Create a behaviour.

        Args:
            settings: Values of its settings; omitted ones have their defaults.

        Raises:
            BehaviourError: It cannot be created, or is no behaviour.
            SettingsError: A setting is not valid.
        """
        name = self.contract.name if self.contract else getattr(self.kind, "__name__", "behaviour")
        given = validate_settings(self.settings, settings or {}, name)
        try:
            behaviour = self.kind() if given is None else self.kind(given)
        except BehaviourError:
            raise
        except Exception as fault:
            takes = "its settings alone" if self.settings else "no arguments"
            raise BehaviourError(
                f"{getattr(self.kind, '__name__', name)} cannot be made: "
                f"{type(fault).__name__}: {fault}",
                where=self.where,
                expected=f"a class that is made with {takes}",
            ) from fault
        return as_behaviour(behaviour, self.where)


def load_behaviours(
    where: str, settings: Mapping[str, Mapping[str, Any]] | None = None
) -> list[Behaviour]:
    """Load the behaviours of a file or a module.

    Args:
        where: `FILE.py`, for every class defined in it that has a contract; or `package.module:Class`.
        settings: Name of a behaviour -> values of its settings.

    Raises:
        BehaviourError: It is missing, does not run, or has no behaviour.
        SettingsError: A setting is not valid.
    """
    values = settings or {}
    return [
        o.make(values.get(o.contract.name) if o.contract else None) for o in find_factories(where)
    ]


def find_factories(where: str) -> list[BehaviourFactory]:
    """The behaviour factories of a file or a module.

    Raises:
        BehaviourError: It is missing, does not run, or has no behaviour.
    """
    if not MODULE_PATH.fullmatch(where):
        return _factories_of_file(Path(where))
    module_path, _, name = where.partition(":")
    module = _imported(lambda: importlib.import_module(module_path), where)
    if not hasattr(module, name):
        known = sorted(k.__name__ for k in _own_classes(module) if hasattr(k, "contract"))
        raise BehaviourError(
            f"the module '{module_path}' has no '{name}'",
            where=where,
            expected=f"one of: {', '.join(known)}" if known else "a class with a contract",
        )
    return [BehaviourFactory(getattr(module, name), where)]


def as_behaviour(behaviour: object, where: str) -> Behaviour:
    """The same object, checked to be a behaviour.

    Raises:
        BehaviourError: It has no contract, or no `perceive` with the required signature.
    """
    if not isinstance(getattr(behaviour, "contract", None), Contract):
        raise BehaviourError(
            f"{type(behaviour).__name__} has no contract",
            where=where,
            expected="an attribute `contract = Contract(name, gives=(...))`",
        )
    perceive = getattr(behaviour, "perceive", None)
    expected = "perceive(self, frame, observation, directives) -> percepts"
    if not callable(perceive):
        raise BehaviourError(
            f"{type(behaviour).__name__} has no method `perceive`", where=where, expected=expected
        )
    if inspect.iscoroutinefunction(perceive) or inspect.isasyncgenfunction(perceive):
        raise BehaviourError(
            f"{type(behaviour).__name__}.perceive is asynchronous", where=where, expected=expected
        )
    try:
        inspect.signature(perceive).bind(None, None, None)
    except TypeError as fault:
        raise BehaviourError(
            f"{type(behaviour).__name__}.perceive cannot be called: {fault}",
            where=where,
            expected=expected,
        ) from fault
    return behaviour  # type: ignore[return-value]  # checked above, member by member


def module_name(path: Path) -> str:
    """The module name of a file of behaviours; unique even for files of the same name."""
    folder_hash = hashlib.sha256(str(path.resolve().parent).encode()).hexdigest()[:8]
    return f"visup_plugin_{path.stem}_{folder_hash}"


def import_file(path: Path) -> ModuleType:
    """Import a file of behaviours afresh.

    Raises:
        BehaviourError: It is not Python.
    """
    spec = importlib.util.spec_from_file_location(module_name(path), path.resolve())
    if spec is None or spec.loader is None:
        raise BehaviourError("the file is not Python", where=str(path), expected="a .py file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses of the plug-in look up their module here
    spec.loader.exec_module(module)
    return module


def _factories_of_file(path: Path) -> list[BehaviourFactory]:
    if not path.is_file():
        raise BehaviourError(
            "there is no such file",
            where=str(path),
            expected="a Python file, or package.module:Class",
        )
    module = _imported(lambda: import_file(path), str(path))
    classes = [c for c in _own_classes(module) if hasattr(c, "contract")]
    if not classes:
        raise BehaviourError(
            "the file holds no behaviour",
            where=str(path),
            expected="a class with `contract = Contract(name, gives=(...))` and `perceive`",
            hint="visup behaviours new NAME writes a complete one",
        )
    return [BehaviourFactory(kind, str(path)) for kind in classes]


def _imported(load: Callable[[], ModuleType], where: str) -> ModuleType:
    try:
        return load()
    except BehaviourError as fault:
        folder_hash = ", ".join(str(w) for w in (_place(fault, where), fault.where) if w)
        raise BehaviourError(
            fault.what, where=folder_hash, expected=fault.expected, hint=fault.hint
        ) from fault
    except (Exception, SystemExit) as fault:
        error_text = f"{type(fault).__name__}: {fault}"
        raise BehaviourError(
            f"it does not run: {error_text}", where=_place(fault, where)
        ) from fault


def _place(fault: BaseException, where: str) -> str:
    """The line of the plug-in at which it failed, if known."""
    if isinstance(fault, SyntaxError) and fault.lineno:
        return f"{where}:{fault.lineno}"
    trace, line = fault.__traceback__, None
    while trace is not None:
        if Path(trace.tb_frame.f_code.co_filename).name == Path(where).name:
            line = trace.tb_lineno
        trace = trace.tb_next
    return f"{where}:{line}" if line else where


def _own_classes(module: ModuleType) -> Iterator[type]:
    for value in vars(module).values():
        if isinstance(value, type) and value.__module__ == module.__name__:
            yield value
