"""Breakpoints and watches: expressions of the rule language that are evaluated after each step."""

from __future__ import annotations

from dataclasses import dataclass, field

from visup.agent.model.mind import Mind
from visup.agent.model.step import Step
from visup.rules.safety.expression import ExpressionResult, ExpressionValue, expression
from visup.stepping.breakpoints import ExpressionMonitor, StopCondition, WhenStop


@dataclass(slots=True)
class Breakpoint:
    """A condition that stops stepping.

    Attributes:
        id: Number, from 1.
        stop: The condition.
        enabled: Whether it is evaluated.
        hits: How often it has stopped.
    """

    id: int
    stop: StopCondition
    enabled: bool = True
    hits: int = 0

    def __str__(self) -> str:
        off = "" if self.enabled else ", disabled"
        return f"{self.id}  {self.stop.text}  ({self.hits} hits{off})"


@dataclass(slots=True)
class WatchExpression:
    """An expression that is evaluated after each step.

    Attributes:
        id: Number, from 1.
        stop: The expression; also the condition that it changes.
        breaks: Whether a change stops stepping.
        result: Result after the latest step, or None.
    """

    id: int
    stop: WhenStop
    breaks: bool = False
    result: ExpressionResult | None = None
    _monitor: ExpressionMonitor = field(default_factory=ExpressionMonitor, repr=False)

    @classmethod
    def of(cls, number: int, text: str, breaks: bool) -> WatchExpression:
        """A watch on an expression.

        Raises:
            RuleError: It is not valid.
        """
        return cls(number, WhenStop(expression(text), True), breaks)

    @property
    def text(self) -> str:
        """The expression."""
        return self.stop.expression.text

    @property
    def readings(self) -> tuple[ExpressionValue, ...]:
        """Its values, one per assignment of objects; symmetric ones once."""
        found: dict[tuple[tuple[int, ...], str], ExpressionValue] = {}
        for reading in self.result.readings if self.result else ():
            found.setdefault((tuple(sorted(reading.objects)), str(reading)), reading)
        return tuple(found.values())

    def evaluate(self, before: Mind, after: Mind) -> None:
        """Evaluate it after a step."""
        _, self.result = self._monitor(self.stop.expression, before, after)

    def changed(self, before: Mind, step: Step) -> str:
        """How its value has changed, or an empty text; call it after each step."""
        return self.stop.met(before, step) if self.breaks else ""
