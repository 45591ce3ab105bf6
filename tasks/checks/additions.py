"""Hints that add missing definitions to a file."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.synonyms import synonym
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.diagnostics.recovery import KEYWORDS
from visup.tasks.grammar.statement import NAME

_CALL = re.compile(rf"{NAME}\s*\(\s*({NAME})\s*,\s*({NAME})\s*\)")
_ANY_CALL = re.compile(rf"({NAME})\s*\(([^()<>]*)\)")
_RECOVERY = re.compile(r"\s*on\s+failure\s+of\b")
MOST_ACTORS = 4
"""Most actors of the file that are tried in the place of a missing one."""
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
    if fault.code == "E202" and _RECOVERY.match(fault.place.text):
        yield from (f"write `<{s}>` in place of `<{name}>`" for s in _retried(text, fault, name))
    if fault.code == "E202" and name:
        yield f"add the line `<{name}> ::= {_action(text, name)}`"
    elif fault.code == "E223":
        yield from (f"add the line `parameter {name} is {amount}`" for amount in AMOUNTS)
    elif fault.code == "E229":
        yield f"add the line `zone {name} is {ZONE}`"
    elif fault.code == "E205":
        yield from _with_actor(text, fault)
    elif fault.code == "E219" and re.search(rf"<\s*{name}\s*>\s*::=", text):
        yield f"write `<{name}>` in place of `{name}`"
    elif fault.code == "E226":
        yield from _of_parameter(fault)
    elif fault.code == "E129":
        yield f"add the line `<dock> ::= {_action(text, 'dock')}`"


def _retried(text: str, fault: Diagnostic, name: str) -> list[str]:
    """Stages that may have failed where a recovery names an unknown one: first those that it tries again."""
    known = re.findall(rf"<\s*({NAME})\s*>\s*::=", text)
    again = re.findall(rf"<\s*({NAME})\s*>", fault.place.text.partition(":")[2])
    return [s for s in dict.fromkeys((*reversed(again), *known[1:])) if s in known and s != name]


def _with_actor(text: str, fault: Diagnostic) -> Iterator[str]:
    """Calls with one more actor: one that the file names, most often first, else another."""
    begin = fault.place.column - 1
    call = _ANY_CALL.match(fault.place.text, begin)
    if call is None:
        return
    given = re.findall(NAME, call[2])
    calls = [re.findall(NAME, m[2]) for m in _ANY_CALL.finditer(text)]
    named = Counter(a for actors in calls for a in actors)
    met = Counter(a for actors in calls if set(given) & set(actors) for a in actors)
    others = sorted({*named} - {*given, *KEYWORDS}, key=lambda a: (-met[a], -named[a], a))
    for actor in (*others[:MOST_ACTORS], "other"):
        for actors in ((*given, actor), (actor, *given)):
            yield f"write `{call[1]}({', '.join(actors)})` in place of `{call[0]}`"


def _of_parameter(fault: Diagnostic) -> Iterator[str]:
    """Another unit in the declaration of a parameter."""
    said = re.match(rf"parameter `({NAME})` is `(-?[\d.]+) ?([^`]*)`", fault.message)
    if said is not None:
        declared = f"parameter {said[1]} is {said[2]}"
        for unit in dict.fromkeys(amount.split()[1] for amount in AMOUNTS):
            yield f"write `{declared} {unit}` in place of `{declared} {said[3]}`"


def _action(text: str, name: str) -> str:
    """The action suggested by the name of a stage, between actors of the file."""
    meant = synonym(name, ACTIONS)
    if meant is None or ACTIONS[meant].kinds != ("object", "object"):
        meant = "touching"
    calls = (m.groups() for m in _CALL.finditer(text))
    named = (pair for pair in calls if not set(pair) & set(KEYWORDS) and pair[0] != pair[1])
    return f"{meant}({', '.join(next(named, ('arm', 'part')))})"
