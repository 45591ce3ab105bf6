"""Compiled loops: relations of two bodies from the states and quantities of one step."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.rules.relations.rows import PairQuantity, StateRow, TableRow, ValueRow
from visup.rules.relations.trend import CONVERGING, DIVERGING, KEEPING
from visup.rules.smoothing.hysteresis import UNKNOWN, Codes, Floats

COUPLED, MERGED = 1, 2
"""Marks of pairs that are one body, or one region."""

COPIED = (
    (TableRow.TREND, StateRow.TREND),
    (TableRow.TOUCH, StateRow.TOUCH),
    (TableRow.TOGETHER, StateRow.TOGETHER),
    (TableRow.DEPTH, StateRow.DEPTH),
    (TableRow.FIRST_AWAY, StateRow.FIRST_AWAY),
    (TableRow.SECOND_AWAY, StateRow.SECOND_AWAY),
    (TableRow.FIRST_SIDE, StateRow.FIRST_SIDE),
    (TableRow.SECOND_SIDE, StateRow.SECOND_SIDE),
    (TableRow.DISTANCE, StateRow.DISTANCE),
    (TableRow.DIRECTION, StateRow.DIRECTION),
)
"""Rows of the table, and the rows of states they are copied from."""


SWAY = 0.12
"""Tolerated relative speed of bodies moving as one, as a share of their speed."""


class MotionLimits(NamedTuple):
    """Thresholds of trend, touch and moving together.

    Attributes:
        rates: Rates to enter and to leave a trend, pixels per second.
        sigmas: The same in standard deviations, for a new and for a pending trend.
        touch: Gaps to start and to keep a touch, pixels; relative depth differences at which it ends and
            below which it may start.
        rest: Relative speed of rest, pixels per second; the same in halves of the window; factor while it
            continues; share of the required speed at which it continues.
    """

    rates: tuple[float, float]
    sigmas: tuple[float, float]
    touch: tuple[float, float, float, float]
    rest: tuple[float, float, float, float]


class PairMotion(NamedTuple):
    """The quantities that decide trend, touch and moving together.

    Attributes:
        tables: (5, M, M); see `PairQuantity`.
        motion: (3, M, 2) velocities over the window and in its halves, pixels per second.
        speed: (M,) pixels per second.
        depth: (M,); NaN unknown.
        gap: (P,) of the outlines, smoothed, pixels.
        marks: (P,) `COUPLED` or `MERGED` pairs.
    """

    tables: Floats
    motion: Floats
    speed: Floats
    depth: Floats
    gap: Floats
    marks: Codes


class PairBeliefs(NamedTuple):
    """States of pairs, and since when they have held.

    Attributes:
        state: (ROWS, P); see `StateRow`.
        since: (ROWS, P) seconds.
        rcc8: (2, P) for boxes and for outlines.
        rcc8_since: (2, P) seconds.
    """

    state: Codes
    since: Floats
    rcc8: Codes
    rcc8_since: Floats


@compiled
def smoothed_value(before: float, now: float, share: float, jump: float) -> float:
    """A smoothed value; see `ema.py`."""
    step = now - before
    return share * step + before if abs(step) <= jump else now


@compiled
def smoothed_boxes(
    boxes: Floats,
    gaps: Floats,
    seen: Floats,
    tables: Floats,
    numbers: tuple[float, float, float, float, float],
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Smoothed boxes and gaps.

    Args:
        boxes: (M, 4) before, pixels.
        gaps: (P,) of the outlines before, pixels.
        seen: (M, 8) sightings; see `hull_gaps`.
        tables: (5, M, M); see `Kinematics`.
        numbers: Weight of new values; differences of edges, and of gaps, beyond which an average is
            reset, pixels; how long a box is kept for a body out of view, seconds; gap up to which
            outlines may meet, pixels.

    Returns:
        (M, 4) boxes and (P,) gaps, NaN unknown, and the numbers of the pairs that may meet.
    """
    share, jump, wide, hold, near = numbers
    now, apart = np.full(boxes.shape, np.nan), np.empty(len(gaps))
    asked = np.empty(len(gaps), np.int64)
    for i in range(len(boxes)):
        if not seen[i, 0] > hold:
            for k in range(4):
                now[i, k] = smoothed_value(boxes[i, k], seen[i, 4 + k], share, jump)
    number = count = 0
    for i in range(len(boxes)):
        for j in range(i + 1, len(boxes)):
            apart[number] = smoothed_value(
                gaps[number], tables[PairQuantity.GAP, i, j], share, wide
            )
            if apart[number] <= near:
                asked[count] = number
                count += 1
            number += 1
    return now, apart, asked[:count]


@compiled
def smoothed_outlines(
    before: Floats,
    gaps: Floats,
    asked: NDArray[np.int64],
    found: Floats,
    numbers: tuple[float, ...],
) -> Floats:
    """Smoothed signed distances of outlines.

    Args:
        before: (3, P) pixels; see `outline_differences`.
        gaps: (P,) pixels, NaN unknown.
        asked: (K,) pairs that were measured.
        found: (3, K) their distances, pixels.
        numbers: Weight of new values; differences beyond which an average is reset; distance assumed for
            other pairs, pixels.

    Returns:
        (3, P) pixels; NaN unknown.
    """
    share, jump, far = numbers
    now, k = np.empty(before.shape), 0
    for number in range(len(gaps)):
        looked = k < len(asked) and asked[k] == number
        for row in range(3):
            value = found[row, k] if looked else np.nan if np.isnan(gaps[number]) else far
            now[row, number] = smoothed_value(before[row, number], value, share, jump)
        k += looked
    return now


@compiled
def classify_trend(
    rate: float,
    sigma: float,
    before: int,
    pending: int,
    limits: tuple[float, float],
    sigmas: tuple[float, float],
) -> int:
    """The trend that corresponds to a rate of change, with hysteresis.

    Args:
        rate: Pixels per second; NaN unknown.
        sigma: Its standard deviation.
        before: The current trend.
        pending: The pending trend.
        limits: Rate that must be exceeded to enter a trend, and below which it ends.
        sigmas: Standard deviations that the rate must also exceed to become pending, and to stay
            pending. Standard deviations are estimates themselves and jump; a single wide one does not
            cancel a pending trend. A rate below one standard deviation is none.

    Returns:
        Its code; a rate between the thresholds changes nothing.
    """
    if not np.isfinite(rate):
        return UNKNOWN
    enter, leave = limits
    towards = CONVERGING if rate < 0.0 else DIVERGING
    least = (sigmas[1] if pending == towards else sigmas[0]) * sigma
    if abs(rate) > enter and abs(rate) > least:
        return towards
    # Below the entry threshold a new pair keeps its distance; an existing trend ends later.
    goes_on = (before == CONVERGING and rate <= 0.0) or (before == DIVERGING and rate >= 0.0)
    return before if goes_on and abs(rate) >= max(leave, sigma) else KEEPING


@compiled
def combined_trend(image: int, depth: int) -> int:
    """Combine the trends of an image distance and of a depth difference.

    Args:
        image: Code of the trend in the image.
        depth: Code of the trend of the depth difference, UNKNOWN where depth is unknown.

    Returns:
        The image's trend where the depth agrees, keeps or is unknown; the depth's where the image
        keeps its distance; UNKNOWN where they contradict each other.
    """
    if depth == UNKNOWN:
        return image
    if image == KEEPING:
        return depth
    against = image == CONVERGING and depth == DIVERGING
    against = against or (image == DIVERGING and depth == CONVERGING)
    return UNKNOWN if against else image


@compiled
def _threshold(before: int, enter: float, leave: float) -> float:
    """The threshold to enter or keep a state; their mean while it is unknown."""
    return leave if before == 1 else 0.5 * (enter + leave) if before == UNKNOWN else enter


@compiled
def _touching(
    gap: float, depths: tuple[float, float], before: int, limits: tuple[float, ...]
) -> int:
    """Touch by the gap, unless depth separates the two."""
    near, far, level, apart = limits
    if np.isnan(gap):
        return UNKNOWN
    nearest, between = min(depths[0], depths[1]), abs(depths[0] - depths[1])
    if between > _threshold(before, level, apart) * nearest:
        return 0
    return int(gap <= _threshold(before, near, far))


@compiled
def _length(vectors: Floats, i: int, j: int) -> float:
    x, y = vectors[i, 0] - vectors[j, 0], vectors[i, 1] - vectors[j, 1]
    return float(np.sqrt(x * x + y * y))


@compiled
def _speed(vectors: Floats, i: int) -> float:
    return float(np.sqrt(vectors[i, 0] * vectors[i, 0] + vectors[i, 1] * vectors[i, 1]))


@compiled
def _together(
    relative: float,
    halves: tuple[float, float],
    slower: float,
    image_speed: float,
    before: int,
    limits: tuple[float, ...],
) -> int:
    """Whether both move and neither moves relative to the other, over the window and in its halves.

    The halves are checked so that a body bouncing off, whose mean relative velocity is momentarily zero,
    is not taken for one at rest.
    """
    still, half, wide, goes_on = limits
    held = before == 1
    # Fast motion sways, and motion before it started is irrelevant.
    if image_speed > 4.0 * still and halves[1] < max(
        half, SWAY * (wide if held else 1.0) * image_speed
    ):
        return 1
    if np.isnan(relative):
        return UNKNOWN
    if not slower > 2.0 * still * (goes_on if held else 1.0):
        return 0
    share = wide if held else 1.0
    rest = halves[0] < share * half and halves[1] < share * half
    return int(rest and relative < share * still)


@compiled
def classify_motion(
    state: Codes, pending: Codes, now: PairMotion, limits: MotionLimits, codes: Codes
) -> None:
    """Classify trend, touch and moving together of all pairs.

    Args:
        state: (3, P) current states of these.
        pending: (3, P) pending states.
        now: The quantities.
        limits: Thresholds.
        codes: (4, P) output, except the last row, the trend of depth, which is input.
    """
    rates, tables, depth, k = limits.rates, now.tables, now.depth, -1
    for i in range(len(now.speed)):
        for j in range(i + 1, len(now.speed)):
            k += 1
            rate, sigma = tables[PairQuantity.RATE, i, j], tables[PairQuantity.SIGMA, i, j]
            # Distance changes of bodies moving as one are sway, not a trend.
            known = np.isfinite(now.speed[i]) and np.isfinite(now.speed[j])
            sway = SWAY * min(now.speed[i], now.speed[j]) if known else 0.0
            least = max(rates[0], sway), max(rates[1], sway)
            found = classify_trend(rate, sigma, state[0, k], pending[0, k], least, limits.sigmas)
            found = combined_trend(found, codes[3, k])
            touching = _touching(now.gap[k], (depth[i], depth[j]), state[1, k], limits.touch)
            halves = _length(now.motion[1], i, j), _length(now.motion[2], i, j)
            relative, slower = (
                tables[PairQuantity.RELATIVE_SPEED, i, j],
                min(now.speed[i], now.speed[j]),
            )
            image_speed = min(_speed(now.motion[2], i), _speed(now.motion[2], j))
            codes[2, k] = _together(relative, halves, slower, image_speed, state[2, k], limits.rest)
            meets = tables[PairQuantity.GAP, i, j] <= limits.touch[0]
            if now.marks[k] & COUPLED and meets and found == DIVERGING:
                # A rotating body changes its outline; it separates when its parts no longer touch.
                found = KEEPING
            if now.marks[k] & MERGED:
                found, touching = UNKNOWN, 1
            codes[0, k], codes[1, k] = found, touching


@compiled
def _certainties(rate: float, sigma: float, cap: float, floor: float) -> tuple[float, float]:
    """Certainty of most relations, and of a trend by its distance from zero in standard deviations."""
    sure = abs(rate / np.hypot(sigma, floor))
    sure = 0.0 if np.isnan(sure) else 1.0 - 0.5 * np.exp(-sure / 3.0)
    return min(cap, 0.9), min(cap, sure)


@compiled
def relation_rows(
    beliefs: PairBeliefs,
    tables: Floats,
    depth: Floats,
    converses: tuple[Codes, Codes],
    numbers: tuple[float, float, float],
) -> tuple[Codes, Floats, Floats]:
    """The relation table of all pairs; its rows are those of `TableRow`.

    Args:
        beliefs: States of the pairs.
        tables: (5, M, M); see `PairQuantity`.
        depth: (M,); NaN unknown.
        converses: RCC-8 of (a, b) -> that of (b, a); the same of directions.
        numbers: Current time, seconds; greatest certainty without depth; floor of a trend's noise, pixels
            per second.

    Returns:
        (16, P) codes and (16, P) seconds since when; (7, P) numbers; see `ValueRow`.
    """
    state, since, rcc8, rcc8_since = beliefs
    now, image_only, floor = numbers
    converse, opposite = converses
    pairs, k = state.shape[1], -1
    codes, moments = np.empty((16, pairs), np.int8), np.empty((16, pairs))
    values = np.empty((7, pairs))
    for row, source in COPIED:
        codes[row], moments[row] = state[source], since[source]
    codes[TableRow.BOXES], codes[TableRow.OUTLINES] = rcc8[0], rcc8[1]
    moments[TableRow.BOXES] = moments[TableRow.BOXES_CONVERSE] = rcc8_since[0]
    moments[TableRow.OUTLINES] = moments[TableRow.OUTLINES_CONVERSE] = rcc8_since[1]
    moments[TableRow.DIRECTION_CONVERSE] = since[StateRow.DIRECTION]
    moments[TableRow.GAP], values[ValueRow.CERTAIN] = now, 1.0
    for i in range(len(depth)):
        for j in range(i + 1, len(depth)):
            k += 1
            codes[TableRow.BOXES_CONVERSE, k] = converse[rcc8[0, k]]
            codes[TableRow.OUTLINES_CONVERSE, k] = converse[rcc8[1, k]]
            codes[TableRow.DIRECTION_CONVERSE, k] = opposite[state[StateRow.DIRECTION, k]]
            gap = tables[PairQuantity.GAP, i, j]
            rate, sigma = tables[PairQuantity.RATE, i, j], tables[PairQuantity.SIGMA, i, j]
            codes[TableRow.GAP, k] = UNKNOWN if np.isnan(gap) else 0
            cap = 1.0 if np.isfinite(depth[i]) and np.isfinite(depth[j]) else image_only
            most, trend = _certainties(rate, sigma, cap, floor)
            values[ValueRow.MOST, k], values[ValueRow.TREND_CERTAINTY, k] = most, trend
            values[ValueRow.GAP, k], values[ValueRow.RATE, k] = gap, rate
            values[ValueRow.SIGMA, k] = sigma
            values[ValueRow.RELATIVE_SPEED, k] = tables[PairQuantity.RELATIVE_SPEED, i, j]
    return codes, moments, values
