"""Static cost of a rule, computed when it is loaded: memory and delay of its verdict."""

from __future__ import annotations

from dataclasses import dataclass

from visup.rules.formula.nodes import Node, Quantified, Rule, children
from visup.rules.formula.units import TICKS
from visup.rules.monitoring.compiler import Compiler
from visup.rules.monitoring.early import EarlyCompiler

MAX_STATE = 100_000
"""Most intervals that a rule may retain per binding of objects: 8 minutes of a quantity."""
MAX_VARIABLES = 3
"""Most objects that a rule may relate; 64 objects have 250,000 combinations of three."""
INTERVAL_BYTES = 16


@dataclass(frozen=True, slots=True)
class RuleCost:
    """The cost of a rule.

    Attributes:
        kept: Most intervals retained per binding of objects.
        delay_s: Delay of its verdict, seconds.
        early_delay_s: Least delay of an early verdict, seconds.
    """

    kept: int
    delay_s: float
    early_delay_s: float

    @property
    def bytes(self) -> int:
        """Most bytes per binding of objects."""
        return self.kept * INTERVAL_BYTES


def cost_of(rule: Rule) -> RuleCost:
    """The cost of a rule whose windows are all bounded.

    Args:
        rule: A rule without semantic errors.

    Returns:
        Upper bounds, whatever the input.
    """
    compiler = Compiler()
    latest = compiler.rule(rule)[0].delay
    kept = sum(operator.kept for operator in compiler.program.operators())
    early = EarlyCompiler(compiler).rule(rule)
    return RuleCost(kept, latest / TICKS, (early.first.delay if early else latest) / TICKS)


def variables_of(rule: Rule) -> int:
    """Number of objects that a rule relates."""
    return len(rule.variables) + max(depth(f) for f in rule.formulas)


def depth(node: Node) -> int:
    """Nesting depth of a formula's quantifiers."""
    inner = max((depth(c) for c in children(node)), default=0)
    return inner + isinstance(node, Quantified)
