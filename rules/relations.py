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
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from visup.agent import Mind, ObjectBelief, Observation, Outcome, Relation, Truth
from visup.rules.fit import binned, theil_sen
from visup.rules.geometry import RCC8, Floats, rcc8
from visup.rules.history import History, covered, sample
from visup.rules.latch import UNKNOWN, Codes, Latch, step, unknown_latch
from visup.rules.measure import Measured, Measuring, RelationSettings, at_rest, scale
from visup.rules.tracks import merged_pairs

RELATIONS = "rules.relations"
CONVERGING, KEEPING, DIVERGING = 0, 1, 2
TREND_NAMES = ("converging", "keeping_distance", "diverging")


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """What the relations remember from step to step."""

    history: History = field(default_factory=History)
    measured: Measured = field(default_factory=Measured)
    latches: Mapping[str, Latch] = field(default_factory=lambda: MappingProxyType({}))


def measured(mind: Mind) -> Measured:
    """The quantities of the last step, as `Relations` left them in the mind."""
    kept: Kept = mind.memory.get(RELATIONS, Kept())
    return kept.measured


@dataclass(frozen=True, slots=True)
class Relations:
    """Thinker of the cogitate phase: judges all relations of all pairs of present objects."""

    settings: RelationSettings = field(default_factory=RelationSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        kept: Kept = mind.memory.get(RELATIONS, Kept())
        objects = mind.present()
        ids = tuple(b.id for b in objects)
        history = sample(
            kept.history,
            objects,
            mind,
            observation,
            self.settings.window_s,
            self.settings.samples,
        )
        now = Measuring(self.settings)(history, objects, mind, kept.measured)
        rows = np.array([kept.measured.ids.index(i) if i in kept.measured.ids else -1 for i in ids])
        latches = {
            name: step(
                self._before(kept, name, rows.astype(np.intp), mind.time), wanted, mind.time, lasts
            )
            for name, wanted, lasts in self._wanted(kept, history, now, rows, objects, mind)
        }
        mind = mind.remember(RELATIONS, Kept(history, now, MappingProxyType(latches)))
        return Outcome(replace(mind, relations=self._tell(latches, now, objects, mind)))

    def _before(self, kept: Kept, name: str, rows: NDArray[np.intp], now: float) -> Latch:
        old = kept.latches.get(name)
        blank = unknown_latch((len(rows), len(rows)), now)
        return blank if old is None or len(rows) == 0 else old.select(rows, now)

    def _wanted(
        self,
        kept: Kept,
        h: History,
        now: Measured,
        rows: NDArray[np.intp],
        objects: tuple[ObjectBelief, ...],
        mind: Mind,
    ) -> tuple[tuple[str, Codes, float], ...]:
        s, diagonal = self.settings, scale(mind.frame_size)
        trend = self._before(kept, "trend", rows.astype(np.intp), mind.time).state
        touching = self._before(kept, "touching", rows.astype(np.intp), mind.time).state
        image = wanted_trend(
            now.rate,
            now.rate_sigma,
            trend,
            s.rate_enter * diagonal,
            s.rate_exit * diagonal,
            s.sigmas,
        )
        boxes = np.array([b.region.bbox for b in objects], dtype=float).reshape(-1, 4)
        trends = with_depth(image, self._depth_trend(h))
        touch = self._wanted_touch(now, touching, diagonal)
        for i, j in index_pairs(h.ids, (c.objects for c in mind.couplings)):
            # One body that turns changes its outline; it comes apart when its parts no longer touch.
            if touch[i, j] == 1 and trends[i, j] == DIVERGING:
                trends[i, j] = trends[j, i] = KEEPING
        for i, j in index_pairs(h.ids, merged_pairs(mind)):
            touch[i, j] = touch[j, i] = 1
            trends[i, j] = trends[j, i] = UNKNOWN
        return (
            ("trend", trends, s.trend_minimum_s),
            ("touching", touch, s.touch_minimum_s),
            ("moving_together", self._wanted_together(now, diagonal), s.trend_minimum_s),
            ("rcc8", rcc8(boxes, 0.002 * diagonal), s.touch_minimum_s),
        )

    def _depth_trend(self, h: History) -> Codes:
        """Trend of the difference in depth: a code of each pair, UNKNOWN where it is not known."""
        m = len(h.ids)
        codes = np.full((m, m), UNKNOWN, dtype=np.int8)
        i, j = np.triu_indices(m, 1)
        known = np.isfinite(h.depth).mean(axis=0) >= 0.6 if len(h.times) else np.zeros(m, bool)
        both = known[i] & known[j]
        i, j = i[both], j[both]
        if len(i) == 0 or not covered(h, self.settings.window_s):
            return codes
        apart = np.abs(h.depth[:, i] - h.depth[:, j])
        slope, sigma = theil_sen(*binned(h.times, apart, self.settings.bins))
        typical = 0.5 * np.nanmean(h.depth[:, i] + h.depth[:, j], axis=0)
        least = np.maximum(self.settings.depth_rate * typical, 3.0 * sigma)
        found = np.full(len(i), KEEPING, dtype=np.int8)
        found[slope < -least] = CONVERGING
        found[slope > least] = DIVERGING
        codes[i, j] = codes[j, i] = found
        return codes

    def _wanted_touch(self, now: Measured, before: Codes, diagonal: float) -> Codes:
        s = self.settings
        limit = np.where(before == 1, s.touch_exit, s.touch_enter) * diagonal
        with np.errstate(invalid="ignore"):
            wanted = np.where(now.gap <= limit, 1, 0).astype(np.int8)
            d = now.depth
            apart = np.abs(d[:, None] - d[None]) / np.minimum(d[:, None], d[None])
            wanted[apart > s.apart_depth] = 0
        wanted[~np.isfinite(now.gap)] = UNKNOWN
        return wanted

    def _wanted_together(self, now: Measured, diagonal: float) -> Codes:
        """Both move and neither moves relative to the other."""
        with np.errstate(invalid="ignore"):
            moves = now.speed > 2 * self.settings.still_speed * diagonal
        rest = at_rest(now, self.settings, diagonal)
        wanted: Codes = (rest & moves[:, None] & moves[None]).astype(np.int8)
        wanted[~np.isfinite(now.relative_speed)] = UNKNOWN
        return wanted

    def _tell(
        self,
        latches: dict[str, Latch],
        now: Measured,
        objects: tuple[ObjectBelief, ...],
        mind: Mind,
    ) -> tuple[Relation, ...]:
        told: list[Relation] = []
        sure = self._trend_confidence(now, objects, mind)
        for i, a in enumerate(objects):
            for j in range(i + 1, len(objects)):
                pair = (a.id, objects[j].id)
                told += self._trends(latches["trend"], now, sure, i, j, pair)
                for name in ("touching", "moving_together"):
                    told.append(self._two_valued(name, latches[name], now, i, j, pair))
                told.append(_box_relation(latches["rcc8"], i, j, pair))
                told.append(_distance(now, i, j, pair, mind.time))
        return tuple(told)

    def _trend_confidence(
        self, now: Measured, objects: tuple[ObjectBelief, ...], mind: Mind
    ) -> Floats:
        floor = self.settings.rate_enter * scale(mind.frame_size) / 3.0
        z = now.rate / np.hypot(now.rate_sigma, floor)
        sure = 1.0 - 0.5 * np.exp(-np.abs(z) / 3.0)
        known = np.isfinite(now.depth)
        return np.minimum(
            sure, np.where(known[:, None] & known[None], 1.0, self.settings.image_only_confidence)
        )

    def _trends(
        self, latch: Latch, now: Measured, sure: Floats, i: int, j: int, pair: tuple[int, int]
    ) -> list[Relation]:
        state, since = int(latch.state[i, j]), float(latch.since[i, j])
        rate, sigma = _number(now.rate[i, j]), _number(now.rate_sigma[i, j])
        confidence = _number(sure[i, j]) or 0.0
        told = []
        for code, name in enumerate(TREND_NAMES):
            truth = Truth.UNKNOWN if state == UNKNOWN else _truth(state == code)
            c = 0.0 if state == UNKNOWN else confidence
            told.append(Relation(name, pair, truth, since, c, rate, sigma))
        return told

    def _two_valued(
        self, name: str, latch: Latch, now: Measured, i: int, j: int, pair: tuple[int, int]
    ) -> Relation:
        state = int(latch.state[i, j])
        known = np.isfinite(now.depth[i]) and np.isfinite(now.depth[j])
        confidence = 0.9 if known else self.settings.image_only_confidence
        value = now.gap[i, j] if name == "touching" else now.relative_speed[i, j]
        truth = Truth.UNKNOWN if state == UNKNOWN else _truth(state == 1)
        c = 0.0 if state == UNKNOWN else confidence
        return Relation(name, pair, truth, float(latch.since[i, j]), c, _number(value))


def wanted_trend(
    rate: Floats, sigma: Floats, before: Codes, enter: float, leave: float, sigmas: float
) -> Codes:
    """Which trend a rate of change stands for, with hysteresis.

    Args:
        rate: (M, M) pixels per second; NaN unknown.
        sigma: (M, M) its standard deviation.
        before: (M, M) the trend believed so far.
        enter: Rate that must be exceeded to enter a trend, pixels per second.
        leave: Rate below which it ends.
        sigmas: How many deviations the rate must also exceed to enter.

    Returns:
        (M, M) codes; a rate between the thresholds leaves things as they are.
    """
    with np.errstate(invalid="ignore"):
        strong = np.abs(rate) > np.maximum(enter, sigmas * sigma)
        weak = np.abs(rate) < leave
    wanted = before.copy()
    moving = (before == CONVERGING) | (before == DIVERGING)
    turned = ((before == CONVERGING) & (rate > 0)) | ((before == DIVERGING) & (rate < 0))
    # Below the entering threshold a new pair keeps its distance; one that moved is let go later.
    wanted[~strong & (weak | turned | ~moving)] = KEEPING
    wanted[strong] = np.where(rate < 0, CONVERGING, DIVERGING)[strong].astype(np.int8)
    wanted[~np.isfinite(rate)] = UNKNOWN
    return wanted


def with_depth(image: Codes, depth: Codes) -> Codes:
    """Judge the trends of image distance and of depth difference together.

    Args:
        image: Codes of trends in the image.
        depth: Codes of trends of the depth difference, UNKNOWN where depth is not known.

    Returns:
        The image's trend where the depth agrees, keeps or is unknown; the depth's where the image
        keeps its distance; UNKNOWN where they contradict each other.
    """
    joined = image.copy()
    by_depth = (image == KEEPING) & (depth != UNKNOWN)
    joined[by_depth] = depth[by_depth]
    against = (image == CONVERGING) & (depth == DIVERGING)
    against |= (image == DIVERGING) & (depth == CONVERGING)
    joined[against] = UNKNOWN
    return joined


def index_pairs(
    ids: tuple[int, ...], pairs: Iterable[tuple[int, int]]
) -> tuple[tuple[int, int], ...]:
    """Where pairs of object ids stand in `ids`; pairs with an object that is not there are left out."""
    known = {object_id: i for i, object_id in enumerate(ids)}
    return tuple((known[a], known[b]) for a, b in pairs if a in known and b in known)


def _truth(value: bool) -> Truth:
    return Truth.TRUE if value else Truth.FALSE


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _box_relation(latch: Latch, i: int, j: int, pair: tuple[int, int]) -> Relation:
    state = int(latch.state[i, j])
    name = RCC8[state] if state != UNKNOWN else "disconnected"
    truth = Truth.UNKNOWN if state == UNKNOWN else Truth.TRUE
    return Relation(name, pair, truth, float(latch.since[i, j]))


def _distance(now: Measured, i: int, j: int, pair: tuple[int, int], time: float) -> Relation:
    gap = _number(now.gap[i, j])
    truth = Truth.UNKNOWN if gap is None else Truth.TRUE
    return Relation("distance", pair, truth, time, 1.0, gap)
