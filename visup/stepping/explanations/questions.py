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

WHY_TOPICS = ("alert", "object", "identity", "relation", "rule", "stage", "verdict")
"""First words of `why` questions."""
WHY_NOT_TOPICS = (
    "entry",
    "exit",
    "occlusion",
    "reappearance",
    "identified",
    "coupled",
    "rule",
    "stage",
)
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
        about: One of `WHY_TOPICS` or `WHY_NOT_TOPICS`.
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
    question = _parse_question(text, reasons.mind, WHY_TOPICS)
    answers: dict[str, Callable[[], Why]] = {
        "alert": lambda: reasons.alert(_single_id(question, reasons.mind)),
        "object": lambda: reasons.object(_single_id(question, reasons.mind)),
        "identity": lambda: reasons.identity(_single_id(question, reasons.mind)),
        "relation": lambda: reasons.relation(question.name, question.ids),
        "rule": lambda: reasons.rule(question.name, question.ids),
        "stage": lambda: reasons.stage(question.name),
        "verdict": lambda: reasons.verdict(question.name or None),
    }
    return answers[question.about]()


def why_not(step: LastStep, text: str) -> Why:
    """The answer to `why not TEXT`.

    Raises:
        VisupError: The question is not valid, or its subject does not exist.
    """
    mind = step.mind
    question = _parse_question(text, mind, (*WHY_NOT_TOPICS, "relation"))
    if question.about in _PRESENCE:
        presence = _PRESENCE[question.about]
        return whynot.presence_unmet(step, _single_id(question, mind), presence)
    answers: dict[str, Callable[[], Why]] = {
        "entry": lambda: whynot.entry_unmet(step, _single_id(question, mind)),
        "identified": lambda: whynot.identity_unmet(step, _single_id(question, mind)),
        "coupled": lambda: whynot.coupling_unmet(step, *_two_ids(question)),
        "rule": lambda: whynot.alert_unmet(mind, question.name, question.ids),
        "stage": lambda: whynot.stage_unmet(mind, question.name),
        "relation": lambda: whynot.relation_unmet(mind, question.name, question.ids),
    }
    return answers[question.about]()


def _parse_question(text: str, mind: Mind, known: tuple[str, ...]) -> ParsedQuestion:
    """`alert 2`, `relation touching 1 2`, `touching(1, 2)`, `captured`, ..."""
    words = re.findall(r"[^\s,()?]+", text)
    ids = tuple(int(w) for w in words if w.isdecimal())
    names = [w for w in words if not w.isdecimal()]
    about = names[0] if names else ""
    if about in known:
        return _checked(ParsedQuestion(about, names[1] if len(names) > 1 else "", ids), text)
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


def _checked(question: ParsedQuestion, text: str) -> ParsedQuestion:
    if question.about in ("relation", "rule", "stage") and not question.name:
        raise SettingsError(
            f"'{text}' names no {question.about}", expected=f"{question.about} NAME ..."
        )
    return question


def _single_id(question: ParsedQuestion, mind: Mind) -> int:
    """The number in a question; if there is only one alert or object, that one."""
    if question.ids:
        return question.ids[0]
    candidates = [a.id for a in mind.alerts] if question.about == "alert" else sorted(mind.objects)
    if len(candidates) == 1:
        return candidates[0]
    numbers = ", ".join(map(str, candidates)) or "there is none"
    raise SettingsError(f"which {question.about}?", expected=numbers)


def _two_ids(question: ParsedQuestion) -> tuple[int, int]:
    if len(question.ids) != 2:
        raise SettingsError(
            f"'{question.about}' is about two objects", expected="such as: coupled 1 2"
        )
    return question.ids[0], question.ids[1]
