"""Public names of a package that are loaded when they are first used.

A package that gathers names from all its modules would load them all for whoever needs one; the command's
`--help` needs only the errors.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    package: str,
    homes: Mapping[str, tuple[str, ...]],
    before: Callable[[str], object] | None = None,
) -> Callable[[str], Any]:
    """A package's `__getattr__` (PEP 562).

    Args:
        package: Name of the package.
        homes: For each module the names that are found there; `Name as Other` gives one another name.
        before: Called with the name of a module before that is imported.

    Returns:
        What gives a name's object and keeps it in the package; a name without a home is an AttributeError.
    """
    home_of = {
        name.rpartition(" as ")[2]: (module, name.partition(" as ")[0])
        for module, names in homes.items()
        for name in names
    }

    def find(name: str) -> Any:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, there = home_of[name]
        if before is not None:
            before(module)
        found = getattr(import_module(module), there)
        setattr(sys.modules[package], name, found)
        return found

    return find
