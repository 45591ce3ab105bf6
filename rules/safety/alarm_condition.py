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
        condition: The condition.
        until: Time, seconds, until which it persists after its rule ceased to be true; infinite before.
        evidence_time: Time of its evidence, seconds.
    """

    condition: AlertCondition
    until: float
    evidence_time: float


def update_conditions(
    values: Evaluation,
    active: MappingProxyType[AlarmKey, ActiveCondition],
    cooling: Mapping[AlarmKey, float],
    before: float,
) -> tuple[MappingProxyType[AlarmKey, ActiveCondition], Mapping[AlarmKey, float]]:
    """Update the active conditions, and those in cooldown.

    Args:
        values: Values of all rules now.
        active: Active conditions before, oldest evidence first.
        cooling: End of cooldown, seconds, by condition.
        before: Time of the previous step, seconds.

    Returns:
        The same two after this step.
    """
    now, true_keys = values.facts.mind.time, values.true_keys()
    after = active.copy()
    still_cooling = {key: until for key, until in cooling.items() if until > now} if cooling else {}
    for key in [key for key, old in active.items() if old.until != inf]:
        if key in true_keys:
            after[key] = ActiveCondition(active[key].condition, inf, active[key].evidence_time)
    if active.keys() - true_keys.keys():
        _update_expiry(after, still_cooling, true_keys, values, before)
    for key in _with_oldest_evidence(active, true_keys):
        old = after.pop(key)  # updated ones are moved to the end
        after[key] = ActiveCondition(
            _with_current_evidence(old.condition, true_keys[key], values), inf, now
        )
    if true_keys.keys() - after.keys():
        for key, hit in true_keys.items():
            if key not in after and key not in still_cooling:
                after[key] = ActiveCondition(_new_condition(hit, values), inf, now)
    return MappingProxyType(after), MappingProxyType(still_cooling)


def _update_expiry(
    active: dict[AlarmKey, ActiveCondition],
    cooling: dict[AlarmKey, float],
    true_keys: Mapping[AlarmKey, int],
    values: Evaluation,
    before: float,
) -> None:
    """Set the expiry of conditions whose rule is no longer true, and remove expired ones."""
    now, rules = values.facts.mind.time, values.compiled.rules_by_name
    for key in [key for key in active if key not in true_keys]:
        rule, until = rules[key[0]], active[key].until
        if until == inf:
            until = before + (rule.hold.base if rule.hold is not None else 0.0)
            active[key] = ActiveCondition(active[key].condition, until, active[key].evidence_time)
        if until <= now:
            del active[key]
            if rule.cooldown is not None:
                cooling[key] = now + rule.cooldown.base


def _with_oldest_evidence(
    active: Mapping[AlarmKey, ActiveCondition], true_keys: Mapping[AlarmKey, int]
) -> list[AlarmKey]:
    """The conditions of oldest evidence whose rule is true; the first ones among equals."""
    oldest: list[AlarmKey] = []
    for key, old in active.items():
        if len(oldest) >= MAX_UPDATED and old.evidence_time != active[oldest[-1]].evidence_time:
            break
        if key in true_keys:
            oldest.append(key)
    if len(oldest) > MAX_UPDATED:
        place = {key: i for i, key in enumerate(true_keys)}
        oldest.sort(key=lambda key: (active[key].evidence_time, place[key]))
    return oldest[:MAX_UPDATED]


def _new_condition(hit: int, values: Evaluation) -> AlertCondition:
    """The condition for a set of objects, in the order of the first binding that is true."""
    rule, ids = values.compiled.decode_hit(hit, values.facts.ids)
    words = with_names(rule.say, rule.variables)
    cause = sentence(values.facts.mind, words, *ids, confidence=confidence(rule, ids, values))
    return AlertCondition(rule.name, ids, rule.severity, cause, evidence(rule, ids, values))


def _with_current_evidence(
    condition: AlertCondition, hit: int, values: Evaluation
) -> AlertCondition:
    """The condition with current evidence; its cause keeps the first wording, as in its alert."""
    rule, ids = values.compiled.decode_hit(hit, values.facts.ids)
    current = evidence(rule, ids, values)
    if current == condition.evidence:
        return condition
    return AlertCondition(
        condition.kind, condition.objects, condition.severity, condition.cause, current
    )


def confidence(rule: Rule, ids: tuple[int, ...], values: Evaluation) -> float:
    """The least confidence of the true relations of these objects in `when`."""
    objects, mind = dict(zip(rule.variables, ids, strict=True)), values.facts.mind
    found = []
    for call in values.compiled.related(rule):
        a, b = (objects[w] for w in call.arguments)
        if mind.truth(call.name, a, b) is Truth.TRUE:
            relation = mind.relation(call.name, a, b)
            found += [relation.confidence] if relation else []
    return min(found, default=1.0)
