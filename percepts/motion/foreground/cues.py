"""Cues: features of each superpixel of a frame that separate independent motion from the rest.

No cue decides alone. Each is a number per superpixel, mostly normalised by the frame itself (its median
residual, the residuals along its border), so that a calm view and a wild ride give comparable values; a
classifier learns how to combine them (`perceptron.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.foreground._cues_jit import (
    Labels,
    carried,
    flow_links,
    flow_statistics,
    inside_share,
    sampled_means,
    steepness,
    warp_errors,
)
from visup.percepts.motion.layers.background_motion import BackgroundMotion
from visup.percepts.motion.tracks.measurements import FrameMeasurements

NAMES = (
    *("residual", "residual_by_ground", "residual_by_median", "residual_by_most"),
    *("residual_by_border", "rank_in_border", "misfit_ground", "misfit_flow"),
    *("texture", "flow_steepness", "inside", "way", "straightness", "border_distance"),
    *("median_residual", "most_residual", "ground_speed", "ground_scale", "wide_motion"),
    *("track", "candidate"),
)
"""Names of the cue columns, in order."""

FRAME = 1 / 12  # width of the border, as a share of the image's height
REACH = 0.5  # distance to the border, share of the image, at which the cue saturates
LASTING = 0.8  # weight of the residuals accumulated up to the previous frame
EDGES = (0.3, 0.5, 0.7)  # strengths from which a step of the flow is an edge
BINS = 16  # of each tone channel, for appearance


@dataclass(frozen=True, slots=True, eq=False)
class FrameCues:
    """The cues of one frame's superpixels, and what links them to the previous frame's.

    Attributes:
        values: (count, len(NAMES)) float32.
        area: (count,) float32 pixels.
        tone: (count,) int64, bin of the mean tone of each cell among BINS ** 3.
        ends: (count + 1,) int32, CSR row starts of the neighbours.
        neighbours: (M,) int32, CSR columns.
        affinity: (M,) float32, CSR values.
        here: (L,) int32, cells of this frame, one for each sampled pixel.
        there: (L,) int32, the cells of the previous frame that they come from.
        looked: (count,) float32, sampled pixels of each cell.
        part: (count,) int32, the motion of each cell: 0 the background's, else a track's, or one of its own.
    """

    values: Floats
    area: Floats
    tone: NDArray[np.int64]
    ends: Labels
    neighbours: Labels
    affinity: Floats
    here: Labels
    there: Labels
    looked: Floats
    part: Labels

    def carried(self, values: Floats) -> Floats:
        """Values (previous count, K) of the previous frame's cells, carried to those of this frame."""
        return carried(self.here, self.there, np.ascontiguousarray(values), self.looked)


@dataclass(frozen=True, slots=True, eq=False)
class CueMemory:
    """The state that cues carry from frame to frame.

    Attributes:
        labels: (h, w) int32, cells of the previous frame.
        way: (count, 3) float32: sums of the residuals along x and y, and of their lengths, in medians; older
            frames fade.
    """

    labels: Labels
    way: Floats


@dataclass(frozen=True, slots=True, eq=False)
class TrackCues:
    """The tracks' evidence on the superpixels of a frame.

    Attributes:
        shares: (count, 2) float32, how far each cell belongs to tracks that are reported, and to candidates.
        part: As in `FrameCues`.
    """

    shares: Floats
    part: Labels


def track_cues(posterior: Floats, confirmed: NDArray[np.bool_]) -> TrackCues:
    """The tracks' evidence on superpixels.

    Args:
        posterior: (count, K + 2), of background, K tracks and unknown motion.
        confirmed: (K,) which tracks are reported.
    """
    tracks = posterior[:, 1:-1]
    known = tracks[:, confirmed].sum(axis=1)
    shares = np.stack([known, tracks.sum(axis=1) - known], axis=1)
    return TrackCues(shares.astype(np.float32), posterior.argmax(axis=1).astype(np.int32))


def with_tracks(cues: FrameCues, tracked: TrackCues) -> FrameCues:
    """The cues of a frame with those of tracks filled in."""
    values = cues.values.copy()
    values[:, -tracked.shares.shape[1] :] = tracked.shares
    return replace(cues, values=values, part=tracked.part)


def flow_cues(
    scene: FrameMeasurements, old: WorkImage, memory: CueMemory | None
) -> tuple[FrameCues, CueMemory]:
    """The cues of a frame that need no tracks (found in parallel); those of tracks are 0.

    Args:
        scene: The frame as measured.
        old: The previous image.
        memory: From the previous frame; None when there is none of the same size.

    Returns:
        The cues, and the memory for the next frame.
    """
    cells, image, flow = scene.cells, scene.image, scene.flow
    labels = cells.labels
    found = flow_statistics(labels, flow, image.gx, image.gy, cells.count)
    background = scene.measured[0].background
    ground, residual = _residuals(cells, found[:, :2], background)
    misfit = warp_errors(labels, (image.grey, old.grey), (image.gx, image.gy), flow, ground)
    before = labels if memory is None else memory.labels
    here, there = flow_links(before, labels, flow)
    looked = np.ascontiguousarray(found[:, 4])
    length = np.hypot(residual[:, 0], residual[:, 1])
    median = float(np.median(length)) + 0.1
    step = np.column_stack([residual, length]) / np.float32(median)
    if memory is not None:
        step = step + LASTING * carried(here, there, memory.way, looked)
    way = np.ascontiguousarray(step, dtype=np.float32)
    went = np.hypot(way[:, 0], way[:, 1])
    inside = _inside(flow, labels, median, looked)
    speed, most = np.hypot(*ground.T), float(np.percentile(length, 98))
    columns = [
        *_residual_cues(cells, length, speed, (median, most)),
        *np.log(0.2 + misfit.T),
        np.log1p(found[:, 3]),
        np.log(0.05 + found[:, 2] / median),
        inside,
        np.log(0.5 + went),
        went / (way[:, 2] + 0.5),
        _border_distance(cells),
        *_frame_cues(length, speed, (median, most), background.scale),
        *np.zeros((2, cells.count), np.float32),
    ]
    values = np.column_stack(columns).astype(np.float32)
    link = cells.link
    cues = FrameCues(
        values,
        cells.area,
        tone_bins(cells.tone),
        link.indptr,
        link.indices,
        link.data,
        here if memory is not None else here[:0],
        there if memory is not None else there[:0],
        looked,
        np.zeros(cells.count, np.int32),
    )
    return cues, CueMemory(labels, way)


def tone_bins(tone: Floats) -> NDArray[np.int64]:
    """Bins (count,) of mean tones (count, 3) from 0 to 255, each channel in BINS parts."""
    part = np.minimum((tone / (256 / BINS)).astype(np.int64), BINS - 1)
    return np.asarray((part[:, 0] * BINS + part[:, 1]) * BINS + part[:, 2])


def _residuals(
    cells: Superpixels, flow: Floats, background: BackgroundMotion
) -> tuple[Floats, Floats]:
    """Displacement of the nearest background motion at each cell, and the residual flow, (count, 2) each."""
    moved = np.stack([model.at(cells.centre) for model in background.models])
    residual = -flow[None] - moved
    nearest = np.hypot(residual[..., 0], residual[..., 1]).argmin(axis=0)
    which = np.arange(cells.count)
    return (
        np.ascontiguousarray(moved[nearest, which], dtype=np.float32),
        np.asarray(residual[nearest, which], dtype=np.float32),
    )


def _residual_cues(
    cells: Superpixels, length: Floats, ground: Floats, frame: tuple[float, float]
) -> tuple[NDArray[Any], ...]:
    """Residual lengths relative to the background's motion, the frame's residuals, and its border's.

    Of all residuals of the frame, the median and nearly the greatest are given.
    """
    median, most = frame
    height, width = cells.labels.shape
    wide = FRAME * height
    x, y = cells.centre.T
    at_border = (x < wide) | (y < wide) | (x > width - wide) | (y > height - wide)
    border = np.sort(length[at_border]) if at_border.any() else length[:1]
    return (
        np.log(0.1 + length),
        np.log(0.05 + length / (0.5 + ground)),
        np.log(0.2 + length / median),
        length / (most + 0.3),
        np.log(0.2 + length / (float(np.median(border)) + 0.1)),
        np.searchsorted(border, length) / len(border),
    )


def _frame_cues(
    length: Floats, ground: Floats, frame: tuple[float, float], scale: float
) -> tuple[Floats, ...]:
    """Cues of the whole frame, the same in each cell: how calm it is, how well explained."""
    median, most = frame
    wide = float(np.mean(length > 0.5 * most))
    speed = float(np.median(ground))
    said = np.log(median), np.log(most / median + 0.1), np.log(0.1 + speed), scale, wide
    return tuple(np.full(len(length), value, dtype=np.float32) for value in said)


def _border_distance(cells: Superpixels) -> Floats:
    """Distance of each cell to the border of the image, as a share of its width or height, (count,)."""
    height, width = cells.labels.shape
    x, y = cells.centre[:, 0] / width, cells.centre[:, 1] / height
    nearest = np.minimum(np.minimum(x, 1 - x), np.minimum(y, 1 - y))
    return np.asarray(np.minimum(nearest, REACH), dtype=np.float32)


def _inside(flow: Floats, labels: Labels, median: float, looked: Floats) -> Floats:
    """Degree to which flow edges enclose each cell, (count,) 0 to 1."""
    steep = steepness(flow, 4)
    # A strength 1 - exp(-0.7 s / (median / 2 + 0.02)), of steepness s, exceeds those of edges from here on.
    limits = -np.log(1 - np.array(EDGES)) / 0.7 * (0.5 * median + 0.02)
    return sampled_means(labels, inside_share(steep, limits.astype(np.float32)), looked)
