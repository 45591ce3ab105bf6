"""Agents with what they perceive, for tests of stepping."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

import numpy as np

from tests.agent.scripted import Scripted, alert_while, counting, frames
from visup.agent import Directive, Mind, Observation, Outcome
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.step import Step
from visup.evaluation.runtime.scripted_observations import moving_ellipses
from visup.evaluation.runtime.stepping import canonical_mind
from visup.rules.language.parser import parse_rules, shipped_rules
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.stepping import ScriptedObservations, Stepper
from visup.stepping.what_if import with_rules

COUNT = 60
SETTINGS = WatchSettings(
    "scripted", tasks=("dock",), actors={"satellite": ("spartan",), "arm": ("arm",)}
)

AHEAD_S = 9.5
"""The scene has gone on for so long when it is first seen: the arm and the satellite draw apart."""

STRANGER = """
rule unexpected_object(a): warning
    when unexpected(a) for 0.2 s and in_view(a) > 0.5 s
    hold 1 s
    say "{a} is in view, and no active task explains it."
"""
"""Told at once of anybody, wherever it came from: tests of stepping ask how it is told, not whether."""


def asking(mind: Mind, observation: Observation) -> Outcome:
    """Asks for something else in each step."""
    wish = Directive(
        "expect_regions", "There should be some.", {"count": observation.frame_index % 3}
    )
    return Outcome(mind, directives=(wish,))


def plain_agent() -> Agent:
    """Counts, is worried for a while, and sees what it was asked for."""
    reasoners = Reasoners(
        update=(counting,), cogitate=(alert_while(lambda t: 1.0 <= t < 2.5),), match=(asking,)
    )
    return Agent([Scripted("eye", ("x",), lambda i: (i * 7) % 5)], reasoners)


def plain_stepper(count: int = COUNT) -> Stepper:
    return Stepper(plain_agent(), frames(count), spacing=7, latest=5)


def reasoning_stepper(count: int = COUNT, spacing: int = 7, latest: int = 5) -> Stepper:
    """Three bodies that are recognised, a task, the shipped rules."""
    feed = ScriptedObservations(moving_ellipses(count, ahead_s=AHEAD_S))
    return Stepper(suspicious_agent(), feed, spacing=spacing, latest=latest)


def suspicious_agent() -> Agent:
    """An agent with the shipped rules, to which any stranger is unexpected."""
    agent = reasoning_agent(SETTINGS)
    rules = [r for r in shipped_rules() if r.name != "unexpected_object"]
    agent.reasoners = with_rules(agent.reasoners, (*rules, *parse_rules(STRANGER)))
    return agent


def told(step: Step | None) -> bytes:
    """All that a step came to, as bytes."""
    assert step is not None
    return flat((canonical_mind(step.mind), step.events, step.alerts, step.directives))


PLAIN = (str, int, float, bool, type(None))


def flat(value: Any) -> bytes:
    """A value as bytes by its content alone: which records are one and which are equal depends on the way."""
    kind: Any = type(value)
    if kind in PLAIN:
        return repr(value).encode()
    if kind is tuple or kind is list:
        return b"(" + b",".join([flat(v) for v in value]) + b")"
    names = names_of(kind)
    if names is not None:
        return str(kind.__name__).encode() + flat([getattr(value, n) for n in names])
    if isinstance(value, np.ndarray):
        return f"{value.dtype}{value.shape}".encode() + value.tobytes()
    if isinstance(value, Mapping):
        return b"{" + b",".join([flat(k) + b":" + flat(v) for k, v in value.items()]) + b"}"
    if isinstance(value, tuple | list):
        return b"(" + b",".join([flat(v) for v in value]) + b")"
    return repr(value).encode()


@cache
def names_of(kind: type) -> tuple[str, ...] | None:
    """Names of the fields of a record, or None."""
    return tuple(f.name for f in fields(kind)) if is_dataclass(kind) else None


@cache
def plain_course() -> tuple[bytes, ...]:
    """What the steps of `plain_stepper` come to when they are simply made."""
    return tuple(told(s) for s in plain_agent().steps(frames(COUNT)))


@cache
def reasoning_course(count: int = COUNT) -> tuple[Step, ...]:
    """The steps of `reasoning_stepper` when they are simply made."""
    agent = suspicious_agent()
    return tuple(agent.reason(seen) for seen in moving_ellipses(count, ahead_s=AHEAD_S))


@cache
def reasoning_bytes() -> tuple[bytes, ...]:
    """What the steps of `reasoning_stepper` come to when they are simply made, and not looked into."""
    agent = suspicious_agent()
    return tuple(told(agent.reason(seen)) for seen in moving_ellipses(COUNT, ahead_s=AHEAD_S))
