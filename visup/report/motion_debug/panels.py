"""Four panels of the segmenter's internals for a frame: constraints, layers, labels, regions.

Velocities are in frame pixels per second; arrows show `ARROW_S` of motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, Region
from visup.percepts.motion.features.motion_constraints import Constraints
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.layers.affine import distances
from visup.percepts.motion.layers.layer_discovery import layer_slack
from visup.percepts.motion.output.segmentation_trace import SegmentationTrace
from visup.percepts.motion.tracks.measurements import BaselineMotion
from visup.percepts.motion.tracks.track import Track
from visup.report.image_text import ink, shade, write
from visup.report.motion_debug.marks import (
    INK,
    WHITE,
    Floats,
    Image,
    arrow,
    flow_colours,
    hatched,
    heading,
    line,
    lines_of_text,
    wheel,
)
from visup.report.palette import Rgb, object_colour

PANEL = (640, 480)  # maximum size of a panel's picture, pixels
ARROW_S = 0.25
CERTAIN_SHARE = 0.75  # share of its label below which a superpixel is shown as uncertain
MAX_ROWS = 6
BACKGROUND: tuple[Rgb, Rgb] = ((126, 142, 164), (86, 98, 178))
CANDIDATE: Rgb = (178, 223, 138)
OUTLIER: Rgb = (255, 45, 85)
UNKNOWN: Rgb = (235, 235, 235)
OUTLIER_PX2 = MotionSettings().outlier ** 2


@dataclass(frozen=True, slots=True, eq=False)
class Canvas:
    """The common background of all panels.

    Attributes:
        image: (H, W, 3) uint8 BGR, the frame at the size of a panel.
        factor: Panel pixels per pixel of the working image.
        scale: Working pixels per frame pixel.
    """

    image: Image
    factor: float
    scale: float

    def ground(self, light: float) -> Image:
        """The frame in dim grey, as a background for colours."""
        grey = cv2.cvtColor(self.image, cv2.COLOR_BGR2GRAY).astype(np.float32) * light
        return np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)


def draw_motion(frame: Frame, trace: SegmentationTrace | None, regions: Sequence[Region]) -> Image:
    """Draw the four panels of a frame.

    Args:
        frame: The frame.
        trace: The segmenter's internals after it; None for the first frame.
        regions: The reported regions.

    Returns:
        (H, W, 3) uint8 BGR; the size depends on that of the frame only.
    """
    canvas = _canvas(frame, trace)
    panels = [
        _constraints(canvas, trace),
        _layers(canvas, trace),
        _labels(canvas, trace),
        _regions(canvas, trace, regions, frame),
    ]
    rows = [np.hstack([*_gap(panels[i : i + 2])]) for i in (0, 2)]
    return np.vstack([rows[0], rows[1], _footer(rows[0].shape[1], frame, trace, regions)])


def _canvas(frame: Frame, trace: SegmentationTrace | None) -> Canvas:
    image = frame.image
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), np.uint8)
    width, height = frame.size
    factor = min(PANEL[0] / width, PANEL[1] / height)
    size = max(16, round(width * factor)), max(16, round(height * factor))
    interpolation = cv2.INTER_AREA if factor < 1 else cv2.INTER_CUBIC
    shown = np.asarray(cv2.resize(image, size, interpolation=interpolation), np.uint8)
    scale = trace.scene.image.scale if trace is not None else 1.0
    return Canvas(shown, size[0] / (width * scale), scale)


def _gap(pair: Sequence[Image]) -> list[Image]:
    space = np.zeros((pair[0].shape[0], 4, 3), np.uint8)
    return [pair[0], space, pair[1]]


def _with_heading(image: Image, title: str, legend: Sequence[tuple[str, Rgb]]) -> Image:
    return np.vstack([heading(image.shape[1], title, legend), image])


def colour_of(track: Track) -> Rgb:
    """The colour of a track by its id, or that of unconfirmed candidates."""
    return object_colour(track.id) if track.id > 0 else CANDIDATE


def longest_baseline_masks(trace: SegmentationTrace) -> tuple[NDArray[np.bool_], ...]:
    """For each baseline a mask of the shown constraints: each point on its longest baseline."""
    assigned = np.zeros(len(trace.scene.points), dtype=bool)
    out = []
    for m in reversed(trace.scene.measured):
        unassigned = ~assigned[m.constraints.index]
        assigned[m.constraints.index] = True
        out.append(unassigned)
    return tuple(reversed(out))


def explained_by(trace: SegmentationTrace, m: BaselineMotion) -> NDArray[np.int64]:
    """The layer that explains each constraint of a baseline best.

    Args:
        trace: The segmenter's internals.
        m: One of its baselines.

    Returns:
        (N,) int64: 0 for the background, k for the k-th track, -1 for none. A track explains only constraints
        in or next to it.
    """
    c, cells = m.constraints, trace.scene.cells
    best, layer = m.background.distances(c), np.zeros(len(c), np.int64)
    at = trace.scene.cell_of(c)
    for k, t in enumerate(trace.tracks, 1):
        near = cells.dilated((t.share > 0.3)[:, None], 1)[at, 0]
        parts = [distances(p, c, layer_slack(p, t.centre)) for p in t.predicted(c.lag, c.span_s)]
        distance = np.min(parts, axis=0) if parts else np.full(len(c), np.inf)
        better = near & (distance < best)
        best, layer = np.where(better, distance, best), np.where(better, k, layer)
    return np.where(best > OUTLIER_PX2, -1, layer)


def _constraints(canvas: Canvas, trace: SegmentationTrace | None) -> Image:
    out = canvas.ground(0.5)
    title = f"1 constraints, as motion in {ARROW_S:g} s"
    legend = [("background", BACKGROUND[0]), ("candidate", CANDIDATE), ("outlier", OUTLIER)]
    legend.append(("bar: open along an edge", UNKNOWN))
    if trace is not None:
        colours = {-1: OUTLIER, 0: BACKGROUND[0]}
        colours |= {k: colour_of(t) for k, t in enumerate(trace.tracks, 1)}
        for m, shown in zip(trace.scene.measured, longest_baseline_masks(trace), strict=True):
            layer = explained_by(trace, m)
            # Independent motion is drawn last, on top.
            for i in sorted(np.flatnonzero(shown), key=lambda i: layer[i] != 0):
                _constraint(out, m.constraints, int(i), colours[int(layer[i])], canvas.factor)
    return _with_heading(out, title, legend)


def _constraint(image: Image, c: Constraints, i: int, colour: Rgb, factor: float) -> None:
    """An arrow, and a bar along the direction in which the motion is undetermined."""
    at = (c.xy[i] + 0.5) * factor
    xx, xy, yy = c.information[i].astype(float)
    weak = max((xx + yy) / 2 - np.hypot((xx - yy) / 2, xy), 1e-4)
    spread = weak**-0.5 / c.span_s * ARROW_S * factor
    if spread > 2.5:
        angle = 0.5 * np.arctan2(2 * xy, xx - yy) + np.pi / 2
        half = min(spread, 5.0) * np.array([np.cos(angle), np.sin(angle)], np.float32)
        faint = (colour[0] * 6 // 10, colour[1] * 6 // 10, colour[2] * 6 // 10)
        line(image, at - half, at + half, faint)
    arrow(image, at, c.moved[i] / c.span_s * ARROW_S * factor, colour, longest=22.0)


def velocities(trace: SegmentationTrace) -> tuple[Floats, NDArray[np.int64]]:
    """The velocity of each superpixel by its layer.

    Args:
        trace: The segmenter's workings.

    Returns:
        (count, 2) float32 working pixels per second, and (count,) the layer: 0 for background, k for
        the k-th track.
    """
    scene, centre = trace.scene, trace.scene.cells.centre
    last = scene.measured[-1]
    layer = np.zeros(scene.cells.count, np.int64)
    models = last.background.models
    prior = last.background.prevalence.log_prior(centre, len(models))
    # Ties go to the last one, which follows the camera.
    model_index = len(models) - 1 - prior[::-1].argmax(axis=0)
    background_rates = np.stack([m.at(centre) for m in models]) / last.constraints.span_s
    out = background_rates[model_index, np.arange(len(centre))]
    for k, t in enumerate(trace.tracks, 1):
        in_track = t.share > 0.5
        rate = t.best_rate()
        if rate is not None and in_track.any():
            out[in_track] = centre[in_track] @ rate.matrix[:, :2].T + rate.matrix[:, 2]
            layer[in_track] = k
    return np.asarray(out, np.float32), layer


def _layers(canvas: Canvas, trace: SegmentationTrace | None) -> Image:
    out = canvas.ground(0.55)
    if trace is not None:
        speed, layer = velocities(trace)
        tint = flow_colours(speed / canvas.scale)[_enlarged(trace, canvas)]
        opacity = np.where(layer > 0, 0.6, 0.25).astype(np.float32)[_enlarged(trace, canvas)]
        out = (out + opacity[..., None] * (tint - out)).astype(np.uint8)
        _grid_of_arrows(out, trace, speed, layer, canvas.factor)
        _numbers(out, trace, canvas.factor)
        lines_of_text(out, layer_rows(trace))
    wheel(out, (out.shape[1] - 30, 30), 22)
    return _with_heading(out, "2 layers, colour by direction and log speed", [])


def _grid_of_arrows(
    image: Image, trace: SegmentationTrace, speed: Floats, layer: NDArray[np.int64], factor: float
) -> None:
    labels = trace.scene.cells.labels
    step = max(1, round(26 / factor))
    for y in range(step // 2, labels.shape[0], step):
        for x in range(step // 2, labels.shape[1], step):
            cell = labels[y, x]
            k = int(layer[cell])
            colour = colour_of(trace.tracks[k - 1]) if k else (200, 206, 214)
            at = np.array([x + 0.5, y + 0.5], np.float32) * factor
            arrow(image, at, speed[cell] * ARROW_S * factor, colour, 2 if k else 1, 24.0)


def _numbers(image: Image, trace: SegmentationTrace, factor: float) -> None:
    """The number of each layer in its centre."""
    for t in trace.tracks:
        if t.last_seen == trace.scene.time:
            text = str(t.key)
            width = ink(text, 12).shape[1] + 6
            x, y = (round(v * factor) for v in t.centre)
            shade(image, (x - width // 2, y - 8, width, 16), INK, 0.8)
            write(image, text, (x - width // 2 + 3, y - 8), 12, WHITE)


def layer_rows(trace: SegmentationTrace) -> list[tuple[str, Rgb]]:
    """A line for each layer: kind, speed, confidence, support.

    Returns:
        Text and colour, the background first.
    """
    scene, scale = trace.scene, trace.scene.image.scale
    last = scene.measured[-1]
    middle = np.array([[scene.image.shape[1] / 2, scene.image.shape[0] / 2]], np.float32)
    rows = []
    for i, model in enumerate(reversed(last.background.models)):
        vx, vy = model.at(middle)[0] / last.constraints.span_s / scale
        name = "background" if i == 0 else "background, second"
        predicted = "" if last.background.sure or i else ", predicted"
        support_text = f", {_support(model.support)}" if model.support else ""
        text = f"{name}{predicted}: {vx:+.1f} {vy:+.1f} px/s{support_text}"
        rows.append((text, BACKGROUND[min(i, 1)]))
    support = {t.key: sum(m.support for m in t.motions) for t in trace.tracks}
    ordered = sorted(trace.tracks, key=lambda t: (t.id == 0, t.id or -support[t.key]))
    rows += [(_track_text(t, support[t.key], scene.time, scale), colour_of(t)) for t in ordered]
    left_out = len(rows) - MAX_ROWS
    return rows if left_out <= 0 else [*rows[:MAX_ROWS], (f"and {left_out} more", UNKNOWN)]


def _track_text(t: Track, support: float, now: float, scale: float) -> str:
    name = f"{t.id} (layer {t.key})" if t.id else f"candidate (layer {t.key})"
    rate = t.best_rate()
    if rate is None:
        return f"{name}: motion unknown"
    vx, vy = rate.velocity(t.centre) / scale
    parts = f", {len(t.motions)} parts" if len(t.motions) > 1 else ""
    seen = "" if t.last_seen == now else f", not seen for {now - t.last_seen:.1f} s"
    sigma = rate.sigma / scale
    digits = 1 if sigma >= 0.1 else 2
    speed = f"{vx:+.{digits}f} {vy:+.{digits}f} ± {sigma:.{digits}f} px/s"
    return f"{name}: {speed}, {_support(support)}{parts}{seen}"


def _support(weight: float) -> str:
    return f"support {weight:.0f}"


def _enlarged(trace: SegmentationTrace, canvas: Canvas) -> NDArray[np.int32]:
    """The superpixel labels at the size of a panel, (H, W)."""
    height, width = canvas.image.shape[:2]
    labels = cv2.resize(trace.scene.cells.labels, (width, height), interpolation=cv2.INTER_NEAREST)
    return np.asarray(labels, np.int32)


def label_colours(trace: SegmentationTrace) -> tuple[Floats, NDArray[np.bool_]]:
    """The colour of each superpixel, mixed from its labels, and whether it is uncertain.

    Args:
        trace: The segmenter's workings.

    Returns:
        (count, 3) float32 BGR, black for background; (count,) bool.
    """
    tracks = {t.key: t for t in trace.tracks}
    layers = [colour_of(tracks[key]) if key in tracks else CANDIDATE for key in trace.keys]
    colours = np.array([(0, 0, 0), *layers, UNKNOWN], np.float32)[:, ::-1]
    posterior = trace.posterior
    return np.asarray(posterior @ colours, np.float32), np.asarray(
        posterior.max(axis=1) < CERTAIN_SHARE
    )


def _labels(canvas: Canvas, trace: SegmentationTrace | None) -> Image:
    out = canvas.ground(0.6)
    if trace is not None:
        cells = _enlarged(trace, canvas)
        colours, uncertain = label_colours(trace)
        belief = (1 - trace.posterior[:, 0]).astype(np.float32)
        out = (out + 0.75 * (colours[cells] - belief[cells][..., None] * out)).astype(np.uint8)
        out[uncertain[cells] & hatched(out.shape[:2])] = 255
        edge = (cells != np.roll(cells, 1, 0)) | (cells != np.roll(cells, 1, 1))
        out[edge] = (out[edge] * 0.72).astype(np.uint8)
    legend = [("dark: background", (52, 60, 70)), ("unknown motion", UNKNOWN)]
    return _with_heading(out, "3 labels of superpixels", [*legend, ("hatched: uncertain", WHITE)])


def _regions(
    canvas: Canvas, trace: SegmentationTrace | None, regions: Sequence[Region], frame: Frame
) -> Image:
    out = canvas.image.copy()
    grow = out.shape[1] / frame.size[0]
    for region in regions:
        points = np.round((region.contour + 0.5) * grow).astype(np.int32).reshape(-1, 1, 2)
        cv2.polylines(out, [points], True, INK[::-1], 4, cv2.LINE_AA)
        cv2.polylines(out, [points], True, object_colour(region.id)[::-1], 2, cv2.LINE_AA)
    for region in regions:
        at = (np.array(region.centroid, np.float32) + 0.5) * np.float32(grow)
        along = np.array(region.velocity, np.float32) * np.float32(grow)
        arrow(out, at, along, INK, 5, 160.0)
        arrow(out, at, along, WHITE, 2, 160.0)
        _tag(out, region, grow)
    remembered = (
        [] if trace is None else [t for t in trace.tracks if t.id and t.last_seen < frame.time]
    )
    rows = [(f"{t.id} remembered, not seen", object_colour(t.id)) for t in remembered]
    lines_of_text(out, rows[:MAX_ROWS])
    return _with_heading(out, "4 regions", [("arrow: 1 s of motion", WHITE)])


def _tag(image: Image, region: Region, grow: float) -> None:
    """Id and velocity above a region, or below it if there is no room."""
    vx, vy = region.velocity
    text = f"{region.id}  {np.hypot(vx, vy):.1f} px/s" + (" cut" if region.cut else "")
    width = ink(text, 13).shape[1] + 16
    x, y, _, h = (round(v * grow) for v in region.bbox)
    left = min(max(x, 0), max(image.shape[1] - width, 0))
    top = y - 22 if y >= 22 else min(y + h + 4, image.shape[0] - 20)
    shade(image, (left, top, width, 19), INK, 0.75)
    shade(image, (left, top, 4, 19), object_colour(region.id), 1)
    write(image, text, (left + 9, top + 2), 13, WHITE)


def _footer(
    width: int, frame: Frame, trace: SegmentationTrace | None, regions: Sequence[Region]
) -> Image:
    """Time and measurements."""
    strip = np.zeros((26, width, 3), np.uint8)
    strip[:] = INK[::-1]
    words = [f"frame {frame.index}, {frame.time:.2f} s", f"regions: {len(regions)}"]
    if trace is not None:
        confirmed = sum(t.id > 0 for t in trace.tracks)
        words.append(f"tracks: {confirmed}, candidates: {len(trace.tracks) - confirmed}")
        constraints = [m.constraints for m in trace.scene.measured]
        words += [f"{len(c)} constraints over {c.span_s:.2f} s" for c in constraints]
    write(strip, "   |   ".join(words), (8, 5), 13, (205, 212, 222))
    return strip
