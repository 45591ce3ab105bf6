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

from visup.agent import Mind, ObjectBelief, Observation, Outcome, Presence, Relation, Truth
from visup.rules.fit import binned, theil_sen, velocity
from visup.rules.geometry import FAN, RCC8, Floats, hull_separation, outline_gap, rcc8, reach
from visup.rules.latch import UNKNOWN, Codes, Latch, step, unknown_latch
from visup.rules.tracks import merged_pairs, tracks

RELATIONS = "rules.relations"
CONVERGING, KEEPING, DIVERGING = 0, 1, 2
TREND_NAMES = ("converging", "keeping_distance", "diverging")


@dataclass(frozen=True, slots=True)
class RelationSettings:
    """Thresholds of the relations.

    Attributes:
        window_s: Length of the window over which lines are fitted.
        samples: Most samples kept in the window.
        bins: Most means of neighbouring samples to which lines are fitted.
        quick_window_s: Length of a shorter window in which a trend must be strong to count; by it
            a turn is seen sooner.
        quick_sigmas: How many standard deviations of its slope that is, and twice `rate_enter`.
        motion_window_s: Length of the window over which velocities are fitted.
        rate_enter: Trend that must be exceeded to converge or diverge, image diagonals per second.
        rate_exit: Trend below which they end, image diagonals per second.
        sigmas: How many standard deviations of the slope a trend must exceed to enter.
        trend_minimum_s: Least duration of a trend before it is believed.
        hold_s: How long the last gap stands for bodies that flicker out of sight.
        depth_rate: Relative depth change that counts, share of the depth per second.
        touch_enter: Outline gap at which bodies touch, image diagonals.
        touch_exit: Outline gap at which they no longer do.
        touch_minimum_s: Least duration of a touch.
        still_speed: Relative speed over the window below which two bodies are at rest to each
            other, image diagonals per second.
        still_half: The same in each half of the window, where the noise is greater.
        misfit: How unevenly an outline may move and still have a velocity, image diagonals/s.
        apart_depth: Share of depth by which touching outlines belong to bodies apart in depth.
        image_only_confidence: Most that a relation judged without depth is believed.
    """

    window_s: float = 1.5
    samples: int = 64
    bins: int = 16
    quick_window_s: float = 0.7
    quick_sigmas: float = 4.0
    motion_window_s: float = 1.25
    rate_enter: float = 0.002
    rate_exit: float = 0.001
    sigmas: float = 3.0
    trend_minimum_s: float = 0.3
    hold_s: float = 0.3
    depth_rate: float = 0.02
    touch_enter: float = 0.0035
    touch_exit: float = 0.006
    touch_minimum_s: float = 0.2
    still_speed: float = 0.0025
    still_half: float = 0.0045
    misfit: float = 0.0075
    apart_depth: float = 0.25
    image_only_confidence: float = 0.8


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The last samples of all objects that relations are judged of.

    Attributes:
        ids: (M,) object ids, increasing.
        times: (T,) seconds, increasing, all within the window.
        support: (T, M, 16) pixels; NaN where an object was not seen.
        free: (T, M, 16) bool.
        separation: (T, M, M) signed hull distances, pixels.
        depth: (T, M) in the objects' units; NaN where unknown.
    """

    ids: tuple[int, ...] = ()
    times: Floats = field(default_factory=lambda: np.zeros(0))
    support: Floats = field(default_factory=lambda: np.zeros((0, 0, FAN)))
    free: NDArray[np.bool_] = field(default_factory=lambda: np.zeros((0, 0, FAN), dtype=bool))
    separation: Floats = field(default_factory=lambda: np.zeros((0, 0, 0)))
    depth: Floats = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """Quantities of the last step; what rules compare. NaN is unknown.

    Attributes:
        ids: (M,) object ids, increasing.
        gap: (M, M) distance of the outlines, pixels.
        rate: (M, M) trend of the distance, pixels per second, negative when closing.
        rate_sigma: (M, M) its standard deviation.
        relative_speed: (M, M) pixels per second.
        speed: (M,) pixels per second in the image.
        early: (M, 2) velocity in the first half of the window, pixels per second.
        late: (M, 2) velocity in the second half.
        depth: (M,) in the objects' units.
    """

    ids: tuple[int, ...] = ()
    gap: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    rate: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    rate_sigma: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    relative_speed: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    speed: Floats = field(default_factory=lambda: np.zeros(0))
    early: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    late: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    depth: Floats = field(default_factory=lambda: np.zeros(0))

    def pair(self, quantity: str, a: int, b: int) -> float:
        """One quantity of one pair, NaN when unknown."""
        if a not in self.ids or b not in self.ids:
            return float("nan")
        table: Floats = getattr(self, quantity)
        return float(table[self.ids.index(a), self.ids.index(b)])

    def one(self, quantity: str, a: int) -> float:
        """One quantity of one object, NaN when unknown."""
        if a not in self.ids:
            return float("nan")
        return float(getattr(self, quantity)[self.ids.index(a)])


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


def scale(frame_size: tuple[int, int]) -> float:
    """Image diagonal, pixels; what thresholds are relative to."""
    return float(np.hypot(*frame_size))


@dataclass(frozen=True, slots=True)
class Relations:
    """Thinker of the cogitate phase: judges all relations of all pairs of present objects."""

    settings: RelationSettings = RelationSettings()

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        kept: Kept = mind.memory.get(RELATIONS, Kept())
        objects = mind.present()
        ids = tuple(b.id for b in objects)
        history = self._sample(kept.history, objects, mind, observation)
        now = self._measure(history, objects, mind, kept.measured)
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

    def _sample(
        self,
        history: History,
        objects: tuple[ObjectBelief, ...],
        mind: Mind,
        observation: Observation,
    ) -> History:
        ids = tuple(b.id for b in objects)
        history = reindexed(history, ids)
        kept = history.times > mind.time - self.settings.window_s - 1e-6
        least = self.settings.window_s / self.settings.samples
        due = len(history.times) == 0 or mind.time - history.times[-1] >= least - 1e-6
        if not (due and observation.observed("region")):
            return only(history, kept)
        joint = {i for pair in merged_pairs(mind) for i in pair}
        seen = [
            b.last_seen == mind.time and b.presence is Presence.SEEN and b.id not in joint
            for b in objects
        ]
        reaches = [reach(b.region, mind.frame_size) for b in objects]
        support = np.full((len(ids), FAN), np.nan)
        free = np.zeros((len(ids), FAN), dtype=bool)
        for i, (r, s) in enumerate(zip(reaches, seen, strict=True)):
            if s:
                support[i], free[i] = r.support, r.free
        depth = np.array([np.nan if b.depth is None else b.depth for b in objects])
        history = comparable(only(history, kept), mind)
        return History(
            ids,
            np.append(history.times, mind.time),
            np.concatenate([history.support, support[None]]),
            np.concatenate([history.free, free[None]]),
            np.concatenate([history.separation, hull_separation(support)[None]]),
            np.concatenate([history.depth, np.where(seen, depth, np.nan)[None]]),
        )

    def _measure(
        self, h: History, objects: tuple[ObjectBelief, ...], mind: Mind, before: Measured
    ) -> Measured:
        m = len(objects)
        slope, sigma = np.full((m, m), np.nan), np.full((m, m), np.nan)
        i, j = np.triu_indices(m, 1)
        if self._covered(h) and len(i):
            slope[i, j], sigma[i, j] = self._trend(h.times, h.separation[:, i, j], mind)
            slope[j, i], sigma[j, i] = slope[i, j], sigma[i, j]
        stale = np.array([mind.time - b.last_seen > 0.5 * self.settings.window_s for b in objects])
        if m:
            slope[stale, :] = slope[:, stale] = np.nan
        whole, early, late = self._velocities(h, mind)
        apart = np.linalg.norm(whole[:, None] - whole[None], axis=2)
        depth = np.array([np.nan if b.depth is None else b.depth for b in objects])
        return Measured(
            h.ids,
            self._gaps(objects, h, mind, before),
            slope,
            sigma,
            apart,
            np.linalg.norm(whole, axis=1),
            early,
            late,
            depth,
        )

    def _trend(self, times: Floats, distance: Floats, mind: Mind) -> tuple[Floats, Floats]:
        """Slope over the window, or over its last part where that is strong and of another sign."""
        s = self.settings
        slope, sigma = theil_sen(*binned(times, distance, s.bins))
        recent = times > times[-1] - s.quick_window_s
        quick, spread = theil_sen(*binned(times[recent], distance[recent], s.bins))
        least = 2.0 * s.rate_enter * scale(mind.frame_size)
        with np.errstate(invalid="ignore"):
            turned = np.abs(quick) > np.maximum(least, s.quick_sigmas * spread)
            turned &= np.sign(quick) != np.sign(slope)
        return np.where(turned, quick, slope), np.where(turned, spread, sigma)

    def _covered(self, h: History) -> bool:
        return len(h.times) >= 6 and h.times[-1] - h.times[0] >= 0.6 * self.settings.window_s

    def _velocities(self, h: History, mind: Mind) -> tuple[Floats, Floats, Floats]:
        """Over the window of motion, and over its two halves."""
        m, misfit = len(h.ids), self.settings.misfit * scale(mind.frame_size)
        unknown = np.full((m, 2), np.nan)
        if m == 0 or not self._covered(h):
            return unknown, unknown, unknown
        recent = h.times > mind.time - self.settings.motion_window_s
        times, support, free = h.times[recent], h.support[recent], h.free[recent]
        half = len(times) // 2
        return (
            velocity(times, support, free, misfit),
            velocity(times[:half], support[:half], free[:half], misfit),
            velocity(times[half:], support[half:], free[half:], misfit),
        )

    def _gaps(
        self, objects: tuple[ObjectBelief, ...], h: History, mind: Mind, before: Measured
    ) -> Floats:
        """Outline gaps: exact where near, the hulls' distance elsewhere; NaN when out of sight."""
        gaps = np.full((len(objects), len(objects)), np.nan)
        for i, a in enumerate(objects):
            for j in range(i + 1, len(objects)):
                b = objects[j]
                unseen = mind.time - min(a.last_seen, b.last_seen)
                if unseen == 0.0:
                    gaps[i, j] = gaps[j, i] = self._gap(a, b, h, (i, j), mind)
                elif unseen <= self.settings.hold_s:
                    gaps[i, j] = gaps[j, i] = before.pair("gap", a.id, b.id)
        return gaps

    def _gap(
        self, a: ObjectBelief, b: ObjectBelief, h: History, at: tuple[int, int], mind: Mind
    ) -> float:
        near = 0.05 * scale(mind.frame_size)
        gap = outline_gap(a.region, b.region, near)
        if gap is not None:
            return gap
        apart = float(h.separation[-1][at]) if len(h.times) else np.nan
        return max(near, apart) if np.isfinite(apart) else np.nan

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
        if len(i) == 0 or not self._covered(h):
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


def at_rest(now: Measured, settings: RelationSettings, diagonal: float) -> NDArray[np.bool_]:
    """Whether bodies are at rest to each other: over the window, and in both of its halves.

    The halves are looked at so that a body that bounces off, whose mean relative velocity is zero
    for a moment, is not taken for one that rests.

    Args:
        now: Velocities.
        settings: Thresholds.
        diagonal: Image diagonal, pixels.

    Returns:
        (M, M) bool; false where a velocity is unknown.
    """
    early = np.linalg.norm(now.early[:, None] - now.early[None], axis=2)
    late = np.linalg.norm(now.late[:, None] - now.late[None], axis=2)
    with np.errstate(invalid="ignore"):
        halves = np.maximum(early, late) < settings.still_half * diagonal
        rest: NDArray[np.bool_] = halves & (now.relative_speed < settings.still_speed * diagonal)
    return rest


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


def reindexed(history: History, ids: tuple[int, ...]) -> History:
    """A history of other objects: those that are new have no samples, others keep theirs."""
    if ids == history.ids:
        return history
    t, m = len(history.times), len(ids)
    support, free = np.full((t, m, FAN), np.nan), np.zeros((t, m, FAN), dtype=bool)
    separation, depth = np.full((t, m, m), np.nan), np.full((t, m), np.nan)
    new = [i for i, x in enumerate(ids) if x in history.ids]
    old = [history.ids.index(ids[i]) for i in new]
    support[:, new], free[:, new] = history.support[:, old], history.free[:, old]
    depth[:, new] = history.depth[:, old]
    separation[np.ix_(range(t), new, new)] = history.separation[np.ix_(range(t), old, old)]
    return History(ids, history.times, support, free, separation, depth)


def comparable(history: History, mind: Mind) -> History:
    """A history without the samples of objects whose regions have changed their nature since."""
    of = tracks(mind).of
    changed = np.array([of[i].changed_at if i in of else -1.0 for i in history.ids])
    old = history.times[:, None] < changed[None, :] - 1e-9
    if not old.any():
        return history
    either = old[:, :, None] | old[:, None, :]
    return replace(
        history,
        support=np.where(old[:, :, None], np.nan, history.support),
        separation=np.where(either, np.nan, history.separation),
    )


def only(history: History, kept: NDArray[np.bool_]) -> History:
    """The samples of a history for which `kept` is true."""
    if kept.all():
        return history
    return History(
        history.ids,
        history.times[kept],
        history.support[kept],
        history.free[kept],
        history.separation[kept],
        history.depth[kept],
    )


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
