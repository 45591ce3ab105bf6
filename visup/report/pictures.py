"""Pictures in text: as PNG in notebooks, as coloured characters on a terminal."""

from __future__ import annotations

from base64 import b64encode

import cv2
import numpy as np
from numpy.typing import NDArray
from rich.color import Color
from rich.segment import Segment, Segments
from rich.style import Style

Image = NDArray[np.uint8]


def png(image: Image) -> bytes:
    """An image as a PNG file.

    Args:
        image: (H, W, 3) uint8 BGR.
    """
    return bytes(cv2.imencode(".png", image)[1])


def html_picture(image: Image) -> str:
    """An image as an HTML element with embedded data.

    Args:
        image: (H, W, 3) uint8 BGR.
    """
    data = b64encode(png(image)).decode()
    return f'<img alt="the frame with what is believed drawn over it" src="data:image/png;base64,{data}">'


def text_picture(image: Image, columns: int = 80) -> Segments:
    """An image in characters, each of which shows two pixels (half blocks).

    Args:
        image: (H, W, 3) uint8 BGR.
        columns: Width, characters; narrower images are not enlarged.
    """
    width = min(columns, image.shape[1])
    rows = max(1, round(image.shape[0] * width / image.shape[1] / 2))
    small = cv2.resize(image, (width, 2 * rows), interpolation=cv2.INTER_AREA)[:, :, ::-1]
    lines = zip(small[::2].tolist(), small[1::2].tolist(), strict=True)
    return Segments([s for upper, lower in lines for s in _line(upper, lower)])


def _line(upper: list[list[int]], lower: list[list[int]]) -> list[Segment]:
    pairs = zip(upper, lower, strict=True)
    cells = [Style(color=Color.from_rgb(*a), bgcolor=Color.from_rgb(*b)) for a, b in pairs]
    return [*(Segment("\u2580", style) for style in cells), Segment.line()]
