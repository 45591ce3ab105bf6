"""The rule reasoner: an alarm condition for every binding of objects for which a rule is true."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import AlertCondition, Mind, Observation, Outcome, TaskBelief
from visup.agent.model.memory import MemoryKey
from visup.rules.formula.nodes import Rule
from visup.rules.formula.units import ticks
from visup.rules.monitoring.samples import MIN_SPACING
from visup.rules.monitoring.states import States
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.safety.alarm_condition import ActiveCondition, update_conditions
from visup.rules.safety.compiled_rules import AlarmKey, CompiledRules, compile_rules
from visup.rules.safety.verdicts import Evaluation, reindexed_states


@dataclass(frozen=True, slots=True, eq=False)
class RuleMemory:
    """The memory of rules. States of operators share all but their newest cells with older ones.

    Attributes:
        rules: The rules.
        now: Microseconds of the last sample, or None before the first.
        time: The same in seconds.
        ids: Its objects.
        before: States of the operators before it, for these objects.
        after: States after it.
        tasks: Tasks as seen by the rules; they are matched later in a step.
        active: Active conditions, oldest sentences first.
        cooling: End of cooldown, seconds, by condition.
        early: Whether verdicts about the future were reported as soon as they were decided.
        since: Microseconds of the first sample of each of its objects.
    """

    rules: tuple[Rule, ...] = ()
    now: int | None = None
    time: float = 0.0
    ids: tuple[int, ...] = ()
    before: States | None = None
    after: States | None = None
    tasks: tuple[TaskBelief, ...] = ()
    active: MappingProxyType[AlarmKey, ActiveCondition] = field(
        default_factory=lambda: MappingProxyType({})
    )
    cooling: Mapping[AlarmKey, float] = field(default_factory=lambda: MappingProxyType({}))
    early: bool = False
    since: Mapping[int, int] = field(default_factory=lambda: MappingProxyType({}))


SAFETY = MemoryKey("rules.safety", RuleMemory())


@dataclass(frozen=True, slots=True)
class RuleReasoner:
    """Reasoner of the cogitate phase, after relations and couplings.

    It sees the tasks as of the previous step, since tasks are matched later.

    Attributes:
        rules: The rules to monitor.
        memory: Its key; a second rule reasoner in the same agent needs its own.
        early: Whether verdicts about the future are reported as soon as they are decided, not only when
            all their windows are over.
    """

    rules: tuple[Rule, ...]
    memory: MemoryKey[RuleMemory] = SAFETY
    early: bool = False
    _compiled: CompiledRules = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Kept, since hashing the rules' trees for a cache lookup costs as much as a rule.
        object.__setattr__(self, "_compiled", compile_rules(self.rules, self.early))

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        old, now = mind.recall(self.memory), ticks(mind.time)
        # Comparing the trees would cost more than evaluating them.
        same = (old.rules is self.rules or old.rules == self.rules) and old.early == self.early
        if not same or (old.now is not None and now < old.now):
            old = RuleMemory(self.rules, early=self.early)
        if old.now is not None and now - old.now < MIN_SPACING:
            conditions = tuple(h.condition for h in old.active.values())
            return Outcome(mind, conditions=once_per_machine(conditions, mind))
        compiled, facts = self._compiled, Snapshot(mind)
        before = compiled.initial_states(len(facts.ids)) if old.after is None else old.after
        if old.after is not None and old.ids != facts.ids:
            before = reindexed_states(compiled, old.after, now, old.ids, facts.ids)
        since = old.since
        if old.ids != facts.ids:
            since = MappingProxyType({i: since.get(i, now) for i in facts.ids})
        values = Evaluation(compiled, facts, now, before)
        active, cooling = update_conditions(values, old.active, old.cooling, old.time)
        mind = mind.remember(
            self.memory,
            RuleMemory(
                self.rules,
                now,
                mind.time,
                facts.ids,
                before,
                values.after,
                mind.tasks,
                active,
                cooling,
                self.early,
                since,
            ),
        )
        conditions = tuple(h.condition for h in active.values())
        return Outcome(mind, conditions=once_per_machine(conditions, mind))


def once_per_machine(
    conditions: tuple[AlertCondition, ...], mind: Mind
) -> tuple[AlertCondition, ...]:
    """Drop conditions that repeat another one for a different part of a machine.

    Those of an open alert stay; else the most severe stays, the first among equals.
    """
    machine_of = {i: m[0] for task in mind.tasks for m in task.machines for i in m}
    if not machine_of:
        return conditions
    open_now = {(a.kind, a.objects, a.key) for a in mind.alerts}
    ranked = sorted(
        conditions,
        key=lambda c: ((c.kind, c.objects, c.key) not in open_now, -c.severity),
    )
    first: dict[tuple[str, tuple[int, ...]], AlertCondition] = {}
    for c in ranked:
        about = tuple(sorted({machine_of.get(i, i) for i in c.objects}))
        first.setdefault((c.kind, about), c)
    retained = {id(c) for c in first.values()}
    return tuple(c for c in conditions if id(c) in retained)


def rule_memory(mind: Mind) -> RuleMemory:
    """The memory of rules in a mind."""
    return mind.recall(SAFETY)
