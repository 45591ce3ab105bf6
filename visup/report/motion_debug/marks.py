"""Drawing primitives for the segmenter's internals: arrows, hatching, flow colours, headings."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.report.image_text import fitted, ink, shade, write
from visup.report.palette import Rgb

Image = NDArray[np.uint8]
Floats = NDArray[np.floating]

WHITE: Rgb = (255, 255, 255)
INK: Rgb = (14, 18, 25)
SUBPIXEL = 4  # fractional bits of OpenCV's coordinates: without them short arrows point in wrong directions
SATURATED_SPEED = 250.0  # pixels per second of full saturation
LETTER_PX = 13


def arrow(
    image: Image, start: Floats, along: Floats, colour: Rgb, width: int = 1, longest: float = 60.0
) -> None:
    """Draw an arrow in place; one shorter than a pixel becomes a dot.

    Args:
        image: (H, W, 3) uint8 BGR.
        start: (2,) x, y, pixels.
        along: (2,) from start to tip, pixels; longer ones than `longest` are cut short.
        colour: Colour of the arrow.
        width: Line width, pixels.
        longest: Greatest length, pixels.
    """
    length = float(np.hypot(*along))
    if length < 1.0:
        cv2.circle(image, _fixed(start), 20, colour[::-1], -1, cv2.LINE_AA, SUBPIXEL)
        return
    vector = along * min(1.0, longest / length)
    drawn_length = float(np.hypot(*vector))
    line(image, start, start + vector, colour, width)
    barb = min(0.4 * drawn_length, 3.0 + 1.5 * width)
    back = -vector / drawn_length
    side = np.array([-back[1], back[0]])
    for turn in (-0.5, 0.5):
        line(image, start + vector, start + vector + barb * (back + turn * side), colour, width)


def line(image: Image, start: Floats, end: Floats, colour: Rgb, width: int = 1) -> None:
    """Draw a line between two points (2,) with subpixel accuracy, in place."""
    cv2.line(image, _fixed(start), _fixed(end), colour[::-1], width, cv2.LINE_AA, SUBPIXEL)


def _fixed(at: Floats) -> tuple[int, int]:
    x, y = np.round(np.asarray(at, float) * (1 << SUBPIXEL)).astype(int).tolist()
    return x, y


def flow_colours(velocity: Floats) -> NDArray[np.float32]:
    """Colours of velocities: hue for direction, saturation for speed.

    Args:
        velocity: (N, 2) pixels per second.

    Returns:
        (N, 3) float32 BGR, 0 to 255; white for rest.
    """
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    hue = np.degrees(np.arctan2(velocity[:, 1], velocity[:, 0])) % 360
    # Speeds span four orders of magnitude, hence the logarithm.
    strength = np.clip(np.log1p(speed) / np.log1p(SATURATED_SPEED), 0, 1)
    hsv = np.stack([hue, strength, np.ones_like(hue)], axis=1).astype(np.float32)[None]
    return np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0] * 255, np.float32)


def wheel(image: Image, centre: tuple[int, int], radius: int) -> None:
    """The legend of `flow_colours`: each direction in its colour, in place."""
    ys, xs = np.mgrid[-radius : radius + 1, -radius : radius + 1]
    radii = np.hypot(xs, ys) / radius
    direction = np.stack([xs, ys], axis=-1).reshape(-1, 2).astype(np.float32)
    speed = np.expm1(np.clip(radii, 0, 1) * np.log1p(SATURATED_SPEED)).reshape(-1, 1)
    unit = direction / np.maximum(np.linalg.norm(direction, axis=1, keepdims=True), 1e-6)
    colours = flow_colours((unit * speed).astype(np.float32)).reshape(*radii.shape, 3)
    x, y = centre[0] - radius, centre[1] - radius
    part = image[y : y + 2 * radius + 1, x : x + 2 * radius + 1]
    if part.shape[:2] == radii.shape:
        part[radii <= 1] = colours[radii <= 1].astype(np.uint8)


def hatched(shape: tuple[int, int]) -> NDArray[np.bool_]:
    """(H, W) bool: diagonal lines that mark uncertainty."""
    ys, xs = np.mgrid[: shape[0], : shape[1]]
    return np.asarray((xs + ys) % 6 < 1)


def heading(width: int, title: str, legend: Sequence[tuple[str, Rgb]]) -> Image:
    """A strip above a panel: its title, and a legend of its colours at the right.

    Args:
        width: Pixels.
        title: One line.
        legend: Words with their colours; those that do not fit are left out.

    Returns:
        (H, width, 3) uint8 BGR.
    """
    strip = np.zeros((LETTER_PX * 2, width, 3), np.uint8)
    strip[:] = INK[::-1]
    title = fitted(title, LETTER_PX + 1, width - 12)
    write(strip, title, (6, 4), LETTER_PX + 1, WHITE)
    x, min_x = width - 6, ink(title, LETTER_PX + 1).shape[1] + 16 if title else 6
    for words, colour in reversed(legend):
        text_width = ink(words, LETTER_PX - 1).shape[1]
        if x - text_width - 14 < min_x:
            break
        x -= text_width
        write(strip, words, (x, 6), LETTER_PX - 1, (205, 212, 222))
        x -= 14
        shade(strip, (x, 8, 10, 10), colour, 1)
        x -= 10
    return strip


def lines_of_text(image: Image, rows: Sequence[tuple[str, Rgb]]) -> None:
    """Rows of text, each with a swatch of its colour, at the lower left of a panel, in place."""
    if not rows:
        return
    row_height, max_width = LETTER_PX + 5, image.shape[1] - 34
    texts = [fitted(words, LETTER_PX - 1, max_width) for words, _ in rows]
    box_width = max(ink(t, LETTER_PX - 1).shape[1] for t in texts if t) + 30
    top = image.shape[0] - row_height * len(rows) - 8
    shade(image, (0, top, box_width, image.shape[0] - top), INK, 0.74)
    for i, (text, (_, colour)) in enumerate(zip(texts, rows, strict=True)):
        y = top + 4 + i * row_height
        shade(image, (7, y + 3, 10, 10), colour, 1)
        write(image, text, (22, y + 1), LETTER_PX - 1, WHITE)
