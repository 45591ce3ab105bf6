"""Textual questions: `why alert 2`, `why touching 1 2`, `why not coupled 1 2`, `why not stage captured`."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from visup.agent import Mind, Presence
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.rules.predicates.snapshot import RELATION_NAMES
from visup.stepping.breakpoints import rule_names, stage_names
from visup.stepping.explanations import why_not as whynot
from visup.stepping.explanations.evidence import Why
from visup.stepping.explanations.why import ReasonFinder
from visup.stepping.explanations.why_not import LastStep

ABOUT = ("alert", "object", "identity", "relation", "rule", "stage", "verdict")
"""First words of `why` questions."""
NOT_YET = ("entry", "exit", "occlusion", "reappearance", "identified", "coupled", "rule", "stage")
"""First words of `why not` questions, besides relations and names of rules and stages."""
_PRESENCE = {
    "exit": Presence.LEFT,
    "occlusion": Presence.HIDDEN,
    "reappearance": Presence.SEEN,
}


@dataclass(frozen=True, slots=True)
class ParsedQuestion:
    """A parsed question.

    Attributes:
        about: One of `ABOUT` or `NOT_YET`.
        name: Name of a rule, relation, stage or task; may be empty.
        ids: Numbers of an alert or of objects.
    """

    about: str
    name: str
    ids: tuple[int, ...]


def why(reasons: ReasonFinder, text: str) -> Why:
    """The answer to `why TEXT`.

    Raises:
        VisupError: The question is not valid, or its subject does not exist.
    """
    asked = _parsed(text, reasons.mind, ABOUT)
    answers: dict[str, Callable[[], Why]] = {
        "alert": lambda: reasons.alert(_single_id(asked, reasons.mind)),
        "object": lambda: reasons.object(_single_id(asked, reasons.mind)),
        "identity": lambda: reasons.identity(_single_id(asked, reasons.mind)),
        "relation": lambda: reasons.relation(asked.name, asked.ids),
        "rule": lambda: reasons.rule(asked.name, asked.ids),
        "stage": lambda: reasons.stage(asked.name),
        "verdict": lambda: reasons.verdict(asked.name or None),
    }
    return answers[asked.about]()


def why_not(step: LastStep, text: str) -> Why:
    """The answer to `why not TEXT`.

    Raises:
        VisupError: The question is not valid, or its subject does not exist.
    """
    mind = step.mind
    asked = _parsed(text, mind, (*NOT_YET, "relation"))
    if asked.about in _PRESENCE:
        wanted = _PRESENCE[asked.about]
        return whynot.presence_unmet(step, _single_id(asked, mind), wanted)
    answers: dict[str, Callable[[], Why]] = {
        "entry": lambda: whynot.entry_unmet(step, _single_id(asked, mind)),
        "identified": lambda: whynot.identity_unmet(step, _single_id(asked, mind)),
        "coupled": lambda: whynot.coupling_unmet(step, *_two_ids(asked)),
        "rule": lambda: whynot.alert_unmet(mind, asked.name, asked.ids),
        "stage": lambda: whynot.stage_unmet(mind, asked.name),
        "relation": lambda: whynot.relation_unmet(mind, asked.name, asked.ids),
    }
    return answers[asked.about]()


def _parsed(text: str, mind: Mind, known: tuple[str, ...]) -> ParsedQuestion:
    """`alert 2`, `relation touching 1 2`, `touching(1, 2)`, `captured`, ..."""
    words = re.findall(r"[^\s,()?]+", text)
    ids = tuple(int(w) for w in words if w.isdecimal())
    names = [w for w in words if not w.isdecimal()]
    about = names[0] if names else ""
    if about in known:
        return _complete(ParsedQuestion(about, names[1] if len(names) > 1 else "", ids), text)
    for kind, table in (
        ("stage", stage_names(mind)),
        ("rule", rule_names(mind)),
        ("relation", RELATION_NAMES),
    ):
        if about in table:
            return ParsedQuestion(kind, about, ids)
    tables = (*known, *stage_names(mind), *rule_names(mind), *RELATION_NAMES)
    raise SettingsError(
        f"this is not a question: '{text}'",
        expected=f"{', '.join(known)}, or the name of a stage, rule or relation with ids of objects",
        hint=did_you_mean(about, tables),
    )


def _complete(asked: ParsedQuestion, text: str) -> ParsedQuestion:
    if asked.about in ("relation", "rule", "stage") and not asked.name:
        raise SettingsError(f"'{text}' names no {asked.about}", expected=f"{asked.about} NAME ...")
    return asked


def _single_id(asked: ParsedQuestion, mind: Mind) -> int:
    """The number in a question; if there is only one alert or object, that one."""
    if asked.ids:
        return asked.ids[0]
    there = [a.id for a in mind.alerts] if asked.about == "alert" else sorted(mind.objects)
    if len(there) == 1:
        return there[0]
    numbers = ", ".join(map(str, there)) or "there is none"
    raise SettingsError(f"which {asked.about}?", expected=numbers)


def _two_ids(asked: ParsedQuestion) -> tuple[int, int]:
    if len(asked.ids) != 2:
        raise SettingsError(
            f"'{asked.about}' is about two objects", expected="such as: coupled 1 2"
        )
    return asked.ids[0], asked.ids[1]
