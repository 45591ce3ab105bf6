"""Conditions of decisions: those by which a reasoner decides also explain the decision.

A reasoner yields the conditions of a decision one by one; the first that is not met ends it. To find
out why, let it decide again with a `DecisionLog`: then all conditions are evaluated and recorded.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

Subject = tuple[str, tuple[int, ...]]
"""What is decided, such as 'entry', and of which objects."""


class Condition(NamedTuple):
    """One condition of a decision.

    Attributes:
        text: What it is about.
        met: Whether it is met.
        value: The amount that counts, or None where there is none.
        required: What it is compared with.
        unit: Of both.
        below: Whether the amount must be less than what is required, else at least that.
    """

    text: str
    met: bool
    value: float | None = None
    required: float = 0.0
    unit: str = ""
    below: bool = False

    def line(self) -> str:
        """In words, with the amount and what is missing.

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
    """An amount must reach another one, but for a slack that only makes up for rounding."""
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
        conditions: In order; those after the first that is not met are asked only for the log.
        log: Where they are kept, or None. A decision in several parts is kept as one.
        kind: What is decided.
        objects: Of whom.
    """
    if log is None:
        # A loop, not `all(...)`: many decisions are made in each step, and a generator about the
        # generator would cost as much again.
        for condition in conditions:  # noqa: SIM110
            if not condition.met:
                return False
        return True
    listed = tuple(conditions)
    log[kind, objects] = (*log.get((kind, objects), ()), *listed)
    return all(c.met for c in listed)
