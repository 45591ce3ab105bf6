"""Interval arithmetic of the operators, defined once.

Compiled into the loops of `vm`, and called uncompiled by `monitor`, where plain Python on two floats is
faster than calling compiled code. An interval is a pair (low, high) of floats; `p` and `q` are the constants
of an operation.

"""

from __future__ import annotations

from math import exp, floor, inf, log, nan, sqrt

from visup.compiled import compiled

Pair = tuple[float, float]
MAX_EXPONENT = 709.0
"""Largest exponent of e without overflow."""


@compiled
def shifted(v: Pair, p: float, q: float) -> Pair:
    """The interval plus constants: how far a quantity is above a bound."""
    return v[0] + p + q, v[1] + p + q


@compiled
def mirrored(v: Pair, p: float, q: float) -> Pair:
    """Constants minus the interval: how far a quantity is below a bound; 'not' when both are 0."""
    return -v[1] + p + q, -v[0] + p + q


@compiled
def absolute(v: Pair, p: float, q: float) -> Pair:
    """The absolute value; from 0 if the interval contains 0."""
    return max(max(v[0], -v[1]), 0.0), max(-v[0], v[1])


@compiled
def rooted(v: Pair, p: float, q: float) -> Pair:
    """The square root; unknown below 0."""
    if v[1] < 0.0:
        return -inf, inf
    return sqrt(max(v[0], 0.0)), sqrt(v[1])


@compiled
def exponential(v: Pair, p: float, q: float) -> Pair:
    """The exponential; infinite on overflow."""
    return exp(v[0]) if v[0] < MAX_EXPONENT else inf, exp(v[1]) if v[1] < MAX_EXPONENT else inf


@compiled
def raised(base: float, exponent: float) -> float:
    """The power of two numbers; NaN if undefined, infinite on overflow."""
    if base == 0.0:
        return inf if exponent < 0.0 else 1.0 if exponent == 0.0 else 0.0
    if base < 0.0 and exponent != floor(exponent):
        return nan
    size = log(abs(base)) * exponent if exponent != 0.0 else 0.0
    if size > MAX_EXPONENT:
        value = inf
    elif abs(exponent) < MAX_EXPONENT and abs(base) < inf:
        value = abs(base) ** exponent
    else:
        value = exp(size)
    return -value if base < 0.0 and exponent % 2.0 == 1.0 else value


@compiled
def powered(v: Pair, w: Pair, p: float) -> Pair:
    """The power; unknown if undefined for some number of the intervals."""
    # With one exponent it is monotone on either side of 0; with a positive base in both arguments.
    whole = w[0] == w[1] and w[0] == floor(w[0]) and w[0] >= 0.0
    if not (whole or v[0] > 0.0 or (v[0] == 0.0 and w[0] > 0.0) or (v[0] == v[1] and w[0] == w[1])):
        return -inf, inf
    one, two = raised(v[0], w[0]), raised(v[1], w[1])
    three, four = raised(v[0], w[1]), raised(v[1], w[0])
    low, high = min(min(one, two), min(three, four)), max(max(one, two), max(three, four))
    if v[0] < 0.0 < v[1]:
        low, high = min(low, raised(0.0, w[0])), max(high, raised(0.0, w[0]))
    if low != low or high != high:
        return -inf, inf
    return low, high


@compiled
def added(v: Pair, w: Pair, p: float) -> Pair:
    """The sum; NaN becomes unknown."""
    low, high = v[0] + w[0], v[1] + w[1]
    return -inf if low != low else low, inf if high != high else high


@compiled
def subtracted(v: Pair, w: Pair, p: float) -> Pair:
    """The difference; NaN becomes unknown."""
    low, high = v[0] - w[1], v[1] - w[0]
    return -inf if low != low else low, inf if high != high else high


@compiled
def compared(v: Pair, w: Pair, p: float) -> Pair:
    """Margin of one quantity above another; `p` decides ties."""
    low, high = v[0] - w[1], v[1] - w[0]
    return (-inf if low != low else low) + p, (inf if high != high else high) + p


@compiled
def rate(v: Pair, w: Pair, p: float) -> Pair:
    """The difference times a factor."""
    low, high = v[0] - w[1], v[1] - w[0]
    return (-inf if low != low else low) * p, (inf if high != high else high) * p


@compiled
def product(v: Pair, w: Pair, p: float) -> Pair:
    """The product; 0 times infinity is 0."""
    one = 0.0 if v[0] == 0.0 or w[0] == 0.0 else v[0] * w[0]
    two = 0.0 if v[0] == 0.0 or w[1] == 0.0 else v[0] * w[1]
    three = 0.0 if v[1] == 0.0 or w[0] == 0.0 else v[1] * w[0]
    four = 0.0 if v[1] == 0.0 or w[1] == 0.0 else v[1] * w[1]
    return min(min(one, two), min(three, four)), max(max(one, two), max(three, four))


@compiled
def ratio(p: float, q: float) -> float:
    """The ratio to a nonzero number; 0 if that is infinite."""
    return 0.0 if q == inf or q == -inf else p / q


@compiled
def quotient(v: Pair, w: Pair, p: float) -> Pair:
    """The quotient; unknown if the divisor contains 0."""
    if w[0] <= 0.0 <= w[1]:
        return -inf, inf
    # A single division, not multiplication by an inverse: the last digit decides ties.
    one, two = ratio(v[0], w[0]), ratio(v[0], w[1])
    three, four = ratio(v[1], w[0]), ratio(v[1], w[1])
    return min(min(one, two), min(three, four)), max(max(one, two), max(three, four))


@compiled
def recalled(v: Pair, kept: Pair, at: float, now: float, span: float) -> tuple[Pair, Pair, float]:
    """Sample and hold: the last known interval, while at most `span` old; and the new state with its time.

    Args:
        v: The interval of this sample.
        kept: The last known interval.
        at: Its time, microseconds.
        now: Microseconds.
        span: Microseconds.
    """
    if v[0] > -inf or v[1] < inf:
        return v, v, now
    return (kept if now - at <= span else v), kept, at


@compiled
def latched(enter: Pair, leave: Pair, entered: bool) -> tuple[Pair, bool]:
    """A comparison with hysteresis: the second threshold applies while it is true."""
    v = leave if entered else enter
    return v, v[0] > 0.0 or (entered and v[1] >= 0.0)
