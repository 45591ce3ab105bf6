"""Conditions of decisions: a reasoner decides and explains its decisions by the same conditions.

A reasoner yields the conditions of a decision one by one; the first unmet one ends it. To explain it, the
reasoner decides again with a `DecisionLog`, so that all conditions are evaluated and recorded.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import NamedTuple

from visup.agent import Mind, Observation, Outcome

Subject = tuple[str, tuple[int, ...]]
"""Kind of decision, such as 'entry', and its objects."""


class Condition(NamedTuple):
    """One condition of a decision.

    Attributes:
        text: Its subject.
        met: Whether it is met.
        value: The measured amount, or None without one.
        required: The required amount.
        unit: Unit of both.
        below: Whether the amount must be below the required one, else at least that.
    """

    text: str
    met: bool
    value: float | None = None
    required: float = 0.0
    unit: str = ""
    below: bool = False

    def line(self) -> str:
        """The condition in words, with the amount and what is missing.

        >>> at_least("seen for", 0.2, 0.36, " s").line()
        'seen for 0.2 s of 0.36 s: 0.16 s short'
        >>> less_than("visible share", 0.5, 0.2).line()
        'visible share 0.5, less than 0.2 is needed'
        """
        if self.value is None:
            return f"{self.text}: {'yes' if self.met else 'no'}"
        amount = f"{self.text} {self.value:.3g}{self.unit}"
        required = f"{self.required:.3g}{self.unit}"
        if self.below:
            return f"{amount}, less than {required} {'was' if self.met else 'is'} needed"
        missing = f"{self.required - self.value:.3g}{self.unit} short"
        return f"{amount} of {required}: {'enough' if self.met else missing}"


def at_least(
    text: str, value: float, required: float, unit: str = "", slack: float = 0.0
) -> Condition:
    """An amount must reach another one, up to a slack for rounding."""
    return Condition(text, value >= required - slack, value, required, unit)


def more_than(text: str, value: float, required: float, unit: str = "") -> Condition:
    """An amount must exceed another one."""
    return Condition(text, value > required, value, required, unit)


def less_than(text: str, value: float, required: float, unit: str = "") -> Condition:
    """An amount must stay below another one."""
    return Condition(text, value < required, value, required, unit, below=True)


class DecisionLog(dict[Subject, tuple[Condition, ...]]):
    """All conditions of the decisions in one step, in order of evaluation."""


def decide(
    conditions: Iterable[Condition], log: DecisionLog | None, kind: str, objects: tuple[int, ...]
) -> bool:
    """Whether all conditions are met.

    Args:
        conditions: In order; those after the first unmet one are evaluated only for the log.
        log: Records them, or None. A decision in several parts is recorded as one.
        kind: Kind of decision.
        objects: Ids of its objects.
    """
    if log is None:
        # A loop, not `all(...)`: there are many decisions in each step, and wrapping the generator in
        # another one would double the cost.
        for condition in conditions:  # noqa: SIM110
            if not condition.met:
                return False
        return True
    listed = tuple(conditions)
    log[kind, objects] = (*log.get((kind, objects), ()), *listed)
    return all(c.met for c in listed)


class ExplainableReasoner(ABC):
    """A reasoner whose explanations run the same code as its decisions."""

    __slots__ = ()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        return self._reason(mind, observation, None)

    def explain(self, mind: Mind, observation: Observation) -> DecisionLog:
        """The conditions of all decisions of a step.

        Args:
            mind: The mind as passed to this reasoner in that step.
            observation: The observation of that step.
        """
        log = DecisionLog()
        after = self._reason(mind, observation, log).mind
        for decision, conditions in self._preconditions(mind, after, observation):
            log.setdefault(decision, conditions)
        return log

    @abstractmethod
    def _reason(self, mind: Mind, observation: Observation, log: DecisionLog | None) -> Outcome:
        """Reason about one step, and record the conditions of all decisions if there is a log."""

    def _preconditions(
        self, mind: Mind, after: Mind, observation: Observation
    ) -> Iterable[tuple[Subject, tuple[Condition, ...]]]:
        """Conditions of decisions that `_reason` may not even consider; none by default."""
        return ()
