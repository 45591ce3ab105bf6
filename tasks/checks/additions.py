"""Hints derived from the rest of a file: missing definitions, and names that other lines use."""

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
MAX_ACTORS = 4
"""Most actors of the file that are tried in the place of a missing one."""
EXAMPLE_AMOUNTS = ("90 s", "20 px", "20 px/s", "20 deg/s", "20 %", "2 m")
"""Example values of a parameter."""
EXAMPLE_ZONE = "(100, 50) (300, 50) (300, 200)"


def definition_hints(text: str, fault: Diagnostic) -> Iterator[str]:
    """Hints that add the definition of an undefined name.

    Args:
        text: The file.
        fault: One of its faults.
    """
    begin = fault.place.column - 1
    match = re.search(NAME, fault.place.text[begin : begin + fault.place.length])
    name = match[0] if match else ""
    if fault.code == "E202" and _RECOVERY.match(fault.place.text):
        yield from (
            f"write `<{s}>` in place of `<{name}>`" for s in _stages_tried_again(text, fault, name)
        )
    if fault.code == "E202" and name:
        yield f"add the line `<{name}> ::= {_suggested_action(text, name)}`"
    elif fault.code == "E223":
        yield from (f"add the line `parameter {name} is {amount}`" for amount in EXAMPLE_AMOUNTS)
    elif fault.code == "E229":
        yield f"add the line `zone {name} is {EXAMPLE_ZONE}`"
    elif fault.code in ("E205", "E211"):
        yield from _calls_with_more_actors(text, fault)
    elif fault.code == "E219" and re.search(rf"<\s*{name}\s*>\s*::=", text):
        yield f"write `<{name}>` in place of `{name}`"
    elif fault.code == "E226":
        yield from _parameter_with_unit(fault)
    elif fault.code == "E129":
        yield f"add the line `<dock> ::= {_suggested_action(text, 'dock')}`"


def _stages_tried_again(text: str, fault: Diagnostic, name: str) -> list[str]:
    """Candidates for the unknown stage of a recovery (`on failure of`): first those that it repeats."""
    defined = re.findall(rf"<\s*({NAME})\s*>\s*::=", text)
    retried = re.findall(rf"<\s*({NAME})\s*>", fault.place.text.partition(":")[2])
    return [
        s for s in dict.fromkeys((*reversed(retried), *defined[1:])) if s in defined and s != name
    ]


def _calls_with_more_actors(text: str, fault: Diagnostic) -> Iterator[str]:
    """Calls with one more actor: one of the file, the most frequent first, or `other`."""
    begin = fault.place.column - 1
    call = _ANY_CALL.match(fault.place.text, begin)
    if call is None:
        return
    given = list(dict.fromkeys(re.findall(NAME, call[2])))
    calls = [re.findall(NAME, m[2]) for m in _ANY_CALL.finditer(text)]
    uses = Counter(a for actors in calls for a in actors)
    shared_uses = Counter(a for actors in calls if set(given) & set(actors) for a in actors)
    others = sorted({*uses} - {*given, *NEVER_NAMES}, key=lambda a: (-shared_uses[a], -uses[a], a))
    for actor in (*others[:MAX_ACTORS], "other"):
        for actors in ((*given, actor), (actor, *given)):
            yield f"write `{call[1]}({', '.join(actors)})` in place of `{call[0]}`"


def _parameter_with_unit(fault: Diagnostic) -> Iterator[str]:
    """The declaration of a parameter with another unit."""
    match = re.match(rf"parameter `({NAME})` is `(-?[\d.]+) ?([^`]*)`", fault.message)
    if match is not None:
        declared = f"parameter {match[1]} is {match[2]}"
        for unit in dict.fromkeys(amount.split()[1] for amount in EXAMPLE_AMOUNTS):
            yield f"write `{declared} {unit}` in place of `{declared} {match[3]}`"


def _suggested_action(text: str, name: str) -> str:
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


def name_hints(text: str, fault: Diagnostic) -> Iterator[str]:
    """Hints derived from the names in other lines, likeliest first.

    Args:
        text: The file.
        fault: One of its faults.
    """
    line = fault.place.text
    code = line.split("#")[0].strip()
    for new in (
        *_with_joined_names(text, code),
        *_with_stage_brackets(text, fault, code),
        *_with_unused_zone(text, fault, code),
    ):
        if new != code:
            yield f"write `{new}` in place of `{code}`"
    if fault.code == "E203":
        yield from _duplicate_renamed(text, fault)
    if fault.code == "E204":
        yield from _duplicate_referred_to(text, fault)


def _with_joined_names(text: str, code: str) -> Iterator[str]:
    """The line with names of several words joined by underscores, as in the rest of the file."""
    declared = {m[1] for m in _DECLARED_IN_PARTS.finditer(text)}
    arguments = re.findall(rf"[(,]\s*({NAME}(?:[ ]+{NAME})+)\s*(?=[,)])", code)
    repeated = {
        n for n in arguments if len(re.findall(rf"\b(?:{_spaced_or_joined(n)})\b", text)) > 1
    }
    for names in (declared, declared | repeated):
        new = code
        for name in sorted(names, key=len, reverse=True):
            if " of " not in name:
                new = re.sub(rf"\b{re.escape(name)}\b", re.sub(r"[ -]+", "_", name), new)
        yield new


def _spaced_or_joined(name: str) -> str:
    """A pattern that matches a name of several words, with blanks or underscores."""
    return f"{re.escape(name)}|{re.sub(r'[ -]+', '_', name)}"


def _with_stage_brackets(text: str, fault: Diagnostic, code: str) -> Iterator[str]:
    """The line with parameterised stages in angle brackets, where they are written like actions."""
    parameters = dict(re.findall(rf"<\s*({NAME})\s*(\([^()]*\))\s*>\s*::=", text))
    without_parameters = set(re.findall(rf"<\s*({NAME})\s*>\s*::=", text))
    yield re.sub(
        rf"<\s*({NAME})\s*>(?!\s*::=)",
        lambda m: (
            f"<{m[1]}{parameters[m[1]]}>"
            if m[1] in parameters and m[1] not in without_parameters
            else m[0]
        ),
        code,
    )
    if fault.code in ("E101", "E103", "E201"):
        with_parameters = set(parameters)
        yield re.sub(
            rf"(?<![<\w])({NAME})(\s*\([^()<>]*\))(?!\s*>)",
            lambda m: f"<{m[1]}{m[2]}>" if m[1] in with_parameters else m[0],
            code,
        )


def _with_unused_zone(text: str, fault: Diagnostic, code: str) -> Iterator[str]:
    """The line with an unused zone of the file in place of an unknown one."""
    if fault.code == "E229":
        spare = [z for z in _ZONE.findall(text) if len(re.findall(rf"\b{z}\b", text)) == 1]
        begin = fault.place.column - 1
        name = name_at(fault.place.text, begin, fault.place.length)
        yield from (re.sub(rf"\b{re.escape(name)}\b", zone, code) for zone in spare if name)


def name_at(line: str, begin: int, length: int) -> str:
    """The name at a place of a line."""
    found = re.match(NAME, line[begin : begin + length])
    return found[0] if found else ""


def _duplicate_renamed(text: str, fault: Diagnostic) -> Iterator[str]:
    """Hints for a stage defined twice: rename the second if it is referred to twice, else delete it."""
    head = re.match(rf"\s*<\s*({NAME})\s*>", fault.place.text)
    if head is not None:
        stages = re.findall(rf"<\s*({NAME})\s*>(?!\s*::=)", text)
        defined = re.findall(rf"<\s*({NAME})\s*>\s*::=", text)
        missing = [s for s in dict.fromkeys(stages) if s not in defined]
        yield from (f"write `<{s}>` in place of `<{head[1]}>`" for s in missing)
    if head is not None and len(_references(text, head[1])) > 1:
        yield f"write `<{head[1]}_2>` in place of `<{head[1]}>`"
    elif head is not None:
        yield f"leave `{fault.place.text.split('#')[0].strip()}` out"


def _duplicate_referred_to(text: str, fault: Diagnostic) -> Iterator[str]:
    """Refers to `<a_2>`, which is defined and unused, in the second of two references to `<a>`."""
    head = re.match(rf"\s*<\s*(({NAME})_2)\s*>", fault.place.text)
    if head is not None and len(references := _references(text, head[2])) > 1:
        match = re.search(r"\S+\s*$", text[: references[1].start()])
        word_before = match[0] if match and "\n" not in match[0] else ""
        yield f"write `{word_before}<{head[1]}>` in place of `{word_before}{references[1][0]}`"


def _references(text: str, stage: str) -> list[re.Match[str]]:
    """The references to a stage."""
    return list(re.finditer(rf"<\s*{stage}\s*>(?!\s*::=)", text))
