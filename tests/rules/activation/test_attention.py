"""Attention: who rests, why, and that a region that rests is matched less often and told all the same."""

from __future__ import annotations

from dataclasses import replace

import pytest

from visup.agent import (
    Candidate,
    Directive,
    Expectation,
    Mind,
    ObjectBelief,
    Observation,
    Pose,
    Presence,
    Spin,
    TaskBelief,
    Verdict,
)
from visup.agent.cycle.agent import Agent, Reasoners
from visup.evaluation.runtime.scripted_observations import moving_ellipses
from visup.percepts.shape.behaviour import _rest_intervals
from visup.rules.activation.attention import AttentionReasoner
from visup.rules.reasoners import default_reasoners
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.testing import disc

REGION = disc(1)[0].regions[0]
KNOWN = ObjectBelief(
    1, REGION, Presence.SEEN, 0.0, 0.0, True, (Candidate("arm", 9.0, 1.0, 0.99),), unknown=0.01
)


def asked(belief: ObjectBelief, seconds: float = 3.0, expected: bool = False) -> list[Directive]:
    """What is asked for after a belief was held for a time."""
    wanted = (Expectation("touching", (1, 2)),) if expected else ()
    task = TaskBelief("dock", Verdict.IN_PROGRESS, expected=wanted)
    mind = Mind(objects={1: belief}, tasks=(task,))
    found: tuple[Directive, ...] = ()
    for n in range(round(seconds * 10) + 1):
        outcome = AttentionReasoner()(
            replace(mind, time=n / 10), Observation(n, n / 10, (160, 120))
        )
        mind, found = outcome.mind, outcome.directives
    return list(found)


def test_who_is_known_rests_with_a_reason() -> None:
    (told,) = asked(KNOWN)
    assert told.kind == "rest"
    assert told.data["region"] == REGION.id
    assert told.reason == "Object 1 is known to be the arm, and no further observation is needed."


@pytest.mark.parametrize(
    "belief",
    [
        replace(KNOWN, candidates=()),
        replace(KNOWN, candidates=(Candidate("arm", 1.0, 0.6, 0.9),)),
        replace(KNOWN, confirmed=False),
        replace(KNOWN, presence=Presence.LEFT),
        replace(
            KNOWN,
            pose=Pose("arm", 1, (0, 0, 1), 0.0, 0.0, spin=Spin(9.0, 1.0, (0, 0, 1))),
        ),
    ],
)
def test_who_is_not_settled_or_turns_is_looked_at(belief: ObjectBelief) -> None:
    assert asked(belief) == []


def test_whom_a_stage_asks_something_of_is_looked_at_and_who_is_known_only_now() -> None:
    assert asked(KNOWN, expected=True) == []
    assert asked(KNOWN, 1.9) == []
    assert asked(KNOWN, 2.0) != []


def test_without_attention_nothing_is_asked_and_nothing_else_changes() -> None:
    plain = reasoning_agent(WatchSettings("script"))
    attentive = reasoning_agent(WatchSettings("script", attention=True))
    rested = 0
    for seen in moving_ellipses(90):
        a, b = plain.reason(seen), attentive.reason(seen)
        assert a.directives == ()
        assert a.events == b.events
        rested += len(b.directives)
    assert rested > 0


def test_only_directives_for_the_behaviour_count() -> None:
    wishes = [
        Directive("rest", "r", {"behaviour": "shape", "region": 3, "every_s": 1.0}),
        Directive("rest", "r", {"behaviour": "lamp", "region": 4, "every_s": 1.0}),
        Directive("ignore", "r", {"bbox": (0, 0, 1, 1)}),
    ]
    assert _rest_intervals(wishes, "shape") == {3: 1.0}


def test_attention_is_a_reasoner_like_any_other() -> None:
    rules = default_reasoners()
    agent = Agent([], Reasoners(rules.update, rules.cogitate, attend=(AttentionReasoner(),)))
    last = [agent.reason(seen) for seen in moving_ellipses(90)][-1]
    assert last.directives
    assert {d.data["region"] for d in last.directives} <= {1, 2, 3}
