"""Dimensional analysis: comparisons and sums need equal dimensions; products and quotients combine them."""

from __future__ import annotations

from collections.abc import Iterator

from visup.rules.formula.nodes import Comparison, MOfN, TimeWindow
from visup.rules.formula.terms import (
    Arithmetic,
    Measure,
    Negative,
    PointwiseFunction,
    Term,
    Variable,
    WindowFunction,
)
from visup.rules.formula.units import (
    LENGTH,
    REAL_LENGTH,
    REAL_SPEED,
    SHARE,
    SPEED,
    TIME,
    UNITS,
    Dimension,
    Number,
    Span,
    Unit,
    number_text,
    units_of,
)
from visup.rules.language.transform import Fault
from visup.rules.predicates.definitions import Vocabulary


def check_dimensions(node: Comparison, vocabulary: Vocabulary) -> Iterator[Fault]:
    """Unit errors of a comparison.

    Args:
        node: The comparison.
        vocabulary: Dimensions of quantities; unknown ones are ignored.

    Yields:
        Location, what is wrong, what was expected, hint.
    """
    faults: list[Fault] = []
    left, right = (_measured(side, vocabulary, faults) for side in (node.left, node.right))
    yield from faults
    if left and right and left != right:
        what = f"{_named(left)} is compared with {_named(right)}"
        wanted = right if _constant(node.left) else left
        yield node.span, what, units_of(wanted), _told(_with_unit(node, wanted), {left, right})
    elif left == right == SHARE:
        yield from _share(node, vocabulary)
    if node.leave is not None:
        yield from _leave(node, left)


def _told(hint: str | None, compared: set[Dimension]) -> str | None:
    """A hint that says so where a number of the scene cannot become one of the image."""
    real = {REAL_LENGTH, REAL_SPEED} & compared
    if hint is None or not real or not {LENGTH, SPEED} & compared:
        return hint
    return f"metres cannot be told in pixels without a floor, so choose the number anew; {hint}"


def _share(node: Comparison, vocabulary: Vocabulary) -> Iterator[Fault]:
    """An error for a share above 1 without a unit, and for a plain number in per cent.

    `depth_difference(a, b) < 15` would mean 1,500 %, and `signal(battery) > 90 %` would mean 0.9.
    """
    sides = (node.left, node.right), (node.right, node.left)
    for measure, number in sides:
        if not isinstance(measure, Measure) or not isinstance(number, Number):
            continue
        plain = vocabulary.quantities[measure.name].plain
        if plain == (number.unit == Unit.PERCENT) and (plain or number.base > 1):
            said = number_text(number.value)
            meant = said if plain else f"{said} %"
            what = f"`{number}` without a unit is {number_text(100 * number.base)} %"
            what = (
                f"`{measure}` is a plain number, and `{number}` is {number.base:g}"
                if plain
                else what
            )
            change = str(node).replace(str(number), meant)
            yield (
                node.span,
                what,
                "a plain number" if plain else "a share in %",
                f"write `{change}`",
            )


def example_amount(node: Comparison, vocabulary: Vocabulary) -> str:
    """An example of the compared quantity, such as '20 px'."""
    kinds = (_measured(side, vocabulary, []) for side in (node.left, node.right))
    kind = next((k for k in kinds if k is not None), SHARE)
    return f"20 {_base_unit(kind) or ''}".rstrip()


def check_value(term: Term, vocabulary: Vocabulary) -> Iterator[Fault]:
    """Unit errors of a quantity outside comparisons."""
    faults: list[Fault] = []
    _measured(term, vocabulary, faults)
    yield from faults


def check_constant(node: Comparison) -> Iterator[Fault]:
    """An error for a comparison of constants, which is legal in arithmetic but a mistake in a rule."""
    if _constant(node.left) and _constant(node.right):
        yield node.span, "two numbers are compared", "a quantity on one side", None


def _leave(node: Comparison, dimension: Dimension | None) -> Iterator[Fault]:
    leave = node.leave
    assert leave is not None
    if node.operator in ("==", "!="):
        yield leave.span, f"'leave' makes no sense after '{node.operator}'", "<, <=, > or >=", None
    elif dimension and leave.dimension != dimension:
        meant = f"{number_text(leave.value)} {_base_unit(dimension) or ''}".rstrip()
        yield leave.span, f"'leave' wants {units_of(dimension)}", None, f"write `{meant}`"
    elif not isinstance(node.right, Number):
        what = "'leave' needs a number before it too"
        yield leave.span, what, "such as speed(a) > 5 px/s leave 3 px/s", None
    elif (leave.base - node.right.base) * (1 if ">" in node.operator else -1) > 0:
        what = f"'leave {leave}' ends it where it does not yet begin"
        side = "at most" if ">" in node.operator else "at least"
        given, swapped = f"{node.right} leave {leave}", f"{leave} leave {node.right}"
        yield leave.span, what, f"{side} {node.right}", f"write `{swapped}` in place of `{given}`"


def _measured(term: Term, vocabulary: Vocabulary, faults: list[Fault]) -> Dimension | None:
    """The dimension of a quantity; None when unknown."""
    match term:
        case Number():
            return term.dimension
        case Measure(name=name):
            known = vocabulary.quantities.get(name)
            return None if known is None else known.dimension
        case Negative(part=part):
            return _measured(part, vocabulary, faults)
        case Variable(part=part):
            # Its errors are reported where it is bound.
            return None if part is None else _measured(part, vocabulary, [])
        case WindowFunction(name=name, part=part):
            inner = _measured(part, vocabulary, faults)
            return inner / TIME if inner and name == "rate" else inner
        case Arithmetic(left=one, operator="*" | "/" as operator, right=other):
            first, second = (_measured(t, vocabulary, faults) for t in (one, other))
            if first is None or second is None:
                return None
            return first * second if operator == "*" else first / second
        case Arithmetic(left=one, operator=operator, right=other):
            word = "added to" if operator == "+" else "subtracted from"
            return _alike((one, other), word, term.span, vocabulary, faults)
        case PointwiseFunction(name="sqrt" | "exp" | "power" as name, parts=parts):
            return _powered(name, parts, term.span, vocabulary, faults)
        case PointwiseFunction(name=name, parts=parts):
            if not parts or (name == "abs") != (len(parts) == 1):
                wanted = "abs(gap(a, b))" if name == "abs" else f"{name}(gap(a, b), 20 px)"
                what = f"'{name}' does not take {len(parts)} quantities"
                faults.append((term.span, what, f"such as {wanted}", None))
            return _alike(parts, "set beside", term.span, vocabulary, faults)


_EXAMPLES = {
    "sqrt": "sqrt(gap(a, b))",
    "exp": "exp(speed(a) / 20 px/s)",
    "power": "power(gap(a, b), 2)",
}


def _powered(
    name: str, parts: tuple[Term, ...], span: Span, vocabulary: Vocabulary, faults: list[Fault]
) -> Dimension | None:
    """The dimension of a root, a power or an exponential."""
    if len(parts) != (2 if name == "power" else 1):
        what = f"'{name}' does not take {len(parts)} quantities"
        faults.append((span, what, f"such as {_EXAMPLES[name]}", None))
        return None
    kinds = [_measured(p, vocabulary, faults) for p in parts]
    if None in kinds:
        return None
    base, plain = kinds[0], kinds[-1]
    assert base is not None
    assert plain is not None
    if name == "sqrt":
        if any(power % 2 for power in base.powers):
            what = f"{_named(base)} has no square root that could be measured"
            hint = f"write `{parts[0]}`"
            faults.append((span, what, "a share, or the square of something", hint))
            return None
        return Dimension(*(power // 2 for power in base.powers))
    exponent = parts[-1]
    if plain != SHARE:
        what = f"an exponent is {_named(plain)}"
        faults.append((span, what, "a number without a unit", "divide it by an amount of its unit"))
        return None
    if name == "exp" or base == SHARE:
        return SHARE
    if isinstance(exponent, Number) and exponent.base == int(exponent.base):
        return Dimension(*(power * int(exponent.base) for power in base.powers))
    what = f"{_named(base)} is raised to a power that is no whole number"
    faults.append(
        (span, what, f"such as {_EXAMPLES['power']}", "divide it by an amount of its unit")
    )
    return None


def _alike(
    parts: tuple[Term, ...], word: str, span: Span, vocabulary: Vocabulary, faults: list[Fault]
) -> Dimension | None:
    kinds = [k for p in parts if (k := _measured(p, vocabulary, faults)) is not None]
    for kind in kinds[1:]:
        if kind != kinds[0]:
            pair = (kinds[0], kind) if word != "subtracted from" else (kind, kinds[0])
            what = f"{_named(pair[0])} is {word} {_named(pair[1])}"
            faults.append((span, what, units_of(kinds[0]), f"write `{parts[0]}`"))
            return None
    return kinds[0] if kinds else None


def _constant(term: Term) -> bool:
    if isinstance(term, Arithmetic):
        return _constant(term.left) and _constant(term.right)
    return isinstance(term, Number)


def _named(dimension: Dimension) -> str:
    article = "an" if str(dimension)[0] in "aeiou" else "a"
    return f"{article} {'number' if dimension == SHARE else dimension}"


def _base_unit(wanted: Dimension) -> str | None:
    """The base unit of a dimension, or None."""
    return next((str(u) for u, (d, by) in UNITS.items() if d == wanted and by == 1.0), None)


def _with_unit(node: Comparison, wanted: Dimension) -> str | None:
    """The comparison with a fitting unit, and with a number if there is none."""
    unit = _base_unit(wanted)
    if unit is None:
        return None
    sides = [
        f"{number_text(s.value)} {unit}".rstrip() if isinstance(s, Number) else str(s)
        for s in (node.left, node.right)
    ]
    if sides == [str(node.left), str(node.right)]:
        return f"write `{sides[0]} {node.operator} 20 {unit}`".replace("20 `", "20`")
    return f"write `{sides[0]} {node.operator} {sides[1]}`"


def check_time(number: Number | None, word: str) -> Iterator[Fault]:
    """Errors of a time behind a word; none if there is no time."""
    if number is None:
        return
    if number.dimension != TIME:
        unit = Unit.MIN if number.unit == Unit.M else Unit.S
        hint = f"write `{Number(abs(number.value) or 2.0, unit)}`"
        yield number.span, f"'{word}' needs a time", "such as 2 s", hint
    elif number.value <= 0:
        hint = f"write `{Number(abs(number.value) or 2.0, number.unit)}`"
        yield number.span, f"'{word}' needs a time above 0", "such as 2 s", hint


def check_window(window: TimeWindow, word: str) -> Iterator[Fault]:
    """Errors of a window."""
    yield from check_time(window.high, word)
    if window.low.dimension != TIME:
        yield window.low.span, f"'{word}' needs a time", "such as 2 s", None
    elif window.high.dimension == TIME and 0 < window.high.base < window.low.base:
        what = f"a window from {window.low} to {window.high} is empty"
        joint = " to " if word in ("for", "within") else " .. "
        hint = f"write `{window.high}{joint}{window.low}`"
        whole = window.low.span.to(window.high.span)
        yield whole, what, "the shorter time first", hint


def check_often(node: MOfN) -> Iterator[Fault]:
    """Errors of a share or a count of samples."""
    least, of = node.least, node.of
    if node.counts_samples:
        if not (least.unit is Unit.NONE and 1 <= least.value <= of.value):
            what = f"'{least} of {of} samples' cannot be counted"
            yield least.span, what, "3 of 5 samples", f"write `{of}`"
        elif least.value % 1 or of.value % 1:
            yield least.span, "samples are counted in whole numbers", "3 of 5 samples", None
        return
    yield from check_time(of, "of")
    if least.dimension != SHARE or not 0 < least.base <= 1:
        yield least.span, f"'{least}' is not a share of a time", "such as 60 %", "write `60 %`"
