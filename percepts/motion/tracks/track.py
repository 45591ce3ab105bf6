"""What is remembered of each moving object between frames: identity, motion, shape, what hides it.

Masks are kept as one share for each superpixel; what another object hides is kept as a map, since
it moves with its own motion under an occluder that moves with another.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import dist, hypot
from types import MappingProxyType

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features._superpixels_jit import carry_shares
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers.affine import Affine, Doubles
from visup.percepts.motion.layers.affine_rate import AffineRate

Indices = NDArray[np.int64]
BRISK_S = 0.25  # baselines up to which a velocity is that of the moment, seconds
SMOOTH_S = 0.2  # time over which a velocity seen from frame to frame is averaged, seconds
PATH_S = 2.8  # how long the way of a track is remembered, seconds
PACE_S = 1.0  # time over which the pace of a track follows its measured velocity, seconds
EVERY = 4  # of the pixels of a cell, one in so many is asked where it comes from
FADE = 0.4  # share of the memory of where a track was that is left after a second


def _nothing() -> Mapping[int, float]:
    return MappingProxyType({})


def _no_rates() -> Mapping[int, AffineRate]:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True, eq=False)
class PartMotion:
    """The motion of one rigid part, by baseline.

    Attributes:
        rates: By baseline in frames.
        support: How many constraints it rested on last.
    """

    rates: Mapping[int, AffineRate] = field(default_factory=_no_rates)
    support: float = 0.0

    def predicted(self, lag: int, span_s: float, where: tuple[float, float]) -> Affine:
        """Its displacement over a baseline, from the best rate that is known."""
        best = self.best_rate(where)
        if best is None:
            return Affine(np.zeros((2, 3)))
        own = self.rates.get(lag)
        newest = max(r.time for r in self.rates.values())
        rate = own if own is not None and newest - own.time < 0.5 else best
        return Affine(rate.matrix * span_s, rate.sigma * span_s)

    def best_rate(self, where: tuple[float, float]) -> AffineRate | None:
        """The surest rate that agrees with those over shorter baselines at a position."""
        if not self.rates:
            return None
        newest = max(r.time for r in self.rates.values())
        fresh = [r for r in self.rates.values() if newest - r.time < 0.5 + 0.25 * r.span_s]
        fresh.sort(key=lambda r: r.span_s)
        best = fresh[0]
        for rate in fresh[1:]:
            gap = float(np.hypot(*(rate.velocity(where) - best.velocity(where))))
            if gap < 3 * (rate.sigma + best.sigma) and rate.sigma < best.sigma:
                best = rate
        return best

    def with_rate(self, lag: int, rate: AffineRate, support: float) -> PartMotion:
        """The same motion with one rate renewed."""
        return PartMotion(MappingProxyType({**self.rates, lag: rate}), support)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One moving object.

    Attributes:
        key: Number within the segmenter, from 1, in order of birth.
        id: Public number from 1, 0 until confirmed.
        born: Seconds.
        seen: Seconds when it was last visible.
        share: (count,) float32, probability that each superpixel shows it.
        hidden: (h, w) float32, where others hide it; None when they do not.
        motions: Of its rigid parts; an arm has several.
        whole: The one motion that suits all parts best.
        recent: (count,) float32, where it was of late: parts that turn up there are its own.
        evidence: How much better its own motion explains it than the background's did (log
            likelihood, running sum).
        frames: In how many frames it was visible.
        centre: (x, y) centroid when last visible, working pixels.
        mostly_hidden: Whether others hide a third of it or more.
        pace: (vx, vy) when it was last in full view, pixels per second.
        drift: (x, y) of motion not yet applied to `hidden`, pixels.
        own: (count,) float32, where it would be by its own motion alone.
        whole_map: (h, w) float32, the same by pixels while others hide a part of it, or None.
        body: (count,) bool, where it prevails, if by less than half, and objects are surer than the
            background; None before that was seen.
        path: (time, x, y) of its displacement since birth, over the longest baseline.
        apart: Seconds for which it was seen apart from other tracks, by key.
        alike: Votes that it is one with another track, by key.
        gone: (x, y) of its displacement since birth against the background, pixels.
        way: Length of the way it took to get there, pixels.
        borne: Displacement over a longer baseline as a share of the way it took meanwhile, by
            octave of the baseline.
        explained: Share of its points that the background explains, by octave of the baseline.
        moving_area: Its area when the background last did not explain it, working pixels.
    """

    key: int
    id: int
    initiated: float
    last_seen: float
    share: Floats
    occluded: Floats | None = None
    motions: tuple[PartMotion, ...] = ()
    whole_rate: AffineRate | None = None
    recent_share: Floats | None = None
    evidence: float = 0.0
    frames: int = 0
    centre: tuple[float, float] = (0.0, 0.0)
    mostly_occluded: bool = False
    unoccluded_velocity: tuple[float, float] = (0.0, 0.0)
    pending_shift: tuple[float, float] = (0.0, 0.0)
    predicted_share: Floats | None = None
    predicted_map: Floats | None = None
    core: NDArray[np.bool_] | None = None
    path: tuple[tuple[float, float, float], ...] = ()
    separate_s: Mapping[int, float] = field(default_factory=_nothing)
    merge_votes: Mapping[int, float] = field(default_factory=_nothing)
    displacement: tuple[float, float] = (0.0, 0.0)
    path_length: float = 0.0
    long_baseline_course: Mapping[int, float] = field(default_factory=_nothing)
    background_fit: Mapping[int, float] = field(default_factory=_nothing)
    moving_area: float = 0.0

    def predicted(self, lag: int, span_s: float) -> tuple[Affine, ...]:
        """The displacement of each part over a baseline.

        An object that stopped or turned within the baseline has not moved by its rate times the
        time: then the way that it was seen to go is taken.
        """
        parts = [m.predicted(lag, span_s, self.centre) for m in self.motions]
        own = self.motions[0].rates.get(lag)
        measured_now = bool(self.path) and own is not None and own.time > self.path[-1][0] - 1e-6
        if len(self.path) > 1 and not measured_now:
            went = self._went(span_s)
            if dist(parts[0].shift(self.centre), went) > 1 + 0.1 * hypot(*went):
                matrix = np.zeros((2, 3))
                matrix[:, 2] = went
                parts[0] = Affine(matrix)
        return tuple(parts)

    def _went(self, span_s: float) -> tuple[float, float]:
        """Displacement over the last so many seconds, (x, y) pixels; at its rate before birth."""
        now, sought = self.path[-1], self.path[-1][0] - span_s
        after = bisect_left(self.path, (sought,))
        around = self.path[max(after - 1, 0) : after + 1]
        then = min(around, key=lambda p: abs(sought - p[0]))
        rate = span_s / max(now[0] - then[0], 1e-6)
        return (now[1] - then[1]) * rate, (now[2] - then[2]) * rate

    def instant_velocity(self) -> Doubles:
        """Velocity over the shortest baselines, (vx, vy) pixels per second."""
        if not self.motions or not self.motions[0].rates:
            return np.zeros(2)
        newest = max(r.time for r in self.motions[0].rates.values())
        fresh = [r for r in self.motions[0].rates.values() if newest - r.time < 0.3]
        fresh.sort(key=lambda r: r.span_s)
        best = fresh[0]
        for rate in fresh[1:]:
            gap = float(np.hypot(*(rate.velocity(self.centre) - best.velocity(self.centre))))
            if rate.span_s < BRISK_S and gap < 3 * best.sigma and rate.sigma < best.sigma:
                best = rate
        return best.velocity(self.centre)

    def velocity(self, where: tuple[float, float]) -> Doubles:
        """(vx, vy) at a position, pixels per second.

        What was measured from one frame to the next is averaged over the last few.
        """
        rate = self.best_rate()
        if rate is None:
            return np.zeros(2)
        now = rate.velocity(where)
        if len(self.motions) > 1 or rate.span_s > SMOOTH_S or len(self.path) < 2:
            return now
        span = min(SMOOTH_S, self.path[-1][0] - self.path[0][0])
        return now - self.instant_velocity() + np.asarray(self._went(span)) / span

    def best_rate(self) -> AffineRate | None:
        """The rate of the whole, or of the only part."""
        if not self.motions:
            return None
        if len(self.motions) > 1 and self.whole_rate is not None:
            return self.whole_rate
        main = max(self.motions, key=lambda m: m.support)
        return main.best_rate(self.centre)


Tracks = tuple[Track, ...]


def predict_tracks(
    tracks: Tracks, flow: Floats, old: Superpixels, new: Superpixels, seconds: float
) -> Tracks:
    """Bring tracks to the next frame.

    What is visible goes with the flow. Where it would be by its own motion is kept as well: if
    another object turns up there, the track is hidden behind it. That map is moved by whole pixels,
    so that it is not blurred by many small moves.

    Args:
        tracks: The tracks as of the frame before.
        flow: (h, w, 2) float32, from the newest image back to the last.
        old: Superpixels of the frame before.
        new: Superpixels of the newest frame.
        seconds: Between the two frames.

    Returns:
        The tracks as predicted for the newest image.
    """
    if not tracks:
        return ()
    before = [t.share for t in tracks]
    before += [t.share if t.recent_share is None else t.recent_share for t in tracks]
    shares = np.stack(before, axis=1).astype(np.float32, copy=False)
    found = carry_shares(
        old.labels, new.labels, flow, np.ascontiguousarray(shares), new.area, EVERY
    )
    moved = np.ascontiguousarray(found.T)
    return tuple(
        _predicted(t, share, np.float32(FADE**seconds) * recent, old, new, seconds)
        for t, share, recent in zip(tracks, moved, moved[len(tracks) :], strict=False)
    )


def _predicted(
    track: Track, share: Floats, recent: Floats, old: Superpixels, new: Superpixels, seconds: float
) -> Track:
    """A track where it is expected, given what of it and of its past comes to each superpixel."""
    drift = np.asarray(track.pending_shift) + np.asarray(track.unoccluded_velocity) * seconds
    pixels = np.round(drift)
    rest = drift - pixels
    step_xy = track.instant_velocity() * seconds
    last = track.path[-1] if track.path else (track.initiated, 0.0, 0.0)
    here = (last[0] + seconds, last[1] + float(step_xy[0]), last[2] + float(step_xy[1]))
    path = tuple(p for p in track.path if here[0] - p[0] < PATH_S)
    by = int(pixels[0]), int(pixels[1])
    # Where an occluder comes, an object fades before it is hidden: what it still has counts.
    body = track.share > 0.5
    if track.core is not None:
        body = body | track.core
    whole = None
    if track.occluded is None:
        own = new.shifted(old, body, by)
    else:
        whole = shift_map(np.maximum(old.paint(body), track.occluded), *by)
        own = new.mean(whole)
    return replace(
        track,
        share=share,
        recent_share=np.maximum(recent, share),
        occluded=None if track.occluded is None else shift_map(track.occluded, *by),
        predicted_share=own,
        predicted_map=whole,
        core=None,
        path=(*(path or (last,)), here),
        pending_shift=(float(rest[0]), float(rest[1])),
    )


def shift_map(image: Floats, dx: int, dy: int) -> Floats:
    """An image moved by whole pixels, zeros coming in."""
    if dx == 0 and dy == 0:
        return image
    matrix = np.array([[1, 0, dx], [0, 1, dy]], dtype=np.float64)
    size = (image.shape[1], image.shape[0])
    return np.asarray(cv2.warpAffine(image, matrix, size, flags=cv2.INTER_NEAREST))


def label_priors(tracks: Sequence[Track], cells: Superpixels) -> Floats:
    """Label shares expected in the newest image.

    Args:
        tracks: Carried tracks.
        cells: Superpixels of the newest image.

    Returns:
        (count, K + 2) float32: background, each track, and unknown motion (zero).
    """
    out = np.zeros((cells.count, len(tracks) + 2), dtype=np.float32)
    for k, track in enumerate(tracks, 1):
        out[:, k] = track.share
    for track in tracks:
        if track.occluded is not None:
            # An occluder is expected no further than its own motion takes it.
            there = cells.mean(track.occluded) > 0.3
            for k, other in enumerate(tracks, 1):
                if other is not track and other.predicted_share is not None:
                    out[there, k] = np.minimum(out[there, k], other.predicted_share[there])
    free = np.clip(1 - out.sum(axis=1), 0, 1)
    for k, track in enumerate(tracks, 1):
        if track.occluded is not None:
            # What was hidden is expected back where its occluder has gone.
            out[:, k] += free * np.maximum(cells.mean(track.occluded) - out[:, k], 0)
    out /= np.maximum(out.sum(axis=1, keepdims=True), 1)
    out[:, 0] = np.clip(1 - out.sum(axis=1), 0, 1)
    return sharpen(out)


def sharpen(shares: Floats) -> Floats:
    """Push label shares (count, K) towards their winner, lest beliefs fade by being carried."""
    squared = shares * shares
    return np.asarray(squared / np.maximum(squared.sum(axis=1, keepdims=True), 1e-6))


def update_track(
    track: Track,
    posterior: Floats,
    winner: Indices,
    label: int,
    cells: Superpixels,
    now: float,
    least: float,
) -> Track:
    """Update a track after the posterior is known.

    Args:
        track: The carried track.
        posterior: (count, K) float32, shares of the labels.
        winner: (count,) the label that has each superpixel.
        label: The track's label.
        cells: The superpixels.
        now: Seconds.
        least: Least visible area to count as seen, working pixels.

    Returns:
        The track; what others took over is hidden, what is seen to be background is forgotten.
    """
    mine, share = winner == label, posterior[:, label]
    area = float(cells.area[mine].sum())
    seen = area >= least
    centre = track.centre
    if seen:
        where = (cells.centre[mine] * cells.area[mine, None]).sum(axis=0) / area
        centre = (float(where[0]), float(where[1]))
    pace = track.unoccluded_velocity
    rate = track.best_rate()
    if seen and not track.mostly_occluded and rate is not None:
        # Slowly, lest the first signs of an occluder be taken for the object's own motion.
        follow = 1.0 if track.frames < 15 else min(1.0, (now - track.last_seen) / PACE_S)
        velocity = np.asarray(pace) * (1 - follow) + rate.velocity(centre) * follow
        pace = (float(velocity[0]), float(velocity[1]))
    taken = (winner > 0) & ~mine
    covered = taken & (track.predicted_share > 0.5 if track.predicted_share is not None else False)
    lost = cells.area[covered].sum()
    # A cell or two beside another object is no occlusion; nor is what was never told remembered.
    much = track.id > 0 and lost > max(0.05 * area, 0.3 * least)
    hidden = cells.paint(covered) if much else None
    if much and track.predicted_map is not None and track.predicted_share is not None:
        # By pixels, for cells are others in each frame: by those it would wear away at its edges.
        hidden = track.predicted_map * cells.paint(taken & (track.predicted_share > 0))
    return replace(
        track,
        share=share,
        recent_share=share if track.recent_share is None else np.maximum(track.recent_share, share),
        occluded=hidden,
        core=mine & (posterior[:, 0] < 0.5),
        last_seen=now if seen else track.last_seen,
        frames=track.frames + int(seen),
        centre=track.centre if track.mostly_occluded else centre,
        mostly_occluded=bool(lost > 0.5 * area),
        unoccluded_velocity=pace,
    )
