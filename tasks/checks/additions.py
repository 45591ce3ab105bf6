"""Hints that the rest of a file suggests: missing definitions, and names that other lines use."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.synonyms import synonym
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.diagnostics.recovery import NEVER_NAMES
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
    elif fault.code in ("E205", "E211"):
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
    given = list(dict.fromkeys(re.findall(NAME, call[2])))
    calls = [re.findall(NAME, m[2]) for m in _ANY_CALL.finditer(text)]
    named = Counter(a for actors in calls for a in actors)
    met = Counter(a for actors in calls if set(given) & set(actors) for a in actors)
    others = sorted({*named} - {*given, *NEVER_NAMES}, key=lambda a: (-met[a], -named[a], a))
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
    named = (pair for pair in calls if not set(pair) & set(NEVER_NAMES) and pair[0] != pair[1])
    return f"{meant}({', '.join(next(named, ('arm', 'part')))})"


_DECLARED_IN_PARTS = re.compile(
    r"^\s*(?:optional\s+)?(?:actor|bystander|zone|parameter)\s+"
    rf"({NAME}(?:[ -]+{NAME})+)(?=\s+(?:is|at)\b|\s*=)",
    re.MULTILINE,
)
_ZONE = re.compile(rf"^\s*zone\s+({NAME})", re.MULTILINE)


def by_names(text: str, fault: Diagnostic) -> Iterator[str]:
    """Hints that the names of other lines suggest, likeliest first.

    Args:
        text: The file.
        fault: One of its faults.
    """
    line = fault.place.text
    code = line.split("#")[0].strip()
    for new in (
        *_joined(text, code),
        *_of_stages(text, fault, code),
        *_of_zones(text, fault, code),
    ):
        if new != code:
            yield f"write `{new}` in place of `{code}`"
    if fault.code == "E203":
        yield from _renamed(text, fault)
    if fault.code == "E204":
        yield from _referred(text, fault)


def _joined(text: str, code: str) -> Iterator[str]:
    """The line with names joined that are written in several words wherever they stand."""
    declared = {m[1] for m in _DECLARED_IN_PARTS.finditer(text)}
    called = re.findall(rf"[(,]\s*({NAME}(?:[ ]+{NAME})+)\s*(?=[,)])", code)
    again = {n for n in called if len(re.findall(rf"\b(?:{_either_way(n)})\b", text)) > 1}
    for names in (declared, declared | again):
        new = code
        for name in sorted(names, key=len, reverse=True):
            if " of " not in name:
                new = re.sub(rf"\b{re.escape(name)}\b", re.sub(r"[ -]+", "_", name), new)
        yield new


def _either_way(name: str) -> str:
    """A pattern of a name in several words, or joined."""
    return f"{re.escape(name)}|{re.sub(r'[ -]+', '_', name)}"


def _of_stages(text: str, fault: Diagnostic, code: str) -> Iterator[str]:
    """The line with stages of any actor in angle brackets, where they are called like actions."""
    given = dict(re.findall(rf"<\s*({NAME})\s*(\([^()]*\))\s*>\s*::=", text))
    plain = set(re.findall(rf"<\s*({NAME})\s*>\s*::=", text))
    yield re.sub(
        rf"<\s*({NAME})\s*>(?!\s*::=)",
        lambda m: f"<{m[1]}{given[m[1]]}>" if m[1] in given and m[1] not in plain else m[0],
        code,
    )
    if fault.code in ("E101", "E103", "E201"):
        general = set(given)
        yield re.sub(
            rf"(?<![<\w])({NAME})(\s*\([^()<>]*\))(?!\s*>)",
            lambda m: f"<{m[1]}{m[2]}>" if m[1] in general else m[0],
            code,
        )


def _of_zones(text: str, fault: Diagnostic, code: str) -> Iterator[str]:
    """The line with a zone of the file that nothing else uses, in place of what is none."""
    if fault.code == "E229":
        spare = [z for z in _ZONE.findall(text) if len(re.findall(rf"\b{z}\b", text)) == 1]
        begin = fault.place.column - 1
        said = line_part(fault.place.text, begin, fault.place.length)
        yield from (re.sub(rf"\b{re.escape(said)}\b", zone, code) for zone in spare if said)


def line_part(line: str, begin: int, length: int) -> str:
    """The name at a place of a line."""
    found = re.match(NAME, line[begin : begin + length])
    return found[0] if found else ""


def _renamed(text: str, fault: Diagnostic) -> Iterator[str]:
    """A second stage of a name is renamed if it is asked for a second time, else left out."""
    head = re.match(rf"\s*<\s*({NAME})\s*>", fault.place.text)
    if head is not None:
        stages = re.findall(rf"<\s*({NAME})\s*>(?!\s*::=)", text)
        known = re.findall(rf"<\s*({NAME})\s*>\s*::=", text)
        missing = [s for s in dict.fromkeys(stages) if s not in known]
        yield from (f"write `<{s}>` in place of `<{head[1]}>`" for s in missing)
    if head is not None and len(_references(text, head[1])) > 1:
        yield f"write `<{head[1]}_2>` in place of `<{head[1]}>`"
    elif head is not None:
        yield f"leave `{fault.place.text.split('#')[0].strip()}` out"


def _referred(text: str, fault: Diagnostic) -> Iterator[str]:
    """The second of two references to `<a>`, where `<a_2>` is defined and never asked for."""
    head = re.match(rf"\s*<\s*(({NAME})_2)\s*>", fault.place.text)
    if head is not None and len(found := _references(text, head[2])) > 1:
        before = re.search(r"\S+\s*$", text[: found[1].start()])
        said = before[0] if before and "\n" not in before[0] else ""
        yield f"write `{said}<{head[1]}>` in place of `{said}{found[1][0]}`"


def _references(text: str, stage: str) -> list[re.Match[str]]:
    """Where a stage is asked for."""
    return list(re.finditer(rf"<\s*{stage}\s*>(?!\s*::=)", text))
