"""What is remembered of each moving object between frames: identity, motion, shape, appearance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.image import Floats
from visup.percepts.motion.layers import Affine, Doubles


@dataclass(frozen=True, slots=True, eq=False)
class Rate:
    """A layer's motion per second as measured over one baseline.

    Attributes:
        matrix: (2, 3) float64, pixels per second, affine in position.
        sigma: Standard deviation, pixels per second.
        time: When it was measured, seconds.
        span_s: Baseline, seconds.
    """

    matrix: Doubles
    sigma: float
    time: float
    span_s: float


NO_RATES = MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One moving object.

    Attributes:
        key: Number within the segmenter, from 1, in order of birth.
        id: Public number from 1, 0 until confirmed.
        born: Seconds.
        seen: Seconds when it was last visible.
        visible: (h, w) float32, probability that the pixel shows it.
        memory: (h, w) float32, the same with what others hide of it.
        rates: By baseline in frames.
        evidence: How much better its own motion explains it than the background's did (log
            likelihood, running sum).
        frames: In how many frames it was visible.
        drift: (x, y) of motion not yet applied to the memory, pixels.
    """

    key: int
    id: int
    born: float
    seen: float
    visible: Floats
    memory: Floats
    rates: Mapping[int, Rate] = field(default_factory=lambda: NO_RATES)
    evidence: float = 0.0
    frames: int = 0
    drift: tuple[float, float] = (0.0, 0.0)

    def predicted(self, lag: int, span_s: float) -> Affine:
        """Its displacement over a baseline, from the best rate that is known."""
        rate = self.rates.get(lag)
        chosen = rate if rate is not None else self.best_rate()
        if chosen is None:
            return Affine(np.zeros((2, 3)))
        return Affine(chosen.matrix * span_s, chosen.sigma * span_s)

    def best_rate(self) -> Rate | None:
        """The rate over the longest baseline that agrees with the shorter ones."""
        if not self.rates:
            return None
        newest = max(r.time for r in self.rates.values())
        fresh = sorted(
            (r for r in self.rates.values() if newest - r.time < 0.5 + 0.25 * r.span_s),
            key=lambda r: r.span_s,
        )
        best = fresh[0]
        where = self.centre()
        for rate in fresh[1:]:
            gap = float(np.hypot(*(velocity_at(rate, where) - velocity_at(best, where))))
            if gap < 3 * (rate.sigma + best.sigma):
                best = rate if rate.sigma < best.sigma else best
        return best

    def centre(self) -> tuple[float, float]:
        """Centroid of what is visible, or of what is remembered; working pixels."""
        for shape in (self.visible, self.memory):
            m = cv2.moments((shape > 0.5).astype(np.uint8), binaryImage=True)
            if m["m00"] > 0:
                return m["m10"] / m["m00"], m["m01"] / m["m00"]
        return shape.shape[1] / 2, shape.shape[0] / 2

    def with_rate(self, lag: int, rate: Rate) -> Track:
        """The same track with one rate renewed."""
        return replace(self, rates=MappingProxyType({**self.rates, lag: rate}))


def velocity_at(rate: Rate, where: tuple[float, float]) -> Doubles:
    """(vx, vy) of a rate at a position, pixels per second."""
    return np.asarray(rate.matrix[:, :2] @ np.asarray(where) + rate.matrix[:, 2])


def carry(track: Track, flow: Floats, grid: Floats, seconds: float) -> Track:
    """Bring a track's masks to the next frame.

    What is visible goes with the flow; what is hidden goes with the object's own motion, by whole
    pixels so that it is not blurred by being moved again and again.

    Args:
        track: The track as of the frame before.
        flow: (h, w, 2) float32, from the newest image back to the one before.
        grid: (h, w, 2) float32 positions of pixels.
        seconds: Between the two frames.

    Returns:
        The track with masks predicted for the newest image.
    """
    visible = cv2.remap(track.visible, grid + flow, None, cv2.INTER_LINEAR)
    rate = track.best_rate()
    step = velocity_at(rate, track.centre()) * seconds if rate is not None else np.zeros(2)
    drift = np.asarray(track.drift) + step
    whole = np.round(drift)
    memory = shift(track.memory, int(whole[0]), int(whole[1]))
    rest = drift - whole
    return replace(
        track,
        visible=np.asarray(visible, dtype=np.float32),
        memory=np.maximum(memory, visible).astype(np.float32),
        drift=(float(rest[0]), float(rest[1])),
    )


def shift(image: Floats, dx: int, dy: int) -> Floats:
    """An image moved by whole pixels, zeros coming in."""
    if dx == 0 and dy == 0:
        return image
    matrix = np.array([[1, 0, dx], [0, 1, dy]], dtype=np.float64)
    size = (image.shape[1], image.shape[0])
    return np.asarray(cv2.warpAffine(image, matrix, size, flags=cv2.INTER_NEAREST))


def priors(tracks: tuple[Track, ...], shape: tuple[int, int]) -> Floats:
    """Label shares expected in the newest image.

    Args:
        tracks: Carried tracks.
        shape: (h, w).

    Returns:
        (K + 2, h, w) float32: background, each track, and unknown motion (zero).
    """
    out = np.zeros((len(tracks) + 2, *shape), dtype=np.float32)
    for k, track in enumerate(tracks, 1):
        out[k] = track.visible
    free = np.clip(1 - out.sum(axis=0), 0, 1)
    for k, track in enumerate(tracks, 1):
        # What was hidden is expected back where its occluder has gone.
        hidden = np.maximum(track.memory - track.visible, 0)
        out[k] += free * hidden
    total = out.sum(axis=0)
    out /= np.maximum(total, 1)
    out[0] = np.clip(1 - out.sum(axis=0), 0, 1)
    return out


def sharpen(shares: Floats) -> Floats:
    """Push label shares towards their winner, so that beliefs do not fade by being carried.

    Args:
        shares: (K, h, w) float32, summing to 1 over K.

    Returns:
        The same shape.
    """
    squared = shares * shares
    return np.asarray(squared / np.maximum(squared.sum(axis=0), 1e-6), dtype=np.float32)


def remember(track: Track, visible: Floats, others: Floats, now: float, least: float) -> Track:
    """Update a track's masks after the posterior is known.

    Args:
        track: The carried track.
        visible: (h, w) float32, its posterior.
        others: (h, w) float32, posterior of all other objects.
        now: Seconds.
        least: Least visible area to count as seen, working pixels.

    Returns:
        The track with what is hidden by others kept, and what is seen to be background dropped.
    """
    memory = np.where(others > 0.5, track.memory, visible).astype(np.float32)
    seen = float(np.count_nonzero(visible > 0.5)) >= least
    if not seen:
        # Nothing of it is in view: the memory of the whole is all there is.
        memory = np.maximum(memory, 0.98 * track.memory).astype(np.float32)
    return replace(
        track,
        visible=visible,
        memory=memory,
        seen=now if seen else track.seen,
        frames=track.frames + int(seen),
    )


def overlap(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    """Share of `a` that lies in `b`, 0 to 1."""
    size = int(a.sum())
    return float((a & b).sum()) / size if size else 0.0
