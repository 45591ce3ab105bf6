"""Rules at work: every choice of objects for which a rule is true gives a concern."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import Concern, Mind, Observation, Outcome, TaskBelief, Truth
from visup.rules.explain import evidence
from visup.rules.facts import Facts
from visup.rules.formula import Rule
from visup.rules.operators import SPACING
from visup.rules.ruled import Ruled, ruled
from visup.rules.sentences import sentence, with_names
from visup.rules.states import States
from visup.rules.units import ticks
from visup.rules.verdicts import Values, rerowed

SAFETY = "rules.safety"
MOST_RETOLD = 3
"""How many concerns that stand are put in words anew in one step; words cost more than judging."""
Key = tuple[str, frozenset[int]]
"""Rule and objects."""


@dataclass(frozen=True, slots=True)
class Held:
    """A concern that stays for a while after its rule was last true.

    Attributes:
        concern: The concern.
        until: Seconds up to which it stays though its rule is true no more.
        told: Seconds when its sentences were made.
    """

    concern: Concern
    until: float
    told: float


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """What rules remember. States of operators share all but their newest cells with older ones.

    Attributes:
        rules: The rules.
        now: Microseconds of the last sample, or None before the first.
        ids: Its objects.
        before: States of the operators before it, for these objects.
        after: States after it.
        tasks: What tasks had come to when rules looked; they are matched later in a step.
        held: Concerns that stand.
        cooling: Until when, in seconds, objects raise no concern again.
    """

    rules: tuple[Rule, ...] = ()
    now: int | None = None
    ids: tuple[int, ...] = ()
    before: States | None = None
    after: States | None = None
    tasks: tuple[TaskBelief, ...] = ()
    held: Mapping[Key, Held] = field(default_factory=lambda: MappingProxyType({}))
    cooling: Mapping[Key, float] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class RuleThinker:
    """Thinker of the cogitate phase, after relations and couplings.

    It sees the tasks as they stood after the step before, since tasks are matched later.
    """

    rules: tuple[Rule, ...]
    _prepared: Ruled = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        # Rules are long trees: to look up by them what was prepared costs as much as a rule.
        object.__setattr__(self, "_prepared", ruled(self.rules))

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        old, now = kept(mind), ticks(mind.time)
        if old.rules != self.rules or (old.now is not None and now < old.now):
            old = Kept(self.rules)
        if old.now is not None and now - old.now < SPACING:
            return Outcome(mind, concerns=tuple(h.concern for h in old.held.values()))
        prepared, facts = self._prepared, Facts(mind)
        before = prepared.fresh(len(facts.ids)) if old.after is None else old.after
        if old.after is not None and old.ids != facts.ids:
            before = rerowed(prepared, old.after, now, old.ids, facts.ids)
        values = Values(prepared, facts, now, before)
        held, cooling = _concerns(self.rules, values, old)
        mind = mind.remember(
            SAFETY,
            Kept(self.rules, now, facts.ids, before, values.after, mind.tasks, held, cooling),
        )
        return Outcome(mind, concerns=tuple(h.concern for h in held.values()))


def kept(mind: Mind) -> Kept:
    """What rules remember in a mind."""
    found: Kept = mind.memory.get(SAFETY, Kept())
    return found


def _concerns(
    rules: tuple[Rule, ...], values: Values, old: Kept
) -> tuple[Mapping[Key, Held], Mapping[Key, float]]:
    """What holds now, what still stands of before, and what must not be raised again yet."""
    now = values.facts.mind.time
    held: dict[Key, Held] = {}
    cooling = {key: until for key, until in old.cooling.items() if until > now}
    found: dict[Key, tuple[Rule, tuple[int, ...]]] = {}
    for rule, ids in values.true():
        found.setdefault((rule.name, frozenset(ids)), (rule, ids))
    standing = [key for key in found if key in old.held]
    retold = sorted(standing, key=lambda key: old.held[key].told)[:MOST_RETOLD]
    for key, (rule, ids) in found.items():
        if key in old.held and key not in retold:
            before = old.held[key]
            held[key] = Held(before.concern, _until(rule, now), before.told)
        elif key not in cooling:
            held[key] = _raised(rule, ids, values, old.held.get(key))
    rests = {rule.name: rule.cooldown.base for rule in rules if rule.cooldown is not None}
    for key, before in old.held.items():
        if key in held:
            continue
        if before.until > now:
            held[key] = before
        elif key[0] in rests:
            cooling[key] = now + rests[key[0]]
    return MappingProxyType(held), MappingProxyType(cooling)


def _raised(rule: Rule, ids: tuple[int, ...], values: Values, before: Held | None) -> Held:
    """One concern for each set of objects; its order stays as it was when it was raised."""
    mind = values.facts.mind
    # Made anew, as the ids may be shared with another step (see `Sliding.step`).
    objects = (*ids,) if before is None else before.concern.objects
    words = with_names(rule.say, rule.variables)
    cause = sentence(mind, words, *objects, confidence=confidence(rule, ids, values))
    concern = Concern(rule.name, objects, rule.severity, cause, evidence(rule, ids, values))
    return Held(concern, _until(rule, mind.time), mind.time)


def _until(rule: Rule, now: float) -> float:
    return now + (rule.hold.base if rule.hold is not None else 0.0)


def confidence(rule: Rule, ids: tuple[int, ...], values: Values) -> float:
    """The least confidence of the relations that `when` names of these objects and that are true."""
    objects, mind = dict(zip(rule.variables, ids, strict=True)), values.facts.mind
    found = []
    for call in values.prepared.related(rule):
        a, b = (objects[w] for w in call.words)
        if mind.truth(call.name, a, b) is Truth.TRUE:
            relation = mind.relation(call.name, a, b)
            found += [relation.confidence] if relation else []
    return min(found, default=1.0)
