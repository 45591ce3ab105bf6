"""Alarm conditions: raised when a rule becomes true for some objects, and updated periodically."""

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
"""Most active conditions whose evidence is updated in one step: wording costs more than evaluation."""


@dataclass(frozen=True, slots=True)
class ActiveCondition:
    """An active condition, which persists for a while after its rule was last true.

    Attributes:
        concern: The condition.
        until: Time, seconds, until which it persists after its rule ceased to be true; infinite before.
        told: Time of its evidence, seconds.
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
    """Update the active conditions, and those in cooldown.

    Args:
        values: Values of all rules now.
        held: Active conditions before, oldest evidence first.
        cooling: End of cooldown, seconds, by condition.
        before: Time of the previous step, seconds.

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
        _expired(after, rest, found, values, before)
    for key in _oldest(held, found):
        old = after.pop(key)  # updated ones are moved to the end
        after[key] = ActiveCondition(
            _with_current_evidence(old.concern, found[key], values), inf, now
        )
    if found.keys() - after.keys():
        for key, hit in found.items():
            if key not in after and key not in rest:
                after[key] = ActiveCondition(_raised(hit, values), inf, now)
    return MappingProxyType(after), MappingProxyType(rest)


def _expired(
    held: dict[AlarmKey, ActiveCondition],
    cooling: dict[AlarmKey, float],
    found: Mapping[AlarmKey, int],
    values: Evaluation,
    before: float,
) -> None:
    """Set the expiry of conditions whose rule is no longer true, and remove expired ones."""
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
    """The conditions of oldest evidence whose rule is true; the first ones among equals."""
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
    """The condition for a set of objects, in the order of the first binding that is true."""
    rule, ids = values.prepared.choice(hit, values.facts.ids)
    words = with_names(rule.say, rule.variables)
    cause = sentence(values.facts.mind, words, *ids, confidence=confidence(rule, ids, values))
    return AlertCondition(rule.name, ids, rule.severity, cause, evidence(rule, ids, values))


def _with_current_evidence(concern: AlertCondition, hit: int, values: Evaluation) -> AlertCondition:
    """The condition with current evidence; its cause keeps the first wording, as in its alert."""
    rule, ids = values.prepared.choice(hit, values.facts.ids)
    current = evidence(rule, ids, values)
    if current == concern.evidence:
        return concern
    return AlertCondition(concern.kind, concern.objects, concern.severity, concern.cause, current)


def confidence(rule: Rule, ids: tuple[int, ...], values: Evaluation) -> float:
    """The least confidence of the true relations of these objects in `when`."""
    objects, mind = dict(zip(rule.variables, ids, strict=True)), values.facts.mind
    found = []
    for call in values.prepared.related(rule):
        a, b = (objects[w] for w in call.words)
        if mind.truth(call.name, a, b) is Truth.TRUE:
            relation = mind.relation(call.name, a, b)
            found += [relation.confidence] if relation else []
    return min(found, default=1.0)
