"""What a rule costs, computed when it is loaded: how much it keeps, how late its verdict comes."""

from __future__ import annotations

from dataclasses import dataclass

from visup.rules.formula.nodes import Node, Quantified, Rule, children
from visup.rules.formula.units import TICKS
from visup.rules.monitoring.compiler import Compiler
from visup.rules.monitoring.early import EarlyCompiler

MAX_STATE = 100_000
"""Most intervals that a rule may keep for one choice of objects: 8 minutes of a quantity."""
MAX_VARIABLES = 3
"""Most objects that a rule may look at together; of 64 there are 250,000 choices of three."""
INTERVAL_BYTES = 16


@dataclass(frozen=True, slots=True)
class RuleCost:
    """What a rule costs.

    Attributes:
        kept: Most intervals that it keeps for one choice of objects.
        delay_s: How many seconds late its verdict comes.
        early_delay_s: How many seconds late at least where it is told as soon as it is decided.
    """

    kept: int
    delay_s: float
    early_delay_s: float

    @property
    def bytes(self) -> int:
        """Most bytes for one choice of objects."""
        return self.kept * INTERVAL_BYTES


def cost_of(rule: Rule) -> RuleCost:
    """The bounds of a rule whose windows are all bounded.

    Args:
        rule: A rule without faults of meaning.

    Returns:
        What it costs at most, whatever it sees.
    """
    compiler = Compiler()
    latest = compiler.rule(rule)[0].delay
    kept = sum(operator.kept for operator in compiler.program.operators())
    early = EarlyCompiler(compiler).rule(rule)
    return RuleCost(kept, latest / TICKS, (early.first.delay if early else latest) / TICKS)


def variables_of(rule: Rule) -> int:
    """How many objects a rule looks at together."""
    return len(rule.variables) + max(depth(f) for f in rule.formulas)


def depth(node: Node) -> int:
    """How many quantifiers of a formula stand one within another."""
    inner = max((depth(c) for c in children(node)), default=0)
    return inner + isinstance(node, Quantified)
