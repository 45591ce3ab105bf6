"""Actions of one stage joined by `&`: they must hold at the same time, not one after the other.

Each action has a monitor of its own. An action that ceased before another one began must hold again. Actions
of a stage with the same `for` are credited with the time for which all of them have held together.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from visup.agent.model.fast_replace import replace
from visup.tasks.automaton.states import (
    Leaf,
    ParallelState,
    SequenceState,
    State,
    TaskStep,
    leaves,
    with_leaves,
)
from visup.tasks.verification.step_monitor import StepMonitor, without_hold

WorkingTime = Callable[[TaskStep, float, float], float]
"""Seconds of work on a step between two times, pauses cut out."""


def reset_lapsed_actions(
    state: State[StepMonitor],
    is_concurrent: Callable[[TaskStep], bool],
    working_time: WorkingTime,
    tolerance_s: float,
) -> State[StepMonitor]:
    """The state with the monitors of actions reset that ceased before an action joined to them began.

    Args:
        state: The active steps with their monitors.
        is_concurrent: Whether an action must hold at the same time as others; those that last until something
            else begins need not.
        working_time: Measures the working time between the end of one action and the beginning of another.
        tolerance_s: Longest gap that is tolerated, seconds, since relations are confirmed with different
            delays.
    """
    match state:
        case SequenceState(head=head):
            reset = reset_lapsed_actions(head, is_concurrent, working_time, tolerance_s)
            return state if reset is head else replace(state, head=reset)
        case ParallelState(parts=parts):
            group = [p for p in parts if isinstance(p, Leaf) and is_concurrent(p.step)]
            lapsed = {id(x) for x in group if _has_lapsed(x, group, working_time, tolerance_s)}
            if lapsed:
                new = [_without_hold(x) if id(x) in lapsed else x for x in leaves(state)]
                state = with_leaves(state, iter(new))
            return _with_shared_duration(state)
    return state


def _with_shared_duration(state: State[StepMonitor]) -> State[StepMonitor]:
    """The state in which actions with the same `for` have held for the shortest time of them all."""
    groups: dict[tuple[str, float], list[Leaf[StepMonitor]]] = {}
    for part in state.parts if isinstance(state, ParallelState) else ():
        if (
            isinstance(part, Leaf)
            and part.step.hold_s is not None
            and not part.step.has_stage_conditions
        ):
            groups.setdefault((part.step.stage, part.step.hold_s), []).append(part)
    waiting = [g for g in groups.values() if not all(x.payload.fulfilled for x in g)]
    held = {id(x): min(y.payload.held_s for y in group) for group in waiting for x in group}
    if not held:
        return state
    new = [_with_held_s(x, held[id(x)]) if id(x) in held else x for x in leaves(state)]
    return with_leaves(state, iter(new))


def _with_held_s(leaf: Leaf[StepMonitor], held_s: float) -> Leaf[StepMonitor]:
    monitor = replace(leaf.payload, held_s=held_s, fulfilled=False, fulfilled_at=None)
    return replace(leaf, payload=monitor)


def _has_lapsed(
    leaf: Leaf[StepMonitor],
    group: Iterable[Leaf[StepMonitor]],
    working_time: WorkingTime,
    tolerance_s: float,
) -> bool:
    """Whether an action of the stage began to hold only after this one had ceased."""
    ended = leaf.payload.held_at
    if not leaf.payload.held or ended is None:
        return False
    others = (x.payload for x in group if x.step.stage == leaf.step.stage)
    beginnings = (o.held_from for o in others if o.held and o.held_from is not None)
    return any(working_time(leaf.step, ended, since) > tolerance_s for since in beginnings)


def _without_hold(leaf: Leaf[StepMonitor]) -> Leaf[StepMonitor]:
    return replace(leaf, payload=without_hold(leaf.payload))
