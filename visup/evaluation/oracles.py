"""Oracles and peers: slow twins to compare with, kept with the tests and found in a source checkout.

They stand in `tests/oracles/`, so that the installed package holds nothing that only a comparison
runs. Evaluations ask for them by name.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType

import visup.version
from visup.agent.model.errors import SettingsError

CHECKOUT = Path(visup.version.__file__).resolve().parents[1]


def oracle(name: str) -> ModuleType:
    """A module of `tests/oracles/`.

    Args:
        name: Of the module, such as `rule_oracle`.

    Raises:
        SettingsError: visup does not run from a source checkout.
    """
    if not (CHECKOUT / "tests" / "oracles" / f"{name}.py").exists():
        raise SettingsError(
            "this evaluation compares visup with oracles that do not ship in the package",
            expected="a source checkout of visup, installed by `make setup`",
            hint="clone the repository and run the same command there",
        )
    if str(CHECKOUT) not in sys.path:
        sys.path.append(str(CHECKOUT))
    return importlib.import_module(f"tests.oracles.{name}")
