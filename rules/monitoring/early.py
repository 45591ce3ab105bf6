"""What is decided about the future before it has come: `eventually[60 s] f` is true once f is.

The compiler waits until all of a window has passed. Beside each such value stands a second one here, which
comes as soon as anything can be known, and holds what will be told later (as the intervals of
Deshmukh and others do, "Robust online monitoring of signal temporal logic", 2017): its bounds are those
of the later value whatever comes. It costs the same at every sample, since each operator reads the newest
value of its part and, for what is older, what has been told of it by then.
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
from visup.rules.monitoring.beside_windows import EndedWindow, FollowedWindow
from visup.rules.monitoring.compiler import Compiler, Scope, ValueRef, inner_scope, scope_of


@dataclass(frozen=True, slots=True)
class EarlyValue:
    """An early value, as soon as it is decided, and the final one.

    Attributes:
        first: Its delay is the shortest after which anything can be decided.
        last: Its delay is that after which all is.
        steady: Whether what is told first at a sample is right of all moments up to the next one, and
            not only of its own.
    """

    first: ValueRef
    last: ValueRef
    steady: bool = True

    @property
    def wait(self) -> int:
        """How much later the last value comes, microseconds."""
        return self.last.delay - self.first.delay


class EarlyCompiler:
    """Puts what is decided early into a program.

    Args:
        compiler: What puts formulas into it.
    """

    def __init__(self, compiler: Compiler) -> None:
        self._on = compiler

    def rule(self, rule: Rule) -> EarlyValue | None:
        """That `when` is true and `unless` is not, while a verdict may still come; None where none is late.

        What was decided early stays so until it is told in the end, so that one alert stands throughout.
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
        """That all but one of some parts were true at a moment, which `eventually` has then followed.

        What is true now was not yet when they were; so of such rules each moment is told early.
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
        """What is known early of a formula, after its steps have been put into the program."""
        last = self._on.formula(node, scope)
        if not last.delay:
            return EarlyValue(last, last)
        found = self._of(node, scope, last)
        # What can be decided no sooner than all of it is told in the end, exactly.
        return found if found.wait else EarlyValue(last, last)

    def _of(self, node: Formula, scope: Scope, last: ValueRef) -> EarlyValue:
        match node:
            case Not(part=part):
                early = self.formula(part, scope)
                return EarlyValue(self._on.combined("not", early.first), last, early.steady)
            case And(parts=parts) | Or(parts=parts):
                kind = "least" if isinstance(node, And) else "most"
                return self._joined(kind, [self.formula(p, scope) for p in parts], last)
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
        """The bound that what still comes cannot change: of 'most' the lower one, of 'least' the upper."""
        return self._on.combined(kind, at, self._unknown)

    def _steadied(self, early: EarlyValue) -> ValueRef:
        """What is known first of a part, where it is right of all moments up to the next sample."""
        return early.first if early.steady else replace(self._unknown, delay=early.first.delay)

    def _joined(self, kind: str, parts: list[EarlyValue], last: ValueRef) -> EarlyValue:
        first = max(p.first.delay for p in parts)
        alike = len({(p.first.delay, p.last.delay) for p in parts}) == 1
        # What is made to wait is told of moments between samples, too.
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
            # What is told first speaks of moments before the first sample, too, which do not count.
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
