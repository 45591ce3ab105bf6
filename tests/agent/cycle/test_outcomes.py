"""Phases are all or nothing: whatever a reasoner returns, the mind stays whole."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import pytest

from tests.agent.scripted import COUNTING, Scripted, alert_while, counting, frames
from visup.agent import Event, Mind, Observation, Outcome
from visup.agent.cycle.agent import Agent, Reasoners

EVENT = Event("told", 0.0, 0, "It was told.")
NONSENSE: dict[str, Callable[[Mind], Any]] = {
    "nothing": lambda mind: None,
    "a mind": lambda mind: mind,
    "no mind": lambda mind: Outcome(None),  # type: ignore[arg-type]
    "a list of events": lambda mind: Outcome(mind, [EVENT]),  # type: ignore[arg-type]
    "an event alone": lambda mind: Outcome(mind, EVENT),  # type: ignore[arg-type]
    "texts as events": lambda mind: Outcome(mind, ("it was told",)),  # type: ignore[arg-type]
    "events as concerns": lambda mind: Outcome(mind, (), (EVENT,)),  # type: ignore[arg-type]
    "texts as directives": lambda mind: Outcome(mind, (), (), ("look",)),  # type: ignore[arg-type]
    "another time": lambda mind: Outcome(replace(mind, time=mind.time - 1.0)),
    "no time": lambda mind: Outcome(replace(mind, time=float("nan"))),
    "another frame": lambda mind: Outcome(replace(mind, frame_index=77)),
    "an event at no time": lambda mind: Outcome(mind, (replace(EVENT, time=float("nan")),)),
    "an event too sure": lambda mind: Outcome(mind, (replace(EVENT, confidence=2.0),)),
}


def raising_exit(mind: Mind) -> Any:
    raise SystemExit(2)


@pytest.mark.parametrize("what", [*NONSENSE, "exit"])
def test_an_invalid_outcome_leaves_the_mind_unchanged(what: str) -> None:
    says = NONSENSE.get(what, raising_exit)

    def think(mind: Mind, observation: Observation) -> Any:
        return says(mind) if observation.frame_index == 3 else Outcome(mind)

    always = alert_while(lambda _: True)
    agent = Agent([Scripted("eye", ("x",))], Reasoners((counting,), (always, think)))
    steps = list(agent.steps(frames(6)))
    before, hit = steps[2].mind, steps[3].mind
    assert (hit.frame_index, set(hit.unknown)) == (3, {"x"})
    news = {"time", "frame_index", "frame_size", "alerts", "unknown"}
    held = [f.name for f in fields(Mind) if f.name not in news]
    assert [getattr(hit, name) for name in held] == [getattr(before, name) for name in held]
    assert {a.kind for a in hit.alerts} == {"worry", "reasoning_failed"}
    assert steps[3].directives == ()
    assert [e.kind for e in steps[3].events] == ["alert"]
    assert steps[5].mind.recall(COUNTING) == 5
