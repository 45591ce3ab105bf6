"""Early verdicts about the future: `eventually[60 s] f` is true once f is.

The compiler delays future operators until their window has passed. For each such value this adds a second one
that comes as soon as anything can be known: an interval that contains the final value whatever comes (as in
Deshmukh and others, "Robust online monitoring of signal temporal logic", 2017). It costs the same at every
sample, since each operator reads the newest value of its operand and, for older times, what has been reported
of it by then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf

from visup.rules.formula.nodes import (
    And,
    Formula,
    FutureOperator,
    Let,
    Not,
    Or,
    PastOperator,
    Quantified,
    Rule,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.units import ticks
from visup.rules.monitoring.compiler import Compiler, Scope, ValueRef, inner_scope, scope_of
from visup.rules.monitoring.further_operators import EndedWindow, FollowedWindow


@dataclass(frozen=True, slots=True)
class EarlyValue:
    """An early value and the final one.

    Attributes:
        first: The early value, with the shortest delay after which anything can be decided.
        last: The final value.
        steady: Whether the early value at a sample is valid for all moments up to the next sample, not
            only for its own.
    """

    first: ValueRef
    last: ValueRef
    steady: bool = True

    @property
    def wait(self) -> int:
        """Delay of the final value relative to the early one, microseconds."""
        return self.last.delay - self.first.delay


class EarlyCompiler:
    """Compiles early values into a program.

    Args:
        compiler: The compiler of the program.
    """

    def __init__(self, compiler: Compiler) -> None:
        self._on = compiler

    def rule(self, rule: Rule) -> EarlyValue | None:
        """Early value of `when` and not `unless` while the verdict is pending; None if there is no delay.

        An early decision persists until the final verdict, so that one alert lasts throughout.
        """
        parts = rule.when.parts if isinstance(rule.when, And) else (rule.when,)
        parts = parts if rule.unless is None else (*parts, Not(rule.unless))
        scope = scope_of(rule)
        found = self.formula(And(parts) if len(parts) > 1 else parts[0], scope)
        if not found.wait:
            return None
        at = self._on.windowed("once", 0, found.wait, 0, found.first)
        followed = self._followed(parts, scope)
        if followed is not None:
            at = self._on.combined("most", *self._on.together([at, followed]))
        return replace(found, first=at)

    def _followed(self, parts: tuple[Formula, ...], scope: Scope) -> ValueRef | None:
        """All but one of some parts were true at a moment, which `eventually` has then followed.

        For such rules the early value at each moment is latched, since its parts need not be true any more.
        """
        ahead = [p for p in parts if self._on.formula(p, scope).delay]
        if len(ahead) != 1 or len(parts) == 1:
            return None
        (claim,) = ahead
        if not isinstance(claim, FutureOperator) or claim.kind != "eventually":
            return None
        then = self._on.formula(claim.part, scope)
        if then.delay or claim.window is None:
            return None
        low, high = ticks(claim.window.low.base), ticks(claim.window.high.base)
        others = [self._on.formula(p, scope) for p in parts if p is not claim]
        first, *more = others
        for other in more:
            first = self._on.combined("least", first, other)
        first = self._on.waited(first, low)
        at = self._on.remembered(FollowedWindow(high - low), first, then)
        return replace(at, delay=low)

    def formula(self, node: Formula, scope: Scope = ()) -> EarlyValue:
        """Compile the early value of a formula."""
        last = self._on.formula(node, scope)
        if not last.delay:
            return EarlyValue(last, last)
        found = self._of(node, scope, last)
        # Without an earlier decision the final, exact value is used.
        return found if found.wait else EarlyValue(last, last)

    def _of(self, node: Formula, scope: Scope, last: ValueRef) -> EarlyValue:
        match node:
            case Not(part=part):
                early = self.formula(part, scope)
                return EarlyValue(self._on.combined("not", early.first), last, early.steady)
            case And(parts=parts) | Or(parts=parts):
                kind = "least" if isinstance(node, And) else "most"
                return self._combined_all(kind, [self.formula(p, scope) for p in parts], last)
            case Quantified(part=part):
                early = self.formula(part, inner_scope(node, scope))
                return replace(
                    early, first=self._on.quantified(node, scope, early.first), last=last
                )
            case Let(part=part):
                return self.formula(part, scope)
            case FutureOperator(kind=kind, part=part, window=TimeWindow() as window):
                return self._ahead(kind, ticks(window.low.base), self.formula(part, scope), last)
            case Until(left=left, right=right, window=TimeWindow() as window):
                sides = self.formula(left, scope), self.formula(right, scope)
                return self._until(ticks(window.low.base), *sides, last)
            case PastOperator(kind=kind, part=part, window=None):
                return self._so_far(kind, self.formula(part, scope), last)
            case PastOperator(kind=kind, part=part, window=TimeWindow() as window):
                span = ticks(window.low.base), ticks(window.high.base)
                return self._past(kind, *span, self.formula(part, scope), last)
            case Since(left=left, right=right, window=None):
                return self._since(self.formula(left, scope), self.formula(right, scope), last)
        return self._nothing(last)

    def _nothing(self, last: ValueRef) -> EarlyValue:
        return EarlyValue(self._unknown, last)

    @property
    def _unknown(self) -> ValueRef:
        return self._on.constant(-inf, inf, certain=True)

    def _open(self, kind: str, at: ValueRef) -> ValueRef:
        """The bound that the future cannot change: the lower one of 'most', the upper one of 'least'."""
        return self._on.combined(kind, at, self._unknown)

    def _steadied(self, early: EarlyValue) -> ValueRef:
        """The early value of a part if it is valid up to the next sample, else unknown."""
        return early.first if early.steady else replace(self._unknown, delay=early.first.delay)

    def _combined_all(self, kind: str, parts: list[EarlyValue], last: ValueRef) -> EarlyValue:
        first = max(p.first.delay for p in parts)
        alike = len({(p.first.delay, p.last.delay) for p in parts}) == 1
        # A delayed value is also read between samples.
        known = [p.first if alike else self._steadied(p) for p in parts]
        at, *others = (self._on.waited(p, first - p.delay) for p in known)
        for other in others:
            at = self._on.combined(kind, at, other)
        return EarlyValue(at, last, alike and all(p.steady for p in parts))

    def _ahead(self, kind: str, low: int, part: EarlyValue, last: ValueRef) -> EarlyValue:
        open_ = self._open("most" if kind == "eventually" else "least", self._steadied(part))
        return EarlyValue(replace(open_, delay=open_.delay + low), last, not part.last.delay)

    def _until(self, low: int, left: EarlyValue, right: EarlyValue, last: ValueRef) -> EarlyValue:
        f, g = (self._steadied(p) for p in (left, right))
        if f.delay != g.delay or left.last.delay != right.last.delay:
            return self._nothing(last)
        at = self._on.combined("most", g, self._open("least", f))
        if low:
            at = self._on.combined("least", at, self._on.remembered(EndedWindow(0, low), f))
        return EarlyValue(replace(at, delay=f.delay + low), last, steady=False)

    def _past(self, kind: str, low: int, high: int, part: EarlyValue, last: ValueRef) -> EarlyValue:
        wait, on = part.wait, self._on
        found = []
        if high >= wait:
            found.append(on.windowed(kind, max(low - wait, 0), high - wait, 0, part.last))
        if low < wait:
            found.append(on.windowed(kind, low, min(high, wait), 0, self._steadied(part)))
        at, *others = found
        for other in others:
            at = on.combined("least" if kind == "always" else "most", at, other)
        return EarlyValue(replace(at, delay=part.first.delay), last, steady=False)

    def _so_far(self, kind: str, part: EarlyValue, last: ValueRef) -> EarlyValue:
        on = self._on
        if part.first.delay:
            # Early values also cover moments before the first sample, which do not count.
            return self._nothing(last)
        newer = on.windowed(kind, 0, part.wait, 0, self._steadied(part))
        at = on.combined(
            "least" if kind == "always" else "most", newer, on.unbounded(kind, part.last)
        )
        return EarlyValue(replace(at, delay=part.first.delay), last, steady=False)

    def _since(self, left: EarlyValue, right: EarlyValue, last: ValueRef) -> EarlyValue:
        f, g = (self._steadied(p) for p in (left, right))
        wait, on = left.wait, self._on
        if f.delay or g.delay or right.wait != wait:
            return self._nothing(last)
        older = on.unbounded("since", left.last, right.last)
        lasting = on.combined("least", older, on.windowed("always", 0, wait, 0, f))
        at = on.combined("most", lasting, on.windowed("since", 0, wait, 0, f, g))
        return EarlyValue(replace(at, delay=f.delay), last, steady=False)
