"""Hints that add missing definitions to a file."""

from __future__ import annotations

import re
from collections.abc import Iterator

from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.synonyms import synonym
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.diagnostics.recovery import KEYWORDS
from visup.tasks.grammar.statement import NAME

_CALL = re.compile(rf"{NAME}\s*\(\s*({NAME})\s*,\s*({NAME})\s*\)")
AMOUNTS = ("90 s", "20 px", "20 px/s", "20 deg/s", "20 %", "2 m")
"""Example values of a parameter."""
ZONE = "(100, 50) (300, 50) (300, 200)"


def added(text: str, fault: Diagnostic) -> Iterator[str]:
    """Hints that add the definition of an undefined name.

    Args:
        text: The file.
        fault: One of its faults.
    """
    begin = fault.place.column - 1
    said = re.search(NAME, fault.place.text[begin : begin + fault.place.length])
    name = said[0] if said else ""
    if fault.code == "E202" and name:
        yield f"add the line `<{name}> ::= {_action(text, name)}`"
    elif fault.code == "E223":
        yield from (f"add the line `parameter {name} is {amount}`" for amount in AMOUNTS)
    elif fault.code == "E229":
        yield f"add the line `zone {name} is {ZONE}`"
    elif fault.code == "E129":
        yield f"add the line `<dock> ::= {_action(text, 'dock')}`"


def _action(text: str, name: str) -> str:
    """The action suggested by the name of a stage, between actors of the file."""
    meant = synonym(name, ACTIONS)
    if meant is None or ACTIONS[meant].kinds != ("object", "object"):
        meant = "touching"
    calls = (m.groups() for m in _CALL.finditer(text))
    named = (pair for pair in calls if not set(pair) & set(KEYWORDS) and pair[0] != pair[1])
    return f"{meant}({', '.join(next(named, ('arm', 'part')))})"
