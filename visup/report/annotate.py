"""Draws the beliefs over a frame: contours, names, alerts, stages."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Alert, Mind, ObjectBelief, Presence, Severity, StageBelief, Status
from visup.report.image_text import fitted, ink, shade, write
from visup.report.palette import SEVERITY_COLOURS, STATUS_COLOURS, Rgb, object_colour
from visup.rules.wording.sentences import role_or_model, spaced
from visup.wording import prose

WHITE: Rgb = (255, 255, 255)
INK: Rgb = (12, 16, 22)
MAX_ALERTS = 2
MAX_TASKS = 2

Box = tuple[int, int, int, int]
Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Scale:
    """Drawing sizes in proportion to the image.

    Attributes:
        letters: Letter size, pixels.
        line: Width of a contour, pixels.
        pad: Padding of texts, pixels.
    """

    letters: int
    line: int
    pad: int

    @classmethod
    def of(cls, width: int, height: int) -> Scale:
        """Sizes for an image; 640x480 is 1."""
        unit = min(width / 640, height / 480)
        return cls(max(9, round(14 * unit)), max(1, round(2 * unit)), max(2, round(5 * unit)))

    @property
    def row(self) -> int:
        """Height of a line of text with padding, pixels."""
        return round(self.letters * 1.3) + 2 * self.pad - 2


def annotate(image: Image, mind: Mind) -> Image:
    """Draw the beliefs over a frame.

    Visible objects have a contour in their colour and a label with name and vote share; hidden ones a dashed
    contour where they were last seen. Open alerts are at the top, stages of tasks and the time at the bottom.

    Args:
        image: (H, W, 3) uint8 BGR; not written to.
        mind: The mind after the step of that frame.

    Returns:
        (H, W, 3) uint8 BGR, a new image; deterministic.
    """
    out = image.copy()
    scale = Scale.of(out.shape[1], out.shape[0])
    shown = [b for b in mind.present() if len(b.region.contour)]
    for belief in shown:
        _fill(out, belief)
    for belief in shown:
        _outline(out, belief, scale)
    top = _alerts(out, mind.alerts, scale)
    bottom = _stages(out, mind, scale)
    _labels(out, mind, shown, (top, bottom), scale)
    return out


def label_of(belief: ObjectBelief, mind: Mind) -> str:
    """The label of an object in a picture, named as in sentences, such as '2 satellite 87 %'."""
    if not belief.candidates:
        return str(belief.id)
    name = spaced(role_or_model(mind, belief.name))
    return f"{belief.id} {name} {belief.strength:.0%}".replace("%", " %")


def _points(belief: ObjectBelief) -> NDArray[np.int32]:
    return np.round(belief.region.contour).astype(np.int32).reshape(-1, 1, 2)


def _fill(image: Image, belief: ObjectBelief) -> None:
    """A faint tint of the region, through which the image stays visible."""
    if belief.presence is not Presence.SEEN:
        return
    x, y, w, h = belief.region.bbox
    part = image[y : y + h, x : x + w]
    mask = belief.region.mask[: part.shape[0], : part.shape[1]]
    tint = np.array(object_colour(belief.id)[::-1], np.float32)
    inside = part[mask].astype(np.float32)
    part[mask] = np.round(inside + 0.14 * (tint - inside)).astype(np.uint8)


def _outline(image: Image, belief: ObjectBelief, scale: Scale) -> None:
    """The contour with a dark edge, to be visible on any background."""
    points, colour = _points(belief), object_colour(belief.id)[::-1]
    if belief.presence is Presence.SEEN:
        cv2.polylines(image, [points], True, INK[::-1], scale.line + 2, cv2.LINE_AA)
        cv2.polylines(image, [points], True, colour, scale.line, cv2.LINE_AA)
        return
    for dash in _dashes(points.reshape(-1, 2), 4.0 * scale.line):
        cv2.polylines(image, [dash], False, colour, scale.line, cv2.LINE_AA)


def _dashes(points: NDArray[np.int32], length: float) -> list[NDArray[np.int32]]:
    """A closed line cut into dashes."""
    closed = np.vstack([points, points[:1]]).astype(float)
    arc_length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
    dashes = []
    for start in np.arange(0.0, arc_length[-1], 2 * length):
        at = np.linspace(start, min(start + length, arc_length[-1]), 5)
        xy = np.stack([np.interp(at, arc_length, closed[:, k]) for k in (0, 1)], axis=1)
        dashes.append(np.round(xy).astype(np.int32).reshape(-1, 1, 2))
    return dashes


def _labels(
    image: Image, mind: Mind, beliefs: list[ObjectBelief], edges: tuple[int, int], scale: Scale
) -> None:
    """Labels next to their objects without overlap."""
    placed: list[Box] = []
    # Hidden objects without a name are of no interest to a reader.
    labelled = (b for b in beliefs if b.presence is not Presence.HIDDEN or b.candidates)
    for belief in sorted(labelled, key=lambda b: b.region.bbox[1]):
        hidden = " (hidden)" if belief.presence is Presence.HIDDEN else ""
        max_width = image.shape[1] - 4 * scale.pad
        text = fitted(label_of(belief, mind) + hidden, scale.letters, max_width)
        width = ink(text, scale.letters).shape[1] + 3 * scale.pad if text else 0
        box = _label_box(belief.region.bbox, (width, scale.row), placed, edges, image.shape[1])
        placed.append(box)
        shade(image, box, INK, 0.72)
        shade(image, (box[0], box[1], max(2, scale.pad - 2), box[3]), object_colour(belief.id), 1)
        write(image, text, (box[0] + 2 * scale.pad, box[1] + scale.pad - 1), scale.letters, WHITE)


def _label_box(
    object_box: Box, size: tuple[int, int], placed: list[Box], edges: tuple[int, int], width: int
) -> Box:
    """Above the object if there is room, else below it, moved down until nothing overlaps."""
    (x, y, _, h), (w, row) = object_box, size
    left = min(max(x, 0), max(width - w, 0))
    top, bottom = edges[0], max(edges[0], edges[1] - row)
    candidates = [y - row - 3, y + h + 3, *range(top, bottom + 1, row)]
    for y_at in candidates:
        box = (left, min(max(y_at, top), bottom), w, row)
        if not any(_overlap(box, other) for other in placed):
            return box
    return left, min(max(y - row, top), bottom), w, row


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[0] + b[2] and b[0] < a[0] + a[2] and a[1] < b[1] + b[3] and b[1] < a[1] + a[3]


def _alerts(image: Image, alerts: tuple[Alert, ...], scale: Scale) -> int:
    """Open alerts across the top, most severe first; returns the y of their lower edge, pixels."""
    warnings = sorted(alerts, key=lambda a: (-a.severity, a.id))
    warnings = [a for a in warnings if a.closed is None and a.severity > Severity.INFO]
    y = 0
    for i, alert in enumerate(warnings[:MAX_ALERTS]):
        more = len(warnings) - MAX_ALERTS if i == MAX_ALERTS - 1 else 0
        y = _banner(image, y, alert, f" (+{more} more)" if more > 0 else "", scale)
    return y


def _banner(image: Image, y: int, alert: Alert, more: str, scale: Scale) -> int:
    width, colour = image.shape[1], SEVERITY_COLOURS[alert.severity]
    letters = INK if alert.severity is Severity.WARNING else WHITE
    shade(image, (0, y, width, scale.row), colour, 0.88)
    mark = 2 * scale.pad + scale.letters // 2
    _triangle(image, (mark, y + scale.row // 2), scale.letters, letters, colour)
    x = mark + scale.letters
    text = (
        fitted(prose(alert.cause), scale.letters, width - x - scale.pad - _width(more, scale))
        + more
    )
    write(image, text, (x, y + scale.pad - 1), scale.letters, letters)
    return y + scale.row


def _triangle(image: Image, centre: tuple[int, int], size: int, colour: Rgb, on: Rgb) -> None:
    """A warning sign, since severity must not be shown only by colour."""
    (x, y), r = centre, size * 0.55
    corners = np.array([[x, y - r], [x + r, y + r * 0.8], [x - r, y + r * 0.8]])
    cv2.fillPoly(image, [np.round(corners).astype(np.int32)], colour[::-1], cv2.LINE_AA)
    stroke = max(1, size // 9)
    cv2.line(image, (x, y - size // 6), (x, y + size // 8), on[::-1], stroke, cv2.LINE_AA)
    cv2.circle(image, (x, y + size // 3), max(1, stroke // 2), on[::-1], -1, cv2.LINE_AA)


def _width(text: str, scale: Scale) -> int:
    return int(ink(text, scale.letters).shape[1]) if text else 0


def _stages(image: Image, mind: Mind, scale: Scale) -> int:
    """The stages of tasks and the time along the bottom; returns the y of their upper edge, pixels."""
    height, width = int(image.shape[0]), int(image.shape[1])
    time = f"{mind.time:.1f} s"
    shown = mind.tasks[:MAX_TASKS]
    y = height - scale.row * max(1, len(shown))
    if shown:
        shade(image, (0, y, width, height - y), INK, 0.72)
    clock = (width - _width(time, scale) - 2 * scale.pad, height - scale.row)
    if not shown:
        tag = (clock[0] - scale.pad, clock[1], width - clock[0] + scale.pad, scale.row)
        shade(image, tag, INK, 0.72)
    write(image, time, (clock[0], clock[1] + scale.pad - 1), scale.letters, WHITE)
    for i, task in enumerate(shown):
        at = y + i * scale.row
        x = 2 * scale.pad
        name = fitted(task.task, scale.letters, width // 4)
        write(image, name, (x, at + scale.pad - 1), scale.letters, WHITE)
        _stage_chips(
            image, task.stages, (x + _width(name, scale) + 3 * scale.pad, at), clock[0], scale
        )
    return y


def _stage_chips(
    image: Image, stages: tuple[StageBelief, ...], at: tuple[int, int], right: int, scale: Scale
) -> None:
    """One chip for each stage, with a colour and a word for its status."""
    x, y = at
    chip_width = (right - x - scale.pad) // max(1, len(stages))
    for stage in stages:
        text = stage.stage if stage.status is Status.PENDING else f"{stage.stage}: {stage.status}"
        text = fitted(text, scale.letters, chip_width - 3 * scale.pad)
        if not text:
            return
        width = _width(text, scale) + 2 * scale.pad
        opacity = 0.35 if stage.status is Status.PENDING else 0.95
        box = (x, y + scale.pad // 2, width, scale.row - scale.pad)
        shade(image, box, STATUS_COLOURS[stage.status], opacity)
        write(image, text, (x + scale.pad, y + scale.pad - 1), scale.letters, WHITE)
        x += width + scale.pad
