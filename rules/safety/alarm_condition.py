"""Alarm conditions: raised when a rule becomes true for some objects, and renewed from time to time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from types import MappingProxyType

from visup.agent import AlertCondition, Truth
from visup.rules.formula.nodes import Rule
from visup.rules.safety.compiled_rules import AlarmKey
from visup.rules.safety.explain import evidence
from visup.rules.safety.verdicts import Evaluation
from visup.rules.wording.sentences import sentence, with_names

MAX_UPDATED = 3
"""How many concerns that stand are told anew in one step; words cost more than judging."""


@dataclass(frozen=True, slots=True)
class ActiveCondition:
    """A concern that stays for a while after its rule was last true.

    Attributes:
        concern: The concern.
        until: Seconds up to which it stays though its rule is true no more; without end while it is.
        told: Seconds when its evidence was told.
    """

    concern: AlertCondition
    until: float
    told: float


def update(
    values: Evaluation,
    held: MappingProxyType[AlarmKey, ActiveCondition],
    cooling: Mapping[AlarmKey, float],
    before: float,
) -> tuple[MappingProxyType[AlarmKey, ActiveCondition], Mapping[AlarmKey, float]]:
    """What holds now and what still stands of before, and what must not be raised again yet.

    Args:
        values: Of all rules now.
        held: Concerns that stood, those whose evidence is oldest first.
        cooling: Until when, in seconds, objects raise no concern again.
        before: Seconds of the step before.

    Returns:
        The same two after this step.
    """
    now, found = values.facts.mind.time, values.true_of()
    after = held.copy()
    rest = {key: until for key, until in cooling.items() if until > now} if cooling else {}
    for key in [key for key, old in held.items() if old.until != inf]:
        if key in found:
            after[key] = ActiveCondition(held[key].concern, inf, held[key].told)
    if held.keys() - found.keys():
        _gone(after, rest, found, values, before)
    for key in _oldest(held, found):
        old = after.pop(key)  # what is told anew comes last
        after[key] = ActiveCondition(_retold(old.concern, found[key], values), inf, now)
    if found.keys() - after.keys():
        for key, hit in found.items():
            if key not in after and key not in rest:
                after[key] = ActiveCondition(_raised(hit, values), inf, now)
    return MappingProxyType(after), MappingProxyType(rest)


def _gone(
    held: dict[AlarmKey, ActiveCondition],
    cooling: dict[AlarmKey, float],
    found: Mapping[AlarmKey, int],
    values: Evaluation,
    before: float,
) -> None:
    """Note of concerns whose rule is true no more how long they stay, or take them out."""
    now, rules = values.facts.mind.time, values.prepared.rules_by_name
    for key in [key for key in held if key not in found]:
        rule, until = rules[key[0]], held[key].until
        if until == inf:
            until = before + (rule.hold.base if rule.hold is not None else 0.0)
            held[key] = ActiveCondition(held[key].concern, until, held[key].told)
        if until <= now:
            del held[key]
            if rule.cooldown is not None:
                cooling[key] = now + rule.cooldown.base


def _oldest(
    held: Mapping[AlarmKey, ActiveCondition], found: Mapping[AlarmKey, int]
) -> list[AlarmKey]:
    """Concerns whose evidence is oldest, of those whose rule is true; of several alike the first."""
    oldest: list[AlarmKey] = []
    for key, old in held.items():
        if len(oldest) >= MAX_UPDATED and old.told != held[oldest[-1]].told:
            break
        if key in found:
            oldest.append(key)
    if len(oldest) > MAX_UPDATED:
        place = {key: i for i, key in enumerate(found)}
        oldest.sort(key=lambda key: (held[key].told, place[key]))
    return oldest[:MAX_UPDATED]


def _raised(hit: int, values: Evaluation) -> AlertCondition:
    """One concern for each set of objects, in the order in which it is true of them."""
    rule, ids = values.prepared.choice(hit, values.facts.ids)
    words = with_names(rule.say, rule.variables)
    cause = sentence(values.facts.mind, words, *ids, confidence=confidence(rule, ids, values))
    return AlertCondition(rule.name, ids, rule.severity, cause, evidence(rule, ids, values))


def _retold(concern: AlertCondition, hit: int, values: Evaluation) -> AlertCondition:
    """The same with evidence of now; the cause keeps its first wording, as that of its alert does."""
    rule, ids = values.prepared.choice(hit, values.facts.ids)
    told = evidence(rule, ids, values)
    if told == concern.evidence:
        return concern
    return AlertCondition(concern.kind, concern.objects, concern.severity, concern.cause, told)


def confidence(rule: Rule, ids: tuple[int, ...], values: Evaluation) -> float:
    """The least confidence of the relations that `when` names of these objects and that are true."""
    objects, mind = dict(zip(rule.variables, ids, strict=True)), values.facts.mind
    found = []
    for call in values.prepared.related(rule):
        a, b = (objects[w] for w in call.words)
        if mind.truth(call.name, a, b) is Truth.TRUE:
            relation = mind.relation(call.name, a, b)
            found += [relation.confidence] if relation else []
    return min(found, default=1.0)
