"""AST nodes of rule files: frozen, and printed back as source."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from visup.agent import Severity
from visup.rules.formula.terms import (
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Term,
    WindowFunction,
)
from visup.rules.formula.units import NOWHERE, Number, Span, Unit

SIGNAL_WORDS = frozenset({"signal", "signal_on", "signal_is", "signal_known"})
"""Words about signals, which belong to no object: their arguments are neither variables nor actors."""

ZERO = Number(0.0, Unit.S)


@dataclass(frozen=True, slots=True)
class TimeWindow:
    """`[2 s .. 5 s]`: a time interval, counted from now into the past or the future."""

    low: Number
    high: Number

    def __str__(self) -> str:
        return f"[{self.high}]" if self.low == ZERO else f"[{self.low} .. {self.high}]"


@dataclass(frozen=True, slots=True)
class Predicate:
    """`converging(a, b)`: a relation or a fact."""

    name: str
    arguments: tuple[str, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.name}({', '.join(self.arguments)})"


@dataclass(frozen=True, slots=True)
class Literal:
    """`true` or `false`."""

    value: bool
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return "true" if self.value else "false"


@dataclass(frozen=True, slots=True)
class Comparison:
    """`gap(a, b) < 20 px`; with `leave 25 px` it ends only there once true (hysteresis)."""

    left: Term
    operator: str
    right: Term
    leave: Number | None = None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        leave = "" if self.leave is None else f" leave {self.leave}"
        return f"{self.left} {self.operator} {self.right}{leave}"


@dataclass(frozen=True, slots=True)
class Not:
    """`not f`."""

    part: Formula
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"not {_wrapped(self.part, *_LOOSER)}"


@dataclass(frozen=True, slots=True)
class And:
    """`f and g`."""

    parts: tuple[Formula, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " and ".join(_wrapped(p, And, Or) for p in self.parts)


@dataclass(frozen=True, slots=True)
class Or:
    """`f or g`."""

    parts: tuple[Formula, ...]
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return " or ".join(_wrapped(p, Or) for p in self.parts)


@dataclass(frozen=True, slots=True)
class PastOperator:
    """`always f`, `once f`: over the whole past; `f for 2 s`, `f within 2 s`: in a window ending now.

    Attributes:
        kind: 'always' or 'once'.
        part: The operand.
        window: The window, or None for the whole past.
    """

    kind: str
    part: Formula
    window: TimeWindow | None = None

    def __str__(self) -> str:
        if self.window is None:
            return f"{self.kind} {_wrapped(self.part, *_LOOSER)}"
        word = "for" if self.kind == "always" else "within"
        low, high = self.window.low, self.window.high
        span = f"{high}" if low == ZERO else f"{low} to {high} ago"
        return f"{_wrapped(self.part, *_LOOSER, *_PREFIXED)} {word} {span}"


@dataclass(frozen=True, slots=True)
class FutureOperator:
    """`eventually[5 s] f`, `henceforth[5 s] f`: in a window starting now; reported when it is over."""

    kind: str
    part: Formula
    window: TimeWindow | None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"{self.kind}{self.window or ''} {_wrapped(self.part, *_LOOSER)}"


@dataclass(frozen=True, slots=True)
class Previous:
    """`previous f`: f held at the previous sample."""

    part: Formula
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return f"previous {_wrapped(self.part, *_LOOSER)}"


@dataclass(frozen=True, slots=True)
class Since:
    """`f since g`: g held, and f has held ever since; with a window, g held within the window."""

    left: Formula
    right: Formula
    window: TimeWindow | None = None

    def __str__(self) -> str:
        left, right = (_wrapped(p, *_LOOSER) for p in (self.left, self.right))
        return f"{left} since{self.window or ''} {right}"


@dataclass(frozen=True, slots=True)
class Until:
    """`f until[5 s] g`: g will hold within 5 s, and f holds up to then; reported 5 s late."""

    left: Formula
    right: Formula
    window: TimeWindow | None
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        left, right = (_wrapped(p, *_LOOSER) for p in (self.left, self.right))
        return f"{left} until{self.window or ''} {right}"


@dataclass(frozen=True, slots=True)
class MOfN:
    """`f in 60 % of 2 s`: for at least that share of the time; `f in 3 of 5 samples`: at as many samples."""

    part: Formula
    least: Number
    of: Number
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    @property
    def counts_samples(self) -> bool:
        """Whether samples are counted instead of time."""
        return self.of.unit is Unit.NONE

    def __str__(self) -> str:
        samples = " samples" if self.counts_samples else ""
        part = _wrapped(self.part, *_LOOSER, *_PREFIXED)
        return f"{part} in {self.least} of {self.of}{samples}"


@dataclass(frozen=True, slots=True)
class Last:
    """`last(f, 0.5 s)`: the last known value, while it is at most this old."""

    part: Formula
    duration: Number

    def __str__(self) -> str:
        return f"last({self.part}, {self.duration})"


@dataclass(frozen=True, slots=True)
class Quantified:
    """`exists b: f`, `forall b: f`: for some, for all other objects.

    Attributes:
        kind: 'exists' or 'forall'.
        variable: Name of the objects in `part`.
        part: The operand.
        may_repeat: Whether objects bound to other variables count too.
    """

    kind: str
    variable: str
    part: Formula
    may_repeat: bool = False
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        repeat = " may repeat" if self.may_repeat else ""
        return f"{self.kind} {self.variable}{repeat}: {_wrapped(self.part, *_LOOSER)}"


@dataclass(frozen=True, slots=True)
class Let:
    """`let x be gap(a, b) at touching(a, b): f`: f, where x is the gap when they last touched.

    Attributes:
        variable: The name.
        value: The quantity; undefined until `at` has been true.
        at: When it is sampled.
        part: The formula, with the variable as a `Variable` holding both.
    """

    variable: str
    value: Term
    at: Formula
    part: Formula
    span: Span = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        part = _wrapped(self.part, *_LOOSER)
        return f"let {self.variable} be {self.value} at {self.at}: {part}"


Formula = (
    Predicate
    | Literal
    | Comparison
    | Not
    | And
    | Or
    | PastOperator
    | FutureOperator
    | Previous
    | Since
    | Until
    | MOfN
    | Last
    | Quantified
    | Let
)
Node = Formula | Term


@dataclass(frozen=True, slots=True)
class Rule:
    """One rule.

    Attributes:
        name: Name of the rule, and kind of its alarms.
        variables: Names of its objects; distinct objects, except those of `may_repeat`.
        severity: Severity of its alarms.
        when: The condition.
        say: The sentence, with `{a}` for objects and `{is}` for the verb.
        unless: The exception, or None.
        hold: How long an alarm stays after the rule was last true, or None.
        cooldown: How long after an alarm the same objects raise no new one, or None.
        may_repeat: Variables that may be bound to the same object as another.
        file: File it was read from, for messages.
    """

    name: str
    variables: tuple[str, ...]
    severity: Severity
    when: Formula
    say: str
    unless: Formula | None = None
    hold: Number | None = None
    cooldown: Number | None = None
    may_repeat: tuple[str, ...] = ()
    span: Span = field(default=NOWHERE, compare=False, repr=False)
    file: str = field(default="", compare=False, repr=False)

    def __str__(self) -> str:
        names = (f"{v} may repeat" if v in self.may_repeat else v for v in self.variables)
        lines = [f"rule {self.name}({', '.join(names)}): {self.severity.name.lower()}"]
        lines.append(f"    when {self.when}")
        for word in ("unless", "hold", "cooldown"):
            clause = getattr(self, word)
            if clause is not None:
                lines.append(f"    {word} {clause}")
        lines.append(f'    say "{self.say}"')
        return "\n".join(lines)

    @property
    def formulas(self) -> tuple[Formula, ...]:
        """`when`, and `unless` if present."""
        return (self.when,) if self.unless is None else (self.when, self.unless)


def children(node: Node) -> tuple[Node, ...]:
    """The direct children of a node, without the numbers of windows and durations."""
    match node:
        case And(parts=parts) | Or(parts=parts) | PointwiseFunction(parts=parts):
            return parts
        case Not(part=part) | PastOperator(part=part) | FutureOperator(part=part) | MOfN(part=part):
            return (part,)
        case (
            Last(part=part)
            | Previous(part=part)
            | Quantified(part=part)
            | Negative(part=part)
            | WindowFunction(part=part)
        ):
            return (part,)
        case Since(left=left, right=right) | Until(left=left, right=right):
            return (left, right)
        case Comparison(left=left, right=right) | Arithmetic(left=left, right=right):
            return (left, right)
        case Let(value=value, at=at, part=part):
            return (value, at, part)
    return ()


def walk(node: Node | None) -> Iterator[Node]:
    """A node and all its descendants, in source order."""
    if node is not None:
        yield node
        for part in children(node):
            yield from walk(part)


def calls(node: Node | None) -> tuple[Predicate | Measure, ...]:
    """All relations, facts and quantities named in a formula, in source order."""
    return tuple(n for n in walk(node) if isinstance(n, Predicate | Measure))


def placeholder(variable: str) -> str:
    """The placeholder of a variable in a text until its object is known."""
    return f"\0{variable}\0"


_LOOSER = (And, Or, Since, Until)
_PREFIXED = (Not, Quantified, Let, FutureOperator, PastOperator, Previous)


def _wrapped(formula: Formula, *loose: type) -> str:
    """Its source, parenthesised if it binds more loosely; nested `for` also for readability."""
    return f"({formula})" if isinstance(formula, loose) else str(formula)
