"""Antialiased text for pictures.

Pillow renders a line once; NumPy blends it into the picture. OpenCV's stroke fonts are hard to read in small
sizes and support only ASCII.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from visup.report.palette import Rgb

ELLIPSIS = "…"


@lru_cache(maxsize=32)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


@lru_cache(maxsize=512)
def ink(text: str, size: int) -> NDArray[np.float32]:
    """A line of text as coverage.

    Args:
        text: One line.
        size: Letter size, pixels.

    Returns:
        (height, width) float32, 0 to 1, read-only; all lines of one size have the same height.
    """
    font = _font(size)
    width = max(1, round(font.getlength(text)) + 1)
    canvas = Image.new("L", (width, round(size * 1.3)), 0)
    ImageDraw.Draw(canvas).text((0, round(size * 0.05)), text, fill=255, font=font)
    coverage = np.asarray(canvas, dtype=np.float32) / np.float32(255)
    coverage.setflags(write=False)
    return coverage


def fitted(text: str, size: int, width: int) -> str:
    """The text, shortened with an ellipsis if wider than `width` pixels."""
    if ink(text, size).shape[1] <= width:
        return text
    low, high = 0, len(text)
    while low < high:
        middle = (low + high + 1) // 2
        if ink(text[:middle].rstrip() + ELLIPSIS, size).shape[1] <= width:
            low = middle
        else:
            high = middle - 1
    return text[:low].rstrip() + ELLIPSIS if low else ""


def write(image: NDArray[np.uint8], text: str, at: tuple[int, int], size: int, colour: Rgb) -> None:
    """Draw a line of text on an image, in place, clipped to it.

    Args:
        image: (H, W, 3) uint8 BGR, written to.
        text: One line.
        at: (x, y) of its top left corner, pixels.
        size: Letter size, pixels.
        colour: (r, g, b).
    """
    if not text:
        return
    blend(image, ink(text, size), at, colour)


def blend(
    image: NDArray[np.uint8], coverage: NDArray[np.float32], at: tuple[int, int], colour: Rgb
) -> None:
    """Blend a colour into an image by its coverage, in place, clipped to it."""
    (x, y), (h, w) = at, coverage.shape
    x0, y0 = max(x, 0), max(y, 0)
    x1, y1 = min(x + w, image.shape[1]), min(y + h, image.shape[0])
    if x0 >= x1 or y0 >= y1:
        return
    part = coverage[y0 - y : y1 - y, x0 - x : x1 - x, None]
    under = image[y0:y1, x0:x1].astype(np.float32)
    mixed = under + part * (np.array(colour[::-1], np.float32) - under)
    image[y0:y1, x0:x1] = np.round(mixed).astype(np.uint8)


def shade(
    image: NDArray[np.uint8], box: tuple[int, int, int, int], colour: Rgb, opacity: float
) -> None:
    """Blend a flat colour into a box (x, y, width, height) of an image, in place."""
    x, y, w, h = box
    if w > 0 and h > 0:
        blend(image, np.full((h, w), opacity, np.float32), (x, y), colour)
