"""Examples in docstrings are true, in every module that has one."""

from __future__ import annotations

import doctest
import importlib

import pytest

from tests.paths import ROOT

PARTS = ("agent", "percepts", "rules", "tasks", "visup")


def modules_with_examples() -> list[str]:
    """Dotted names, `visup.` in front; what lies behind the links of `visup/` is found once."""
    found = []
    for path in (p for part in PARTS for p in (ROOT / part).rglob("*.py")):
        parts = path.relative_to(ROOT).with_suffix("").parts
        behind_link = parts[0] == "visup" and len(parts) > 1 and parts[1] in PARTS
        if not behind_link and ">>> " in path.read_text(encoding="utf-8"):
            found.append(".".join(parts if parts[0] == "visup" else ("visup", *parts)))
    return sorted(found)


@pytest.mark.parametrize("module", modules_with_examples())
def test_examples_in_docstrings_are_true(module: str) -> None:
    result = doctest.testmod(importlib.import_module(module))
    assert result.attempted > 0
    assert result.failed == 0
