"""What each construct of the task language comes to: a sentence, what is seen, the verdict."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.tasks.scripted import ARM, SATELLITE, RelationSpan, Script, task_of, watch
from visup.agent import Severity, Verdict
from visup.tasks.supervision.supervise import finish
from visup.wording import worded_once


def spans(*named: tuple[str, float, float]) -> Script:
    return Script(tuple(RelationSpan(*n) for n in named))


HOLD = ("keeping_distance", 5, 12)
CASES = {
    "an alternative, the first": (
        "<t> ::= converging(arm, satellite) (touching(arm, satellite) | diverging(arm, satellite))",
        spans(("converging", 0, 5), ("touching", 5, 9)),
        Verdict.SUCCEEDED,
    ),
    "an alternative, the second": (
        "<t> ::= converging(arm, satellite) (touching(arm, satellite) | diverging(arm, satellite))",
        spans(("converging", 0, 5), ("diverging", 5.5, 9)),
        Verdict.SUCCEEDED,
    ),
    "what may be left out, left out": (
        "<t> ::= converging(arm, satellite) keeping_distance(arm, satellite)? "
        "touching(arm, satellite)",
        spans(("converging", 0, 5), ("touching", 5, 9)),
        Verdict.SUCCEEDED,
    ),
    "what may be left out, there": (
        "<t> ::= converging(arm, satellite) keeping_distance(arm, satellite)? "
        "touching(arm, satellite)",
        spans(("converging", 0, 5), HOLD, ("converging", 12, 13), ("touching", 13, 16)),
        Verdict.SUCCEEDED,
    ),
    "what must be there, left out": (
        "<t> ::= converging(arm, satellite) keeping_distance(arm, satellite) for 5 s "
        "touching(arm, satellite)",
        spans(("converging", 0, 5), ("keeping_distance", 5, 7), ("diverging", 7, 15)),
        Verdict.FAILED,
    ),
    "a repetition, none": (
        "<t> ::= (converging(arm, satellite) diverging(arm, satellite))* touching(arm, satellite)",
        spans(("touching", 3, 9)),
        Verdict.SUCCEEDED,
    ),
    "a repetition, two": (
        "<t> ::= (converging(arm, satellite) diverging(arm, satellite))* touching(arm, satellite)",
        spans(
            ("converging", 0, 4),
            ("diverging", 4, 8),
            ("converging", 8, 12),
            ("diverging", 12, 15),
            ("touching", 16, 20),
        ),
        Verdict.SUCCEEDED,
    ),
    "a repetition, at least once": (
        "<t> ::= (converging(arm, satellite) diverging(arm, satellite))+ coupled(arm, satellite)",
        spans(
            ("converging", 0, 4),
            ("diverging", 4, 8),
            ("converging", 8, 12),
            ("diverging", 12, 15),
            ("coupled", 16, 20),
        ),
        Verdict.SUCCEEDED,
    ),
    "at the same time": (
        "<t> ::= converging(arm, satellite) & present(arm) touching(arm, satellite)",
        spans(("converging", 0, 5), ("touching", 5, 8)),
        Verdict.SUCCEEDED,
    ),
    "held for long enough": (
        "<t> ::= keeping_distance(arm, satellite) for 5 s",
        spans(HOLD),
        Verdict.SUCCEEDED,
    ),
    "not held for long enough": (
        "<t> ::= keeping_distance(arm, satellite) for 8 s",
        spans(HOLD, ("diverging", 12, 20)),
        Verdict.FAILED,
    ),
    "in time": (
        "<t> ::= converging(arm, satellite) within 8 s touching(arm, satellite)",
        spans(("converging", 0, 5), ("touching", 5, 8)),
        Verdict.SUCCEEDED,
    ),
    "too late": (
        "<t> ::= converging(arm, satellite) within 4 s touching(arm, satellite)",
        spans(("converging", 0, 5), ("touching", 5, 8)),
        Verdict.FAILED,
    ),
    "too late in all": (
        "<t> ::= (converging(arm, satellite) coupled(arm, satellite)) within 10 s",
        spans(("converging", 0, 8), ("touching", 8, 30), ("coupled", 12, 30)),
        Verdict.FAILED,
    ),
    "something that must never be": (
        "<t> ::= converging(arm, satellite) keeping_distance(arm, satellite)\n"
        "never touching(arm, satellite)",
        spans(("converging", 0, 5), ("touching", 5, 7), ("keeping_distance", 7, 12)),
        Verdict.INTERRUPTED,
    ),
    "something that must never be in another stage": (
        "<t> ::= <a> <b>\n<a> ::= converging(arm, satellite)\n<b> ::= touching(arm, satellite)\n"
        "never moving_together(arm, satellite) during <a>",
        spans(("converging", 0, 5), ("touching", 5, 9), ("moving_together", 5.5, 9)),
        Verdict.SUCCEEDED,
    ),
    "something that must always be": (
        "<t> ::= converging(arm, satellite) touching(arm, satellite)\nalways present(arm)",
        spans(("converging", 0, 5), ("touching", 5, 9)),
        Verdict.SUCCEEDED,
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_each_construct_gives_the_expected_verdict(name: str) -> None:
    text, script, verdict = CASES[name]
    until = max(s.to_s for s in script.spans)
    assert finish(task_of(watch(script, until, text))) is verdict


def test_a_broken_invariant_is_a_severe_alert_condition() -> None:
    text, script, _ = CASES["something that must never be"]
    played = watch(script, 12.0, text)
    event = next(e for e in played.events if e.kind == "invariant_broken")
    assert event.severity is Severity.CRITICAL
    assert "`never touching(arm, satellite)` has not held since 5.0 s" in event.text
    concerns = {o.mind.time: [c.kind for c in o.conditions] for o in played.outcomes}
    assert concerns[6.0] == ["invariant_broken"]
    assert not concerns[8.0]


LEAVES = {ARM: (0.0, 6.0), SATELLITE: (0.0, 1e9)}


@pytest.mark.parametrize("must", ["never touching(arm, satellite)", "always present(arm)"])
def test_a_broken_invariant_is_reported_once_with_the_verdict(must: str) -> None:
    text = f"<t> ::= converging(arm, satellite) keeping_distance(arm, satellite) for 3 s\n{must}"
    script = spans(("converging", 0, 5), ("keeping_distance", 5, 12), ("touching", 6, 9))
    script = replace(script, objects=LEAVES) if "present" in must else script
    played = watch(script, 12.0, text)
    lines = [e for step in played.outcomes for e in worded_once(step.events)]
    severe = [e.text for e in lines if e.severity > Severity.INFO]
    assert len(severe) == 1
    assert severe[0].startswith("Task `t` ")
    causes = {c.cause for step in played.outcomes for c in step.conditions}
    assert causes == set(severe)
