"""Relations of plain boxes over frames: RCC-8, QTC, direction, distance and approach.

For users without an agent: `watch_boxes` updates the beliefs with the boxes of one frame. The evaluation and
its noise thresholds are those of an agent, which measures motion on outlines instead.

>>> beliefs = Boxes()
>>> for t in range(75):
...     boxes = np.array([[100.0, 100, 40, 40], [300 - 2.5 * t, 100, 40, 40]])
...     beliefs = watch_boxes(beliefs, (1, 2), boxes, t / 25)
>>> beliefs.rcc8_of(1, 2), beliefs.qtc_of(1, 2), beliefs.approach_of(1, 2)
('partially_overlapping', '0-', 'converging')
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from visup.rules.geometry._fit_jit import binned_trends, slope_noise
from visup.rules.geometry.pairs import pairs, reindexing
from visup.rules.geometry.regions import RCC8, Floats
from visup.rules.relations._thresholds_jit import box_gaps, classify_boxes, moving_signs
from visup.rules.relations.direction import CONVERSE as DIRECTION_CONVERSE
from visup.rules.relations.direction import DIRECTION_NAMES
from visup.rules.relations.distance import CLASS_NAMES
from visup.rules.relations.qtc import text
from visup.rules.relations.rcc8 import CONVERSE, from_signs
from visup.rules.relations.rows import AWAY, BOX_ROWS, DIRECTION, DISTANCE, ORDER, SIDE
from visup.rules.relations.thresholds import ThresholdSettings, least_durations, limits
from visup.rules.smoothing.ema import exponential_mean
from visup.rules.smoothing.hysteresis import (
    UNKNOWN,
    Codes,
    HysteresisState,
    advance,
    unknown_states,
)

APPROACH = BOX_ROWS
APPROACH_NAMES = ("converging", "keeping_distance", "diverging")


@dataclass(frozen=True, slots=True)
class BoxSettings:
    """Settings of `watch_boxes`.

    Attributes:
        thresholds: Thresholds.
        diagonal: Image diagonal, pixels, unit of lengths in `thresholds`.
        window_s: Length of the window for line fits, seconds.
        samples: Maximum samples in the window.
        bins: Maximum number of means of neighbouring samples for a line fit.
        fit_share: Weight of a fit's own deviation where it exceeds that of `noise_px`, since from so few
            means it is known only to about a third. With 5 sigmas to enter, a trend must exceed 5 deviations
            of the noise and 3 of its own fit.
    """

    thresholds: ThresholdSettings = field(default_factory=ThresholdSettings)
    diagonal: float = 800.0
    window_s: float = 1.5
    samples: int = 64
    bins: int = 8
    fit_share: float = 0.6


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """The beliefs about boxes; immutable.

    Attributes:
        ids: (M,) increasing.
        time: Seconds of the last frame.
        times: Seconds of the samples.
        samples: One row each: gaps of the P pairs, then x and y of the M centres, pixels.
        smoothed: (M, 4) the smoothed boxes, from which states are derived.
        hysteresis: (JUDGED + 1, P) states; the last row is the approach.
        gap: (P,) pixels, negative the depth of overlap.
        rate: (P,) approach rate: trend of the gap, pixels per second, negative when closing.
        rate_sigma: (P,) its standard deviation.
        velocity: (M, 2) pixels per second.
    """

    ids: tuple[int, ...] = ()
    time: float = 0.0
    times: tuple[float, ...] = ()
    samples: tuple[Floats, ...] = ()
    smoothed: Floats = field(default_factory=lambda: np.zeros((0, 4)))
    hysteresis: HysteresisState = field(
        default_factory=lambda: unknown_states((BOX_ROWS + 1, 0), 0.0)
    )
    gap: Floats = field(default_factory=lambda: np.zeros(0))
    rate: Floats = field(default_factory=lambda: np.zeros(0))
    rate_sigma: Floats = field(default_factory=lambda: np.zeros(0))
    velocity: Floats = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def rcc8(self) -> Codes:
        """(P,) codes into `RCC8`."""
        return from_signs(self.hysteresis.state[ORDER])

    def rcc8_of(self, a: int, b: int) -> str | None:
        """The RCC-8 relation of a to b, or None while unknown."""
        k, swapped = self._pair(a, b)
        code = int(self.rcc8[k])
        return _name(RCC8, CONVERSE[code] if swapped else code)

    def qtc_of(self, a: int, b: int, *, sides: bool = False) -> str | None:
        """QTC-B of the pair, such as '-0', or QTC-C with `sides`, such as '-0+0'."""
        k, swapped = self._pair(a, b)
        order = slice(None, None, -1) if swapped else slice(None)
        codes = [int(c) for c in self.hysteresis.state[AWAY, k][order]]
        if sides:
            codes += [int(c) for c in self.hysteresis.state[SIDE, k][order]]
        return text(*codes)

    def direction_of(self, a: int, b: int) -> str | None:
        """The direction of a as seen from b, or None while unknown."""
        k, swapped = self._pair(a, b)
        code = int(self.hysteresis.state[DIRECTION, k])
        return _name(DIRECTION_NAMES, DIRECTION_CONVERSE[code] if swapped else code)

    def distance_of(self, a: int, b: int) -> str | None:
        """Class of the distance, or None while unknown."""
        return _name(CLASS_NAMES, self.hysteresis.state[DISTANCE, self._pair(a, b)[0]])

    def approach_of(self, a: int, b: int) -> str | None:
        """Whether the two converge, keep their distance or diverge, or None while unknown."""
        return _name(APPROACH_NAMES, self.hysteresis.state[APPROACH, self._pair(a, b)[0]])

    def _pair(self, a: int, b: int) -> tuple[int, bool]:
        i, j = self.ids.index(a), self.ids.index(b)
        low, high, m = min(i, j), max(i, j), len(self.ids)
        return low * m - low * (low + 1) // 2 + high - low - 1, i > j


def watch_boxes(
    before: Boxes,
    ids: tuple[int, ...],
    boxes: Floats,
    now: float,
    settings: BoxSettings | None = None,
) -> Boxes:
    """Update the beliefs with one frame.

    Args:
        before: The previous beliefs; `Boxes()` at first.
        ids: (M,) ids of the boxes, increasing.
        boxes: (M, 4) float: x, y, width, height, pixels; NaN for known but invisible objects.
        now: Seconds.
        settings: Settings; by default for an image of 640 x 480.

    Returns:
        The new beliefs.
    """
    s = settings or DEFAULT
    beliefs = before if ids == before.ids else _realigned(before, ids, now)
    m, p = len(ids), len(pairs(len(ids))[0])
    boxes = np.ascontiguousarray(boxes, dtype=float)
    gap = box_gaps(boxes)
    smoothed = exponential_mean(
        beliefs.smoothed, boxes, now - beliefs.time, 6.0 * s.thresholds.noise_px
    )
    centres = boxes[:, :2] + 0.5 * boxes[:, 2:]
    times, samples = _window(beliefs, np.concatenate([gap, centres.T.ravel()]), now, s)
    seconds = np.array(times)
    slope, sigma = _fit(seconds, np.stack(samples), s)
    # Deviation of a trend due to edge noise, for one coordinate and for a gap between two edges.
    noise = slope_noise(seconds, s.thresholds.noise_px)
    velocity = slope[p:].reshape(2, m).T.copy()
    spread = np.maximum(noise, s.fit_share * sigma[p:].reshape(2, m).max(axis=0))
    thresholds, state = s.thresholds, beliefs.hysteresis.state
    bounds = limits(thresholds, s.diagonal)
    codes = np.empty((BOX_ROWS + 1, p), dtype=np.int8)
    classify_boxes(state, smoothed, velocity, spread, bounds, codes)
    rate, rate_sigma = slope[:p], np.maximum(np.sqrt(2.0) * noise, s.fit_share * sigma[:p])
    codes[APPROACH] = moving_signs(rate, rate_sigma, state[APPROACH], bounds[-4:])
    hysteresis = advance(beliefs.hysteresis, codes, now, _minimum_durations(thresholds))
    return Boxes(ids, now, times, samples, smoothed, hysteresis, gap, rate, rate_sigma, velocity)


DEFAULT = BoxSettings()


@lru_cache(maxsize=8)
def _minimum_durations(thresholds: ThresholdSettings) -> Floats:
    return np.append(least_durations(thresholds), [[thresholds.motion_minimum_s]], axis=0)


def _window(
    beliefs: Boxes, row: Floats, now: float, s: BoxSettings
) -> tuple[tuple[float, ...], tuple[Floats, ...]]:
    """Samples of the window including this one; samples that follow too closely are skipped."""
    begin = next(
        (k for k, t in enumerate(beliefs.times) if t > now - s.window_s - 1e-6), len(beliefs.times)
    )
    times, samples = beliefs.times[begin:], beliefs.samples[begin:]
    if times and now - times[-1] < s.window_s / s.samples - 1e-6:
        return times, samples
    return (*times, now), (*samples, row)


def _fit(times: Floats, samples: Floats, s: BoxSettings) -> tuple[Floats, Floats]:
    """Trends and the deviations of their fits; NaN while the window is too short."""
    if len(times) < 6 or times[-1] - times[0] < 0.6 * s.window_s:
        unknown = np.full(samples.shape[1], np.nan)
        return unknown, unknown
    return binned_trends(times, samples, s.bins)


def _realigned(before: Boxes, ids: tuple[int, ...], now: float) -> Boxes:
    """The beliefs realigned to other objects; new ones have no samples and no states."""
    rows, numbers = reindexing(before.ids, ids)
    p, m = len(before.gap), len(before.ids)
    columns = np.concatenate(
        [numbers, np.where(rows < 0, -1, p + rows), np.where(rows < 0, -1, p + m + rows)]
    )
    samples = tuple(
        np.where(columns < 0, np.nan, np.append(row, np.nan)[columns]) for row in before.samples
    )
    smoothed = np.append(before.smoothed, np.full((1, 4), np.nan), axis=0)[rows]
    hysteresis = before.hysteresis.select(numbers, now)
    return Boxes(ids, before.time, before.times, samples, smoothed, hysteresis)


def _name(names: tuple[str, ...], code: int) -> str | None:
    return None if code == UNKNOWN else names[code]
