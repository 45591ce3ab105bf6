"""Activation: behaviours that run only when the scene requires them, coarse to fine.

A behaviour's contract states when it is active, as a condition of the rule language about one object `a`:
"expected(a)" for one that a task stage currently refers to, "exists b: gap(a, b) < 60 px" for one near
another. A coarse behaviour that always runs hands over, by such a condition, to a finer one for that object,
and takes over again when the condition ends or the finer one fails (`relieves`). Behaviours whose output
safety rules read are always active.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import AlertCondition, Contract, Directive, Mind, Observation, Outcome, Severity
from visup.agent.model.errors import BehaviourError, VisupError
from visup.agent.model.events import WAKE
from visup.agent.model.memory import MemoryKey
from visup.rules.formula.nodes import Rule, calls
from visup.rules.language.parser import parse_rules
from visup.rules.predicates.inputs_missing import percepts_read
from visup.rules.safety.reasoner import RuleMemory, RuleReasoner

ACTIVATION = MemoryKey("rules.waking", RuleMemory())
_PREFIX = "awake_"


def activation_rules(contracts: Sequence[Contract]) -> tuple[Rule, ...]:
    """A rule for the activation of each conditional behaviour.

    Raises:
        BehaviourError: A condition is invalid.
    """
    return tuple(_rule(c) for c in contracts if c.awake)


def _rule(contract: Contract) -> Rule:
    name = f"{_PREFIX}{contract.name}"
    say = f"The behaviour '{contract.name}' is called for {{a}}."
    try:
        text = f'rule {name}(a): info\nwhen {contract.awake}\nsay "{say}"\n'
        (rule,) = parse_rules(text, "awake")
    except (VisupError, ValueError) as fault:
        raise BehaviourError(
            f"`awake` is not a condition about an object `a`: {fault}",
            where=f"contract of '{contract.name}'",
            expected='a condition of the rule language, such as "expected(a)"',
            hint="see docs/rules.md; a choice of others is `exists b: ...`",
        ) from fault
    return rule


def always_active(contracts: Sequence[Contract], rules: Sequence[Rule]) -> frozenset[str]:
    """Names of behaviours that must stay active, since only they serve safety rules.

    Args:
        contracts: Contracts of all behaviours.
        rules: Monitored rules; those above severity 'info' count.
    """
    read = {
        kind
        for rule in rules
        if rule.severity > Severity.INFO
        for formula in rule.formulas
        for call in calls(formula)
        for kind in percepts_read(call.name)
    }
    always = {kind for c in contracts if not c.awake for kind in c.gives}
    return frozenset(c.name for c in contracts if c.awake and set(c.gives) & (read - always))


@dataclass(frozen=True, slots=True)
class ActivationReasoner:
    """Reasoner of the attend phase: activates conditional behaviours.

    Attributes:
        rules: From `activation_rules`.
    """

    rules: tuple[Rule, ...]
    _reasoner: RuleReasoner = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_reasoner", RuleReasoner(self.rules, ACTIVATION))

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        outcome = self._reasoner(mind, observation)
        return Outcome(outcome.mind, directives=tuple(_directives(mind, outcome.conditions)))


def _directives(mind: Mind, conditions: Sequence[AlertCondition]) -> Iterator[Directive]:
    for condition in conditions:
        (number,) = condition.objects
        region = mind.objects[number].region.id
        name = condition.kind.removeprefix(_PREFIX)
        data = {"behaviour": name, "object": number, "region": region}
        yield Directive(WAKE, condition.cause, MappingProxyType(data))
