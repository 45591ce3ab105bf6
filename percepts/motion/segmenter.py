"""Seeing motion: frames in, regions out, causally (paper, section 3).

Region and boundary work together: constraints are gathered where the image has structure, layers
of motion are fitted to them, superpixels between image edges are given to the layer that explains
them best, and the outlines so found say which constraints a layer may use in the next frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Directive, Frame, Region
from visup.percepts.motion.appearance import appearance
from visup.percepts.motion.background import Background, find_background
from visup.percepts.motion.constraints import (
    Constraints,
    Points,
    find_points,
    from_flow,
    track,
)
from visup.percepts.motion.contour import Outline, outline
from visup.percepts.motion.dense import CLIP, flow_back, gather, spread
from visup.percepts.motion.discovery import discover, rate_of, same_motion, unexplained
from visup.percepts.motion.image import Floats, History, WorkImage, prepare
from visup.percepts.motion.layers import Affine, distances, fit_affine
from visup.percepts.motion.settings import MotionSettings
from visup.percepts.motion.superpixels import Superpixels, superpixels
from visup.percepts.motion.tracking import (
    Rate,
    Track,
    carry,
    overlap,
    priors,
    remember,
    sharpen,
    velocity_at,
)

Measured = tuple[Constraints, Background]


class MotionSegmenter:
    """Finds and follows what moves by itself; one per video.

    Args:
        settings: What can be set.
    """

    def __init__(self, settings: MotionSettings | None = None) -> None:
        self.settings = settings or MotionSettings()
        self._engine = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_FAST)
        self._reset()

    def _reset(self) -> None:
        self._history = History(max(self.settings.lags_s) * 1.1)
        self._tracks: tuple[Track, ...] = ()
        self._camera: dict[int, Affine] = {}
        self._fixed_until = 0.0
        self._count = 0
        self._born = 0
        self._ids = 0
        self._size = (0, 0)

    def step(self, frame: Frame, directives: Sequence[Directive] = ()) -> tuple[Region, ...]:
        """Segment one frame.

        Args:
            frame: The next frame of the video; (H, W), (H, W, 1) or (H, W, 3) uint8.
            directives: 'expect_regions', 'look_at' and 'ignore' are obeyed.

        Returns:
            The regions, by id. None in the first frame, or when the image size has changed.
        """
        if frame.size != self._size:
            self._reset()
            self._size = frame.size
        image = prepare(frame, self.settings.work_size)
        self._history.push(image)
        self._count += 1
        if len(self._history) < 2:
            return ()
        noise = self.settings.noise
        points = find_points(image, self.settings.cell, noise)
        old = self._history.back(1)
        flow = flow_back(image.grey, old.grey, self._engine)
        grid = _grid(image.shape)
        tracks = tuple(carry(t, flow, grid, image.time - old.time) for t in self._tracks)
        prior = sharpen(priors(tracks, image.shape))
        owner = prior.argmax(axis=0)
        measured = self._measure(points, flow, owner, tracks, image)
        tracks = self._fit(tracks, measured, owner, image.time)
        tracks = self._discover(tracks, measured, owner, image)
        prior = sharpen(priors(tracks, image.shape))
        likelihood, has = self._explain(points, tracks, measured, prior)
        cells = superpixels(image, self.settings.cell, 8.0)
        posterior = self._label(cells, points, likelihood, has, prior)
        tracks = self._update(tracks, posterior, points, likelihood, image.time)
        tracks = self._absorb(tracks, posterior, image.time)
        tracks = self._merge(tracks, measured, posterior.argmax(axis=0), image.time)
        self._tracks = self._bury(tracks, image.time)
        return self._report(directives, image.scale)

    def _measure(
        self,
        points: Points,
        flow: Floats,
        owner: NDArray[np.int64],
        tracks: tuple[Track, ...],
        image: WorkImage,
    ) -> list[Measured]:
        """Constraints and background over one frame and over one longer baseline, in turn."""
        noise = self.settings.noise
        lags = self._history.lags(self.settings.lags_s)
        outside = _outside(points, owner)
        chosen = [1] + ([lags[1 + self._count % (len(lags) - 1)]] if len(lags) > 1 else [])
        out: list[Measured] = []
        for lag in chosen:
            old = self._history.back(lag)
            span = image.time - old.time
            camera = self._camera.get(lag, Affine(np.zeros((2, 3))))
            if lag == 1:
                c = from_flow(points, flow, old, image, noise)
            else:
                guess = _expected(points, owner, tracks, camera, lag, span)
                c = track(points, guess, old, image, lag, noise)
            still_too = image.time < self._fixed_until or image.time < 0.5
            bg = find_background(c, outside[c.index], image.shape, camera, still_too, lag)
            if bg.fixed:
                self._fixed_until = image.time + 3 * max(self.settings.lags_s)
            self._camera[lag] = bg.models[0]
            out.append((c, bg))
        return out

    def _fit(
        self,
        tracks: tuple[Track, ...],
        measured: list[Measured],
        owner: NDArray[np.int64],
        now: float,
    ) -> tuple[Track, ...]:
        """Renew each track's motion from the constraints inside its outline."""
        for c, _ in measured:
            x, y = c.xy.astype(np.int64).T
            at = owner[y, x]
            renewed = []
            for k, t in enumerate(tracks, 1):
                weight = (at == k).astype(np.float32)
                fit = fit_affine(c, weight, t.predicted(c.lag, c.span_s))
                if fit.support >= 5:
                    sigma = max(fit.sigma, 0.02) / c.span_s
                    t = t.with_rate(c.lag, Rate(fit.matrix / c.span_s, sigma, now, c.span_s))
                renewed.append(t)
            tracks = tuple(renewed)
        return tracks

    def _explain(
        self, points: Points, tracks: tuple[Track, ...], measured: list[Measured], prior: Floats
    ) -> tuple[Floats, NDArray[np.bool_]]:
        """Log likelihood of every point under every label (the E step)."""
        out = np.zeros((len(points), len(tracks) + 2), dtype=np.float32)
        has = np.zeros(len(points), dtype=bool)
        near = [_near(points, p, self.settings.cell) for p in prior[1:-1]]
        least = -0.5 * self.settings.outlier**2
        for c, bg in measured:
            has[c.index] = True
            out[c.index, 0] += np.maximum(-0.5 * bg.distances(c), 3 * least)
            for k, t in enumerate(tracks, 1):
                model = t.predicted(c.lag, c.span_s)
                fit = -0.5 * distances(
                    model, c, 0.15 + 0.02 * float(np.abs(model.matrix[:, 2]).max() > 3)
                )
                far = ~near[k - 1][c.index]
                out[c.index, k] += np.where(far, 3 * least, np.maximum(fit, 3 * least))
            out[c.index, -1] += least
        return out, has

    def _label(
        self,
        cells: Superpixels,
        points: Points,
        likelihood: Floats,
        has: NDArray[np.bool_],
        prior: Floats,
    ) -> Floats:
        """The dense posterior, (K + 2, h, w) float32."""
        before = np.stack([cells.mean(p) for p in prior], axis=1)
        share, weight = gather(cells, points, likelihood, has, before)
        look = before * appearance(cells, before)
        look /= np.maximum(look.sum(axis=1, keepdims=True), 1e-6)
        trust = np.full(cells.count, self.settings.persistence, dtype=np.float32)
        bias = np.full(cells.count, self.settings.background_bias, dtype=np.float32)
        bias[_border(cells.labels)] *= 10
        out = spread(cells, share, self.settings.evidence * weight, look, trust, bias)
        return np.ascontiguousarray(out[cells.labels].transpose(2, 0, 1))

    def _update(
        self,
        tracks: tuple[Track, ...],
        posterior: Floats,
        points: Points,
        likelihood: Floats,
        now: float,
    ) -> tuple[Track, ...]:
        objects = posterior[1:-1].sum(axis=0)
        least = 0.3 * self._least()
        x, y = points.xy.astype(np.int64).T
        winner = posterior.argmax(axis=0)[y, x]
        out = []
        for k, t in enumerate(tracks, 1):
            gain = np.clip(likelihood[:, k] - likelihood[:, 0], -CLIP, CLIP)[winner == k]
            evidence = min(0.98 * t.evidence + float(gain.sum()), 2000.0)
            t = replace(t, evidence=evidence)
            out.append(remember(t, posterior[k], objects - posterior[k], now, least))
        return tuple(out)

    def _discover(
        self,
        tracks: tuple[Track, ...],
        measured: list[Measured],
        owner: NDArray[np.int64],
        image: WorkImage,
    ) -> tuple[Track, ...]:
        """Add tracks for groups of constraints that no layer explains."""
        out = list(tracks)
        for c, bg in measured:
            free = unexplained(c, bg, out, owner)
            for model, place in discover(c, free, image.shape, self.settings.cell):
                if len(out) >= self.settings.max_regions:
                    break
                taken = sum((t.visible for t in out), np.zeros(image.shape, np.float32))
                share = place * np.clip(1 - taken, 0, 1)
                self._born += 1
                t = Track(self._born, 0, image.time, image.time, share, share)
                out.append(t.with_rate(c.lag, rate_of(model, c, image.time)))
        return tuple(out)

    def _absorb(
        self, tracks: tuple[Track, ...], posterior: Floats, now: float
    ) -> tuple[Track, ...]:
        """Parts that move as no layer does and touch a track join it: limbs, wheels, shadows."""
        unknown = (posterior.argmax(axis=0) == len(tracks) + 1).astype(np.uint8)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(unknown, connectivity=4)
        out = list(tracks)
        for i in range(1, count):
            if stats[i, cv2.CC_STAT_AREA] < self.settings.cell**2:
                continue
            part = labels == i
            host = _host(part, out)
            if host is not None:
                t = out[host]
                both = np.where(part, 1, t.visible).astype(np.float32)
                out[host] = replace(t, visible=both, memory=np.maximum(t.memory, both), seen=now)
        return tuple(out)

    def _merge(
        self,
        tracks: tuple[Track, ...],
        measured: list[Measured],
        owner: NDArray[np.int64],
        now: float,
    ) -> tuple[Track, ...]:
        """Join young tracks to neighbours that move as they do; old ones stay apart."""
        out = list(tracks)
        for j in range(len(tracks) - 1, 0, -1):
            b = tracks[j]
            if now - b.born > self.settings.merge_s:
                continue
            ring = _grown(b.visible > 0.5, 2 * self.settings.cell)
            for i in range(j):
                if not (ring & (tracks[i].visible > 0.5)).any():
                    continue
                views = [same_motion(tracks[i], b, c, owner, (i + 1, j + 1)) for c, _ in measured]
                if True in views and False not in views:
                    a = out[i]
                    both = np.clip(a.visible + out[j].visible, 0, 1)
                    memory = np.maximum(np.maximum(a.memory, out[j].memory), both)
                    evidence = a.evidence + out[j].evidence
                    number = a.id or out[j].id
                    out[i] = replace(
                        a,
                        visible=both,
                        memory=memory,
                        evidence=evidence,
                        id=number,
                        frames=max(a.frames, out[j].frames),
                        born=min(a.born, b.born),
                    )
                    out[j] = replace(out[j], id=-1)
                    break
        return tuple(t for t in out if t.id >= 0)

    def _bury(self, tracks: tuple[Track, ...], now: float) -> tuple[Track, ...]:
        """Drop what was never confirmed and is gone, and what has been hidden too long."""
        out = []
        for t in tracks:
            gone = now - t.seen
            limit = self.settings.memory_s if t.id else 0.2
            if gone <= limit and not (not t.id and t.evidence < -20):
                out.append(t)
        return tuple(out)

    def _least(self) -> float:
        """Least area of a region, working pixels."""
        shape = self._history.back(0).shape
        return self.settings.min_area * shape[0] * shape[1]

    def _report(self, directives: Sequence[Directive], scale: float) -> tuple[Region, ...]:
        now = self._history.back(0).time
        least = self._least() / scale**2
        kept, out = [], []
        for t in self._tracks:
            shape = outline(t.visible, self._size, least) if t.seen == now else None
            ready = now - t.born >= self.settings.confirm_s and t.frames >= 3 and t.evidence > 60
            if shape is not None and not t.id and ready:
                self._ids += 1
                t = replace(t, id=self._ids)
            kept.append(t)
            if shape is not None and t.id:
                out.append(_region(t, shape, scale))
        self._tracks = tuple(kept)
        return tuple(sorted(out, key=lambda r: r.id))


def _grid(shape: tuple[int, int]) -> Floats:
    ys, xs = np.mgrid[: shape[0], : shape[1]]
    return np.stack([xs, ys], axis=-1).astype(np.float32)


def _border(labels: NDArray[np.int32]) -> NDArray[np.int32]:
    """Superpixels at the border of the image: what is seen there more often lies behind."""
    sides = (labels[0], labels[-1], labels[:, 0], labels[:, -1])
    return np.unique(np.concatenate(sides))


def _outside(points: Points, owner: NDArray[np.int64]) -> Floats:
    """1 for points away from all objects, 0 for those in or beside one."""
    taken = cv2.dilate((owner > 0).astype(np.uint8), np.ones((9, 9), np.uint8))
    x, y = points.xy.astype(np.int64).T
    return (1 - taken[y, x]).astype(np.float32)


def _near(points: Points, share: Floats, cell: int) -> NDArray[np.bool_]:
    """Which points a track can reach: in its mask or within two cells of it."""
    size = 4 * cell + 1
    wide = cv2.dilate((share > 0.3).astype(np.uint8), np.ones((size, size), np.uint8))
    x, y = points.xy.astype(np.int64).T
    return np.asarray(wide[y, x] > 0)


def _expected(
    points: Points,
    owner: NDArray[np.int64],
    tracks: tuple[Track, ...],
    camera: Affine,
    lag: int,
    span: float,
) -> Floats:
    """Where each point is expected in the old image, (N, 2) float32."""
    x, y = points.xy.astype(np.int64).T
    at = owner[y, x]
    moved = camera.at(points.xy)
    for k, t in enumerate(tracks, 1):
        mine = at == k
        if mine.any():
            moved[mine] = t.predicted(lag, span).at(points.xy[mine])
    return points.xy - moved


def _grown(mask: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    size = 2 * by + 1
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((size, size), np.uint8)) > 0)


def _host(part: NDArray[np.bool_], tracks: list[Track]) -> int | None:
    """The track whose mask, visible or remembered, a new part mostly touches or covers."""
    ring = cv2.dilate(part.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    ring &= ~part
    for i, t in enumerate(tracks):
        if overlap(ring, t.visible > 0.5) > 0.35 or overlap(part, t.memory > 0.5) > 0.5:
            return i
    return None


def _region(t: Track, shape: Outline, scale: float) -> Region:
    rate = t.best_rate()
    centre = (shape.centroid[0] * scale, shape.centroid[1] * scale)
    speed = velocity_at(rate, centre) / scale if rate is not None else np.zeros(2)
    return Region(
        id=t.id,
        bbox=shape.bbox,
        mask=shape.mask,
        contour=shape.contour,
        centroid=shape.centroid,
        area=shape.area,
        velocity=(float(speed[0]), float(speed[1])),
        velocity_sigma=rate.sigma / scale if rate is not None else float("inf"),
        cut=shape.cut,
        confidence=float(1 - np.exp(-max(t.evidence, 0.0) / 100.0)),
    )
