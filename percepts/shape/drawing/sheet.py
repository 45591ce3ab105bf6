"""A sheet to draw on: smooth lines and readable text, by drawing at twice the size."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from visup.percepts.shape.shocks.shock_labels import ShockKind

Colour = tuple[int, int, int]
"""Red, green, blue."""

Point = tuple[float, float]

PAPER: Colour = (255, 255, 255)
INK: Colour = (35, 39, 47)
PALE: Colour = (120, 126, 138)
RULE: Colour = (224, 227, 232)
BODY: Colour = (226, 230, 236)
OUTLINE: Colour = (150, 158, 170)

COLOURS: dict[ShockKind, Colour] = {
    ShockKind.PROTRUSION: (230, 126, 20),
    ShockKind.NECK: (208, 38, 58),
    ShockKind.BEND: (36, 150, 72),
    ShockKind.SEED: (38, 108, 214),
}
"""Colour of each kind of shock."""

_FINE = 2


class Sheet:
    """White paper, y down, in pixels.

    Args:
        width: Pixels.
        height: Pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self.size = (width, height)
        self._image = Image.new("RGB", (width * _FINE, height * _FINE), PAPER)
        self._draw = ImageDraw.Draw(self._image)

    def text(
        self, at: Point, text: str, size: int = 13, colour: Colour = INK, anchor: str = "ls"
    ) -> None:
        """Write a line; `anchor` as in Pillow: 'ls' is left at the baseline, 'mm' the middle."""
        spot = (at[0] * _FINE, at[1] * _FINE)
        self._draw.text(spot, text, fill=colour, font=_font(size * _FINE), anchor=anchor)

    def fitted(
        self, at: Point, text: str, width: float, size: int = 13, colour: Colour = INK
    ) -> None:
        """Write a line, truncated with three dots to this width."""
        font, shortened = _font(size * _FINE), text
        while (
            shortened
            and font.getlength(shortened + ("…" if shortened != text else "")) > width * _FINE
        ):
            shortened = shortened[:-1]
        self.text(at, shortened + ("…" if shortened != text else ""), size, colour)

    def polygon(self, points: Sequence[Point], fill: Colour, outline: Colour | None = None) -> None:
        """A filled polygon with a fine outline."""
        spots = [(x * _FINE, y * _FINE) for x, y in points]
        self._draw.polygon(spots, fill=fill, outline=outline, width=_FINE)

    def box(self, corner: Point, other: Point, fill: Colour, radius: float = 0.0) -> None:
        """A filled rectangle with rounded corners."""
        spots = [(x * _FINE, y * _FINE) for x, y in (corner, other)]
        self._draw.rounded_rectangle(spots, radius * _FINE, fill=fill)

    def line(self, points: Sequence[Point], colour: Colour, width: float = 1.0) -> None:
        """A line through points."""
        spots = [(x * _FINE, y * _FINE) for x, y in points]
        self._draw.line(spots, fill=colour, width=max(1, round(width * _FINE)), joint="curve")

    def dot(self, at: Point, radius: float, colour: Colour, rim: Colour = PAPER) -> None:
        """A dot with a rim that sets it off from what is below."""
        for r, fill in ((radius + 1.0, rim), (radius, colour)):
            x, y = at[0] * _FINE, at[1] * _FINE
            self._draw.ellipse((x - r * _FINE, y - r * _FINE, x + r * _FINE, y + r * _FINE), fill)

    def photo(self, corner: Point, picture: NDArray[np.uint8], side: float) -> None:
        """An image (H, W, 3) uint8, BGR, fitted into a square with this upper left corner."""
        image = Image.fromarray(np.ascontiguousarray(picture[:, :, ::-1]))
        zoom = side * _FINE / max(image.size)
        width, height = (max(1, round(n * zoom)) for n in image.size)
        spare = (side * _FINE - width) / 2, (side * _FINE - height) / 2
        spot = round(corner[0] * _FINE + spare[0]), round(corner[1] * _FINE + spare[1])
        self._image.paste(image.resize((width, height), Image.Resampling.BICUBIC), spot)

    def picture(self) -> NDArray[np.uint8]:
        """The drawing, (H, W, 3) uint8, BGR."""
        small = self._image.resize(self.size, Image.Resampling.LANCZOS)
        return np.ascontiguousarray(np.asarray(small, dtype=np.uint8)[:, :, ::-1])


@lru_cache(maxsize=16)
def _font(size: int) -> ImageFont.FreeTypeFont:
    found = ImageFont.load_default(size)
    assert isinstance(found, ImageFont.FreeTypeFont)
    return found


def legend(sheet: Sheet, at: Point, step: float = 96.0) -> None:
    """The kinds of shock with their colours, in a row."""
    for n, (kind, colour) in enumerate(COLOURS.items()):
        x = at[0] + n * step
        sheet.dot((x, at[1] - 4), 5, colour)
        sheet.text((x + 11, at[1]), kind.name.lower(), 13, PALE)
