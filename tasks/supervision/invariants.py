"""Invariants (conditions that must never or always hold during stages or a task), and the order of stages."""

from __future__ import annotations

from collections.abc import Iterator

from visup.agent import AlertCondition, Event, Mind, Severity, TaskBelief, Truth, Verdict
from visup.tasks.automaton.backpointers import behind
from visup.tasks.automaton.out_of_turn import out_of_turn
from visup.tasks.automaton.prognosis import begun_by
from visup.tasks.automaton.states import TaskStep, leaves
from visup.tasks.grammar.conditions import action_of, facts_of
from visup.tasks.grammar.nodes import Invariant
from visup.tasks.grammar.structure import fact_key
from visup.tasks.grammar.units import value
from visup.tasks.supervision.advance import BEFORE_S
from visup.tasks.supervision.events import played
from visup.tasks.supervision.hypotheses import TaskHypotheses, likely
from visup.tasks.supervision.memory import OrderViolation, TaskMemory
from visup.tasks.supervision.monitored_phases import MonitoredPhases
from visup.tasks.supervision.sentences import before_its_turn, verdict_sentence
from visup.tasks.supervision.snapshot import TaskSnapshot


def broken_since(
    model: MonitoredPhases, snapshot: TaskSnapshot, memory: TaskMemory
) -> tuple[float | None, ...]:
    """Time since when each invariant has been broken, seconds, or None; an unobserved one counts as kept."""
    before = memory.broken_since
    if not memory.activity.reportable:
        return (None,) * len(before)  # invariants do not apply while the task is not in progress
    return tuple(
        (since if since is not None else snapshot.mind.time)
        if _breaks(i, snapshot, memory)
        else None
        for i, since in zip(model.task.invariants, before, strict=True)
    )


def _breaks(invariant: Invariant, snapshot: TaskSnapshot, memory: TaskMemory) -> bool:
    holds = snapshot.holds(invariant.condition, None)
    if invariant.during and not {r.stage for r in invariant.during} & _under_way(memory):
        return False
    return holds is (Truth.TRUE if invariant.when == "never" else Truth.FALSE)


def _under_way(memory: TaskMemory) -> frozenset[str]:
    """The active stages in the best hypothesis, with the stages that contain them."""
    posterior = memory.posterior
    if posterior is None or posterior.likeliest.finished is not None:
        return frozenset()
    steps = [x.step for x in leaves(posterior.likeliest.state)]
    return frozenset().union(*(s.inside for s in steps))


def is_of_safety(model: MonitoredPhases, invariant: Invariant) -> bool:
    """Whether an invariant is about two objects, or an object and a zone, so that breaking it is unsafe.

    An invariant about one object alone (that the charger moves) concerns the work: breaking it is a failure.
    """
    facts = facts_of(invariant.condition)
    zones = {z.name for z in model.task.zones}
    words = [action_of(f).arguments for f in facts]
    return any(len(named) > 1 or zones & {str(w) for w in named} for named in words)


def violation(
    model: MonitoredPhases, broken: tuple[float | None, ...], now: float, *, safety: bool
) -> str:
    """The reason for a violation: an invariant broken for long enough; or empty.

    Args:
        model: The task.
        broken: Time since when each invariant has been broken, seconds, or None.
        now: Current time, seconds.
        safety: Whether to consider the invariants of safety (`is_of_safety`), or the others.
    """
    for invariant, since in zip(model.task.invariants, broken, strict=True):
        if since is None or now - since < patience(model, invariant):
            continue
        if is_of_safety(model, invariant) is safety:
            return _reason(invariant, since)
    return ""


def _reason(invariant: Invariant, since: float) -> str:
    return f"`{invariant}` has not held since {since:.1f} s"


def _told(model: MonitoredPhases, belief: TaskBelief, reason: str) -> str:
    """The sentence for a broken invariant, in the words of the verdict."""
    if reason == belief.evidence and belief.verdict in (Verdict.FAILED, Verdict.INTERRUPTED):
        return verdict_sentence(model.task.name, belief.verdict, reason)
    if belief.verdict is Verdict.SUCCEEDED:  # success is final
        return f"Task `{model.task.name}` has succeeded, but {reason}."
    return f"Task `{model.task.name}`: {reason}."


def order_violation(
    model: MonitoredPhases,
    snapshot: TaskSnapshot,
    posterior: TaskHypotheses | None,
    before: OrderViolation | None,
) -> OrderViolation | None:
    """A later step that was done before a step that must come first, until it has been undone; or None.

    Only some steps are considered (`MonitoredPhases.later`): they must end once they have held, and must not
    be true before anything is done, such as that two objects are apart. Nor may anything have been required
    of their actors before, since the action of an earlier stage may continue or recur.

    Args:
        model: The task.
        snapshot: The present observation.
        posterior: The hypotheses; None while the task has not begun.
        before: The violation of the previous step, or None.
    """
    if before is not None and snapshot.observe(before.step).holds is not Truth.FALSE:
        return before
    if posterior is None or posterior.likeliest.finished is not None:
        return None
    nodes = tuple(likely(posterior).hypotheses)
    entered = min(x.payload.entered for x in leaves(posterior.likeliest.state))
    later = dict.fromkeys(s for n in nodes for s in model.later(n))
    done = [s for s in later if _done_since(model, snapshot, s, entered)]
    if not done:
        return None
    hypotheses = [posterior.hypotheses[n].value for n in nodes]
    active = {x.step: x.payload for h in hypotheses for x in leaves(h.state)}
    required = {frozenset(s.actors) for s in active}
    required |= {frozenset(s.actors) for n in nodes for s in _next(model, n)}
    required |= {frozenset(b.step.actors) for h in hypotheses for b in behind(h.backpointer)}
    done = [s for s in done if frozenset(s.actors) not in required]

    def lacks(step: TaskStep) -> bool:
        if model.actions[step.action].lasts or (step in active and active[step].held):
            return False
        return snapshot.observe(step).holds is Truth.FALSE

    found = out_of_turn(model.automaton, nodes, done, lacks)
    if found is None:
        return None
    step, first = found
    held_by = snapshot.observe(step).held_by
    assert held_by is not None
    why = before_its_turn(step, model.actions[step.action], held_by.since, first.stage)
    return OrderViolation(step, why)


def _next(model: MonitoredPhases, node: int) -> Iterator[TaskStep]:
    """The steps that may come next."""
    for transition in model.automaton.transitions(node):
        yield from begun_by(model.automaton, transition)


def _done_since(
    model: MonitoredPhases, snapshot: TaskSnapshot, step: TaskStep, entered: float
) -> bool:
    """Whether a step began to hold well after `entered` (seconds), and has held long enough to be done."""
    held_by = snapshot.observe(step).held_by
    if held_by is None or held_by.since <= entered + BEFORE_S:
        return False
    must = max(
        model.actions[step.action].hold_s, step.hold_s or 0.0, model.settings.contrary_early_s
    )
    return snapshot.mind.time - held_by.since >= must


def patience(model: MonitoredPhases, invariant: Invariant) -> float:
    """How long an invariant must be broken to count, seconds."""
    if invariant.lasting is None:
        return model.settings.contrary_s
    return value(model.task.amount(invariant.lasting.duration))


def invariant_concerns(model: MonitoredPhases, memory: TaskMemory) -> Iterator[AlertCondition]:
    """An alert condition for each invariant broken for long enough."""
    for invariant, since in zip(model.task.invariants, memory.broken_since, strict=True):
        if since is not None and memory.time - since >= patience(model, invariant):
            facts = facts_of(invariant.condition)
            actors = (a for f in facts for a in fact_key(model.task, f)[1])
            objects = played(memory.belief, tuple(dict.fromkeys(actors)))
            cause = _told(model, memory.belief, _reason(invariant, since))
            key = f"{model.task.name}: {invariant}"
            yield AlertCondition("invariant_broken", objects, Severity.CRITICAL, cause, (), key)


def invariant_events(
    model: MonitoredPhases, memory: TaskMemory, new: TaskMemory, mind: Mind
) -> Iterator[Event]:
    """An event for each invariant whose violation counts from this step on."""
    for i, invariant in enumerate(model.task.invariants):
        must = patience(model, invariant)
        since = new.broken_since[i]
        if since is not None and memory.time - since < must <= new.time - since:
            text = _told(model, new.belief, _reason(invariant, since))
            yield Event(
                "invariant_broken",
                mind.time,
                mind.frame_index,
                text,
                severity=Severity.CRITICAL,
                data={"task": model.task.name, "invariant": str(invariant)},
            )
