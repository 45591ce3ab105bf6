"""Loads oracles and comparisons with them from a source checkout.

They are in `tests/oracles/`, so that the installed package has no code for comparisons only. The commands of
`visup eval` load them by name.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import visup
from visup.agent.model.errors import SettingsError

CHECKOUT = Path(visup.__file__).resolve().parents[1]
PACKAGE = "tests.oracles"


def oracle(name: str) -> ModuleType:
    """A module of `tests/oracles/`.

    Args:
        name: Name of the module below it, such as `reasoning.rules`.

    Raises:
        SettingsError: visup does not run from a source checkout.
    """
    if not (CHECKOUT / "tests" / "oracles").is_dir():
        raise SettingsError(
            "this evaluation compares visup with oracles that do not ship in the package",
            expected="a source checkout of visup, installed by `make setup`",
            hint="clone the repository and run the same command there",
        )
    if str(CHECKOUT) not in sys.path:
        sys.path.append(str(CHECKOUT))
    return importlib.import_module(f"{PACKAGE}.{name}")


def evaluation_module(name: str) -> ModuleType:
    """The module of an evaluation by its full name.

    Raises:
        SettingsError: It compares with oracles, and visup does not run from a source checkout.
    """
    if name.startswith(f"{PACKAGE}."):
        return oracle(name.removeprefix(f"{PACKAGE}."))
    return importlib.import_module(name)
