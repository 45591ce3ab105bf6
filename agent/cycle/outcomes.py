"""Merges the outcomes of reasoners after validation: phases are all or nothing."""

from __future__ import annotations

from math import isfinite

from visup.agent.contract.behaviour import Outcome
from visup.agent.model.events import AlertCondition, Directive, Event
from visup.agent.model.mind import Mind
from visup.agent.model.records import Observation


def merge_outcomes(so_far: Outcome, more: Outcome, observation: Observation) -> Outcome:
    """Merge the outcome of one more reasoner.

    Args:
        so_far: Merged outcome of the reasoners before.
        more: The outcome to add; its mind replaces the previous one.
        observation: The observation of the step.

    Raises:
        TypeError: It is no outcome, or has parts of a wrong type.
        ValueError: Its mind is of another moment, or a confidence or time is not a number.
    """
    _expect(more, Outcome, "the reasoner returned")
    _expect(more.mind, Mind, "the mind is")
    if (more.mind.time, more.mind.frame_index) != (observation.time, observation.frame_index):
        raise ValueError(
            f"the mind is of frame {more.mind.frame_index} at {more.mind.time} s, "
            f"not of frame {observation.frame_index} at {observation.time} s"
        )
    for parts, kind in (
        (more.events, Event),
        (more.conditions, AlertCondition),
        (more.directives, Directive),
    ):
        _all_are(parts, kind)
    for event in more.events:
        if not (isfinite(event.time) and 0.0 <= event.confidence <= 1.0):
            raise ValueError(
                f"event '{event.kind}' has time {event.time} and confidence {event.confidence}"
            )
    return Outcome(
        more.mind,
        so_far.events + more.events,
        so_far.conditions + more.conditions,
        so_far.directives + more.directives,
    )


def _all_are(parts: object, kind: type) -> None:
    if not isinstance(parts, tuple):
        raise TypeError(f"{kind.__name__}s are a {type(parts).__name__}, expected a tuple")
    for part in parts:
        if type(part) is not kind:
            _expect(part, kind, "a part is")


def _expect(value: object, kind: type, what: str) -> None:
    if not isinstance(value, kind):
        raise TypeError(f"{what} a {type(value).__name__}, expected {kind.__name__}")
