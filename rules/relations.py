"""What holds between objects: relations of all pairs, in one vectorised pass per step.

The distance whose trend is judged is the signed distance of the outlines' convex hulls: it goes
on smoothly through zero into penetration depth when one body reaches in front of another, and it
does not depend on the centroid of a body that the image border cuts (paper, section 7.4, fits the
trend of the tracking data by a line). Each relation has a threshold to enter and another to leave
it, both relative to the noise of the fit, and a least duration. Names and numbers of pixels are
for an image diagonal of 800 px (640 x 480) and scale with the diagonal.

An image distance that shrinks does not mean that bodies come closer in space. Where the depth of
both is known, its trend is judged too, and a relation that the two contradict is unknown; where it
is not known the image alone is judged and the confidence is capped at `image_only_confidence`.
What is said of depth itself (`nearing_in_depth`, ...) is unknown without depth.

How to read them off a mind:

- `related(mind, name, a, b) -> Truth`: any relation of two objects, those of `NAMES` among them;
- `relation_of(mind, name, a, b) -> Relation | None`: the same with confidence, value, since;
- `qtc(mind, a, b) -> str | None`: QTC-C such as '-0+0'; its first two signs are QTC-B;
- `measured(mind).pair(quantity, a, b) -> float`: 'gap', 'rate', 'relative_speed', 'rate_sigma',
  'time_to_contact'; NaN unknown; `measured(mind).interval(quantity, a, b) -> (low, high)`;
- `measured(mind).one(quantity, a) -> float`: 'speed', 'depth';
- `zones.inside(mind, object_id, zone_name) -> Truth`, and more in `zones.py`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from visup.agent import (
    Column,
    Mind,
    ObjectBelief,
    Observation,
    Outcome,
    Relation,
    RelationTable,
    Truth,
)
from visup.agent.changing import replace
from visup.rules.direction import CONVERSE as DIRECTION_CONVERSE
from visup.rules.direction import DIRECTION_NAMES
from visup.rules.distance import CLASS_NAMES
from visup.rules.fit_loops import trends
from visup.rules.geometry import RCC8, Floats
from visup.rules.history import History, covered, sample
from visup.rules.judge import (
    AWAY,
    DIRECTION,
    DISTANCE,
    JUDGED,
    ORDER,
    SIDE,
    least_durations,
    quantities,
    wanted,
)
from visup.rules.latch import UNKNOWN, Codes, Latch, hold_sign, step, unknown_latch
from visup.rules.measure import Measured, Measuring, RelationSettings, scale
from visup.rules.pairs import carried, of_pairs, pairs
from visup.rules.qtc import text
from visup.rules.rcc8 import (
    CONVERSE,
    from_outline_signs,
    from_signs,
    outline_differences,
)
from visup.rules.smooth import smoothed
from visup.rules.tracks import merged_pairs
from visup.rules.trend import CONVERGING, DIVERGING, KEEPING, TREND_NAMES, wanted_trend, with_depth

RELATIONS = "rules.relations"
DEPTH_NAMES = ("nearing_in_depth", "keeping_in_depth", "parting_in_depth")
TOWARDS_NAMES = ("moving_towards", "steady_to", "moving_away_from")
SIDE_NAMES = ("moving_left_of", "", "moving_right_of")
OUTLINE_NAMES = tuple(f"outlines_{name}" for name in RCC8)
NAMES = tuple(
    name
    for names in (
        TREND_NAMES,
        ("touching", "moving_together"),
        DEPTH_NAMES,
        RCC8,
        OUTLINE_NAMES,
        TOWARDS_NAMES,
        SIDE_NAMES,
        DIRECTION_NAMES,
        CLASS_NAMES,
    )
    for name in names
    if name
)
"""Every relation of two objects that is judged here; `coupled` is judged by `coupling.py`."""

TREND, TOUCH, TOGETHER, DEPTH = range(JUDGED, JUDGED + 4)
OUTLINE = slice(JUDGED + 4, JUDGED + 7)
ROWS = JUDGED + 7
"""Rows of codes: those of `judge.py`, then trend, touch, moving together, depth, outlines (3)."""


@dataclass(frozen=True, slots=True, eq=False)
class Smooth:
    """Places of objects, smoothed a little; see `smooth.py`.

    Attributes:
        time: Seconds of the last step.
        boxes: (M, 4) x, y, width, height, pixels.
        gap: (P,) of the outlines, pixels.
        outlines: (3, P) pixels; see `outline_differences`.
    """

    time: float
    boxes: Floats
    gap: Floats
    outlines: Floats


def _no_smooth() -> Smooth:
    return Smooth(0.0, np.zeros((0, 4)), np.zeros(0), np.zeros((3, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """What the relations remember from step to step.

    Attributes:
        history: Samples that lines are fitted to.
        measured: Quantities of the last step.
        latch: (ROWS, P) states of the pairs of the history's objects.
        rcc8: (2, P) RCC-8 of boxes and of outlines, which follow from some of these states.
        smooth: What states of place are judged by.
    """

    history: History = field(default_factory=History)
    measured: Measured = field(default_factory=Measured)
    latch: Latch = field(default_factory=lambda: unknown_latch((ROWS, 0), 0.0))
    rcc8: Latch = field(default_factory=lambda: unknown_latch((2, 0), 0.0))
    smooth: Smooth = field(default_factory=lambda: _no_smooth())


NOTHING_KEPT = Kept()


def measured(mind: Mind) -> Measured:
    """The quantities of the last step, as `Relations` left them in the mind."""
    kept: Kept = mind.memory.get(RELATIONS, NOTHING_KEPT)
    return kept.measured


def relation_of(mind: Mind, name: str, a: int, b: int) -> Relation | None:
    """A relation of two objects as the mind holds it, in this order, or None if it is not judged."""
    return mind.relation(name, a, b)


def related(mind: Mind, name: str, a: int, b: int) -> Truth:
    """Whether a relation holds from a to b; unknown when it is not judged.

    Args:
        mind: The mind after this step's relations.
        name: One of `NAMES`, `coupled`, or a plug-in's own.
        a: An object.
        b: Another; the order matters for RCC-8's proper parts, movements and directions.
    """
    found = mind.relation(name, a, b)
    return Truth.UNKNOWN if found is None else found.truth


def qtc(mind: Mind, a: int, b: int) -> str | None:
    """QTC-C of two objects, such as '-0+0', or None while unknown; see `qtc.py`."""
    kept: Kept = mind.memory.get(RELATIONS, NOTHING_KEPT)
    k, turned = RelationTable(kept.history.ids).pair(a, b)
    if k < 0:
        return None
    order = slice(None, None, -1) if turned else slice(None)
    state = kept.latch.state
    return text(*(int(c) for rows in (AWAY, SIDE) for c in state[rows, k][order]))


@dataclass(frozen=True, slots=True)
class Relations:
    """Thinker of the cogitate phase: judges all relations of all pairs of present objects."""

    settings: RelationSettings = field(default_factory=RelationSettings)
    _lasts: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_lasts", self._durations())

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        s = self.settings
        kept: Kept = mind.memory.get(RELATIONS, NOTHING_KEPT)
        objects = mind.present()
        before = _of_these(kept, tuple(b.id for b in objects), mind.time)
        history = sample(kept.history, objects, mind, observation, s.window_s, s.samples)
        now = Measuring(s)(history, objects, mind, kept.measured)
        smooth = self._smooth(before.smooth, now, objects, mind)
        wants = self._wanted(before.latch, history, now, smooth, mind)
        latch = step(before.latch, wants, mind.time, self._lasts)
        rcc8 = before.rcc8
        if latch is not before.latch:  # else these follow from what is as it was
            state = latch.state
            held = np.array((from_signs(state[ORDER]), from_outline_signs(state[OUTLINE])))
            rcc8 = step(rcc8, held, mind.time, 0.0)
        kept = Kept(history, now, latch, rcc8, smooth)
        table = RelationTable(now.ids, self._columns(kept, mind))
        return Outcome(mind.remember(RELATIONS, kept, relations=table))

    def _durations(self) -> Floats:
        s = self.settings
        lasts = np.full((ROWS, 1), s.touch_minimum_s)
        lasts[:JUDGED] = least_durations(s.judge)
        lasts[[TREND, TOGETHER, DEPTH]] = s.trend_minimum_s
        return lasts

    def _wanted(
        self,
        before: Latch,
        h: History,
        now: Measured,
        smooth: Smooth,
        mind: Mind,
    ) -> Codes:
        s, diagonal = self.settings, scale(mind.frame_size)
        codes = np.empty(before.state.shape, dtype=np.int8)
        q = quantities(smooth.boxes, now.velocity, now.velocity_sigma, s.judge.noise_px)
        codes[:JUDGED] = wanted(before.state[:JUDGED], q, s.judge, diagonal)
        image = wanted_trend(
            of_pairs(now.rate),
            of_pairs(now.rate_sigma),
            before.state[TREND],
            before.pending[TREND],
            s.rate_enter * diagonal,
            s.rate_exit * diagonal,
            (s.sigmas, s.pending_sigmas),
        )
        codes[DEPTH] = self._depth_trend(h)
        codes[TREND] = with_depth(image, codes[DEPTH])
        codes[TOUCH] = self._wanted_touch(now, smooth.gap, before.state[TOUCH], diagonal)
        codes[TOGETHER] = self._wanted_together(now, before.state[TOGETHER], diagonal)
        level = s.judge.level_enter * diagonal, s.judge.level_exit * diagonal
        codes[OUTLINE] = hold_sign(smooth.outlines, before.state[OUTLINE], *level)
        for k in _numbers(h.ids, (c.objects for c in mind.couplings)):
            # One body that turns changes its outline; it comes apart when its parts no longer touch.
            if codes[TOUCH, k] == 1 and codes[TREND, k] == DIVERGING:
                codes[TREND, k] = KEEPING
        for k in _numbers(h.ids, merged_pairs(mind)):
            codes[TOUCH, k], codes[TREND, k] = 1, UNKNOWN
        return codes

    def _smooth(
        self, before: Smooth, now: Measured, objects: tuple[ObjectBelief, ...], mind: Mind
    ) -> Smooth:
        """Boxes as they are, or were until a moment ago; gaps; outlines that may meet."""
        s, seconds = self.settings, mind.time - before.time
        boxes = np.array([b.region.bbox for b in objects], dtype=float).reshape(-1, 4)
        boxes[[mind.time - b.last_seen > s.hold_s for b in objects]] = np.nan
        jump = 6.0 * s.judge.noise_px
        gap = smoothed(before.gap, of_pairs(now.gap), seconds, jump * np.sqrt(2.0))
        diagonal = scale(mind.frame_size)
        near = gap <= 2.0 * s.judge.level_enter * diagonal
        regions = [b.region for b in objects]
        apart = outline_differences(regions, near, ~np.isnan(gap), 0.05 * diagonal)
        return Smooth(
            mind.time,
            smoothed(before.boxes, boxes, seconds, jump),
            gap,
            smoothed(before.outlines, apart, seconds, jump * np.sqrt(2.0)),
        )

    def _depth_trend(self, h: History) -> Codes:
        """Trend of the difference in depth: a code of each pair, UNKNOWN where it is not known."""
        i, j = pairs(len(h.ids))
        codes = np.full(len(i), UNKNOWN, dtype=np.int8)
        if len(i) == 0 or not covered(h, self.settings.window_s):
            return codes
        found_at = np.isfinite(h.depth)
        if not found_at.any():
            return codes
        known = found_at.mean(axis=0) >= 0.6
        at = np.flatnonzero(known[i] & known[j])
        if len(at) == 0:
            return codes
        first, second = h.depth[:, i[at]], h.depth[:, j[at]]
        slope, sigma = trends(h.times, np.abs(first - second), self.settings.bins)
        typical = 0.5 * np.nanmean(first + second, axis=0)
        least = np.maximum(self.settings.depth_rate * typical, 3.0 * sigma)
        found = np.full(len(at), KEEPING, dtype=np.int8)
        found[slope < -least] = CONVERGING
        found[slope > least] = DIVERGING
        codes[at] = found
        return codes

    def _wanted_touch(self, now: Measured, gap: Floats, before: Codes, diagonal: float) -> Codes:
        """By the gap, and not where depth tells the two apart."""
        s = self.settings
        i, j = pairs(len(now.ids))
        wanted = (gap <= _limit(before, s.touch_enter, s.touch_exit) * diagonal).astype(np.int8)
        first, second = now.depth[i], now.depth[j]
        apart = np.abs(first - second) / np.minimum(first, second)
        wanted[apart > _limit(before, s.apart_exit, s.apart_depth)] = 0
        wanted[np.isnan(gap)] = UNKNOWN
        return wanted

    def _wanted_together(self, now: Measured, before: Codes, diagonal: float) -> Codes:
        """Both move and neither moves relative to the other."""
        s = self.settings
        i, j = pairs(len(now.ids))
        held = before == 1
        least = 2 * s.still_speed * diagonal * np.where(held, s.moving_exit, 1.0)
        moves = np.minimum(now.speed[i], now.speed[j]) > least
        rest, nearly = _at_rest(now, s, diagonal, diagonal * s.together_exit)[:, i, j]
        wanted: Codes = ((rest | (held & nearly)) & moves).view(np.int8)
        wanted[np.isnan(of_pairs(now.relative_speed))] = UNKNOWN
        return wanted

    def _columns(self, kept: Kept, mind: Mind) -> tuple[Column, ...]:
        now, latch = kept.measured, kept.latch
        i, j = pairs(len(now.ids))
        known = np.isfinite(now.depth)
        cap = np.where(known[i] & known[j], 1.0, self.settings.image_only_confidence)[None]
        gap, rate = of_pairs(now.gap)[None], of_pairs(now.rate)[None]
        sigma = of_pairs(now.rate_sigma)[None]
        relative = of_pairs(now.relative_speed)[None]
        sure, certain = np.ones((2, len(i))), np.minimum(cap, 0.9)
        each = certain.repeat(2, axis=0)
        trend = np.minimum(cap, self._trend_confidence(rate, sigma, mind))
        there: Codes = np.where(np.isnan(gap), np.int8(UNKNOWN), np.int8(0))

        def column(
            names: tuple[str, ...],
            row: int | slice,
            confidence: Floats,
            value: Floats | None = None,
            sigma: Floats | None = None,
            listed: str = "none",
        ) -> Column:
            rows = row if isinstance(row, slice) else slice(row, row + 1)
            return Column(
                names, latch.state[rows], latch.since[rows], confidence, value, sigma, listed
            )

        def with_converse(
            names: tuple[str, ...], of: Latch, row: int, converse: Codes, listed: str
        ) -> Column:
            code, since = of.state[row], of.since[row]
            state, since = np.array((code, converse[code])), np.array((since, since))
            return Column(names, state, since, sure, listed=listed)

        return (
            column(TREND_NAMES, TREND, trend, rate, sigma, "each"),
            column(("", "touching"), TOUCH, certain, gap, listed="each"),
            column(("", "moving_together"), TOGETHER, certain, relative, listed="each"),
            with_converse(RCC8, kept.rcc8, 0, CONVERSE, "one"),
            Column(("distance",), there, np.full_like(gap, mind.time), sure, gap, listed="each"),
            with_converse(OUTLINE_NAMES, kept.rcc8, 1, CONVERSE, "none"),
            column(DEPTH_NAMES, DEPTH, certain),
            column(TOWARDS_NAMES, AWAY, each),
            column(SIDE_NAMES, SIDE, each),
            column(CLASS_NAMES, DISTANCE, sure, gap),
            with_converse(DIRECTION_NAMES, latch, DIRECTION, DIRECTION_CONVERSE, "each"),
        )

    def _trend_confidence(self, rate: Floats, sigma: Floats, mind: Mind) -> Floats:
        floor = self.settings.rate_enter * scale(mind.frame_size) / 3.0
        z = rate / np.hypot(sigma, floor)
        return np.where(np.isnan(z), 0.0, 1.0 - 0.5 * np.exp(-np.abs(z) / 3.0))


def _of_these(kept: Kept, ids: tuple[int, ...], now: float) -> Kept:
    """What was kept, of other objects."""
    if kept.history.ids == ids:
        return kept
    rows, numbers = carried(kept.history.ids, ids)
    smooth = Smooth(
        kept.smooth.time,
        np.append(kept.smooth.boxes, np.full((1, 4), np.nan), axis=0)[rows],
        np.append(kept.smooth.gap, np.nan)[numbers],
        np.append(kept.smooth.outlines, np.full((3, 1), np.nan), axis=1)[:, numbers],
    )
    latch, rcc8 = kept.latch.select(numbers, now), kept.rcc8.select(numbers, now)
    return replace(kept, latch=latch, rcc8=rcc8, smooth=smooth)


def _limit(before: Codes, enter: float, leave: float) -> Floats:
    """Up to which value a state is begun or kept; by the middle while it is not known yet."""
    middle = 0.5 * (enter + leave)
    return np.where(before == 1, leave, np.where(before == UNKNOWN, middle, enter))


def _numbers(ids: tuple[int, ...], of: Iterable[tuple[int, int]]) -> tuple[int, ...]:
    """Numbers of pairs of object ids; pairs with an object that is not there are left out."""
    table = RelationTable(ids)
    return tuple(k for a, b in of if (k := table.pair(a, b)[0]) >= 0)


def _at_rest(now: Measured, settings: RelationSettings, *diagonals: float) -> Any:
    def distances(vectors: Floats) -> Any:
        x, y = (vectors[:, None] - vectors[None]).transpose(2, 0, 1)
        return np.sqrt(x * x + y * y)

    halves = np.maximum(distances(now.motion[1]), distances(now.motion[2]))
    wide = np.array(diagonals)[:, None, None]
    rest = halves < settings.still_half * wide
    rest &= now.relative_speed < settings.still_speed * wide
    return rest
