"""Lazy public names of a package.

A package that re-exports names of all its modules would load all of them for a single name; the command's
`--help` needs only the errors.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    package: str,
    names_of_module: Mapping[str, tuple[str, ...]],
    before: Callable[[str], object] | None = None,
) -> Callable[[str], Any]:
    """A package's `__getattr__` (PEP 562).

    Args:
        package: Name of the package.
        names_of_module: Module -> the names it provides; `Name as Other` renames one.
        before: Called with the name of a module before it is imported.

    Returns:
        A function that loads a name and caches it in the package; raises AttributeError for unknown names.
    """
    location_of = {
        name.rpartition(" as ")[2]: (module, name.partition(" as ")[0])
        for module, names in names_of_module.items()
        for name in names
    }

    def find(name: str) -> Any:
        if name not in location_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, attribute = location_of[name]
        if before is not None:
            before(module)
        found = getattr(import_module(module), attribute)
        setattr(sys.modules[package], name, found)
        return found

    return find
