"""Breakpoints and the changes of each phase of a step: `visup.stepping` for pages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from visup.agent import Mind, Outcome
from visup.agent.contract.phases import Phase
from visup.agent.model.errors import SettingsError
from visup.stepping import Stepper, parse_condition
from visup.stepping.breakpoints import AnyStop, PhaseStop, StopCondition
from visup.stepping.cursor import PausedStep
from visup.stepping.diff import MindChange, mind_diff

CHUNK_STEPS = 100
"""Steps between two chances for other questions and for cancelling."""

MAX_CONDITIONS = 20


@dataclass(frozen=True, slots=True)
class StopSearchResult:
    """The result of a search.

    Attributes:
        number: Number of the step.
        reasons: The conditions met; empty if the run ended or the search was cancelled.
        ended: Whether the run ended.
    """

    number: int
    reasons: tuple[str, ...] = ()
    ended: bool = False


@dataclass(frozen=True, slots=True)
class PhaseRecord:
    """The effects of one phase of a step.

    Attributes:
        phase: The phase.
        percepts: Kind -> number of percepts.
        changes: Changes of belief by the phase.
        events: Texts of its events.
    """

    phase: Phase
    percepts: Mapping[str, int] = field(default_factory=dict)
    changes: tuple[MindChange, ...] = ()
    events: tuple[str, ...] = ()


def stop_conditions(stepper: Stepper, texts: Sequence[str]) -> AnyStop:
    """The disjunction of several conditions in the syntax of `break` in `visup step`.

    Raises:
        VisupError: One of them is not valid, or there is none.
    """
    conditions = [w.strip() for w in texts if w.strip()]
    if not 0 < len(conditions) <= MAX_CONDITIONS:
        raise SettingsError(
            f"there are {len(conditions)} conditions to stop at", expected=f"1 to {MAX_CONDITIONS}"
        )
    return AnyStop("; ".join(conditions), tuple(_condition(stepper, w) for w in conditions))


def _condition(stepper: Stepper, text: str) -> StopCondition:
    condition = parse_condition(text, stepper.mind, stepper.names)
    if isinstance(condition, PhaseStop):
        raise SettingsError(
            f"'{text}' is over in every step", hint="the phases of a step are listed below"
        )
    return condition


def search_stop(
    stepper: Stepper, number: int, until: AnyStop, cancelled: Callable[[], bool]
) -> Iterator[StopSearchResult]:
    """Step on until a condition is met; yields the position after each chunk, finally the one found.

    Args:
        stepper: Stepper of the run; others may move it between two chunks.
        number: Number of the step.
        until: The condition.
        cancelled: Whether the search was cancelled.
    """
    position, found = number, False
    while not found and not cancelled():
        if stepper.at != position or stepper.paused is not None:
            stepper.go(position)
        result = stepper.step(CHUNK_STEPS, until)
        position, found = stepper.at, bool(result.reasons) or result.ended
        yield StopSearchResult(position, result.reasons, result.ended)


def phases_of(stepper: Stepper, number: int) -> tuple[PhaseRecord, ...]:
    """The effects of each phase of a step.

    Args:
        stepper: Stepper of the run.
        number: Number of the step, from 1.

    Raises:
        SettingsError: There is no such step.
    """
    stepper.go(number)  # raises if the step does not exist yet
    stepper.go(number - 1)
    mind, reported_events, records = stepper.mind, 0, []
    for phase in Phase:
        result = stepper.step(1, until=phase)
        if result.paused is None:
            break
        if (outcome := result.paused.outcome) is None:
            records.append(_perceive_record(result.paused))
            continue
        records.append(_reasoning_record(phase, mind, outcome, reported_events))
        mind, reported_events = outcome.mind, len(outcome.events)
    step = stepper.last
    if step is not None and stepper.at == number:
        changes = mind_diff(mind, step.mind).changes
        texts = tuple(e.text for e in step.events[reported_events:])
        records.append(PhaseRecord(Phase.ACT, changes=changes, events=texts))
    return tuple(records)


def _perceive_record(paused: PausedStep) -> PhaseRecord:
    kinds = Counter(p.kind for r in paused.observation.reports for p in r.percepts)
    return PhaseRecord(Phase.PERCEIVE, dict(kinds))


def _reasoning_record(
    phase: Phase, before: Mind, outcome: Outcome, first_event: int
) -> PhaseRecord:
    texts = tuple(e.text for e in outcome.events[first_event:])
    return PhaseRecord(phase, changes=mind_diff(before, outcome.mind).changes, events=texts)
