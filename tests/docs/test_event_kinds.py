"""Kinds of events: those that the code tells are those that are listed, completed and documented."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tests.paths import ROOT
from visup.tasks.supervision.events import KINDS
from visup.wording import EVENT_KINDS

TELLING = {"Event", "_event", "_stage_event", "report"}
ROOMS = ("agent/cycle", "rules", "tasks/supervision")


def constants(node: ast.AST) -> Iterator[str]:
    """The texts that an argument can be."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield part.value


def kinds_in_code() -> set[str]:
    """First arguments of all calls that make an event; those by a variable are found where it is set."""
    found = set(KINDS.values())
    for path in (p for room in ROOMS for p in sorted((ROOT / room).rglob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and node.args:
                name = getattr(node.func, "id", getattr(node.func, "attr", ""))
                found |= set(constants(node.args[0])) if name in TELLING else set()
            if isinstance(node, ast.Return) and isinstance(node.value, ast.Tuple):
                # A kind and its sentence, for a call elsewhere.
                found |= set(constants(next(iter(node.value.elts), node.value))) & set(EVENT_KINDS)
            if isinstance(node, ast.Yield) and node.value is not None:
                found |= set(constants(node.value)) & set(EVENT_KINDS)
            if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "kind":
                found |= set(constants(node.value)) & set(EVENT_KINDS)
    return found


def test_every_kind_that_is_told_is_listed_and_the_other_way_round() -> None:
    assert kinds_in_code() == set(EVENT_KINDS)


def test_every_kind_is_documented_with_its_meaning() -> None:
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    assert [k for k, v in EVENT_KINDS.items() if f"| `{k}` | {v} |\n" not in page] == []
