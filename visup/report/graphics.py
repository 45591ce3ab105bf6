"""Pictures on terminals: kitty's protocol, sixels, or coloured characters.

Terminals are recognised by environment variables instead of being queried, since the response would mix with
typed input. `VISUP_GRAPHICS=kitty|sixel|text` takes precedence.
"""

from __future__ import annotations

import os
from base64 import b64encode
from collections.abc import Iterator, Mapping
from enum import StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from rich.console import RenderableType
from rich.segment import ControlType, Segment, Segments

from visup.report.pictures import png, text_picture

Image = NDArray[np.uint8]
COLOURS = 128
"""Colours of a sixel picture, at most 256."""

CHUNK = 4096
"""Maximum characters per message in kitty's protocol."""

MAX_WIDTH_PX = 1000


class Graphics(StrEnum):
    """The graphics protocols of terminals."""

    KITTY = "kitty"
    SIXEL = "sixel"
    TEXT = "text"


KITTY_PROGRAMS = ("kitty", "ghostty", "wezterm", "konsole")
SIXEL_TERMINALS = ("foot", "mlterm", "yaft", "xterm-sixel", "contour")


def graphics_of(environment: Mapping[str, str] = os.environ) -> Graphics:
    """The graphics protocol of a terminal, by its environment variables.

    >>> graphics_of({"TERM": "xterm-kitty"}), graphics_of({"TERM": "foot"}), graphics_of({"TERM": "xterm"})
    (<Graphics.KITTY: 'kitty'>, <Graphics.SIXEL: 'sixel'>, <Graphics.TEXT: 'text'>)
    """
    requested = environment.get("VISUP_GRAPHICS", "").lower()
    if requested in tuple(Graphics):
        return Graphics(requested)
    term = environment.get("TERM", "").lower()
    if term.startswith(("tmux", "screen")):
        return Graphics.TEXT  # multiplexers pass on neither protocol
    program = environment.get("TERM_PROGRAM", "").lower()
    if "KITTY_WINDOW_ID" in environment or any(p in (program, term[6:]) for p in KITTY_PROGRAMS):
        return Graphics.KITTY
    return Graphics.SIXEL if term.startswith(SIXEL_TERMINALS) else Graphics.TEXT


def terminal_picture(
    image: Image, columns: int = 80, graphics: Graphics | None = None
) -> RenderableType:
    """An image as a renderable for the terminal.

    Args:
        image: (H, W, 3) uint8 BGR.
        columns: Width of a picture in characters.
        graphics: The protocol; None to derive it from the environment.
    """
    graphics = graphics or graphics_of()
    if graphics is Graphics.TEXT:
        return text_picture(image, columns)
    small = _limited_width(image)
    codes = kitty_codes(small) if graphics is Graphics.KITTY else sixel_codes(small)
    # Rich writes control segments unchanged, and only to terminals.
    return Segments([Segment(codes, None, [(ControlType.BELL,)]), Segment.line()])


def kitty_codes(image: Image) -> str:
    """An image in kitty's graphics protocol: a PNG file in base64 chunks.

    Args:
        image: (H, W, 3) uint8 BGR.
    """
    data = b64encode(png(image)).decode()
    pieces = [data[n : n + CHUNK] for n in range(0, len(data), CHUNK)]
    messages = (
        f"\x1b_G{'a=T,f=100,' if n == 0 else ''}m={int(n < len(pieces) - 1)};{piece}\x1b\\"
        for n, piece in enumerate(pieces)
    )
    return "".join(messages)


def sixel_codes(image: Image) -> str:
    """An image in sixels: a palette, then bands of six rows, colour by colour (DEC VT340).

    Args:
        image: (H, W, 3) uint8 BGR.
    """
    picture = Pillow.fromarray(np.ascontiguousarray(image[:, :, ::-1])).quantize(COLOURS)
    indices = np.asarray(picture)
    palette = np.asarray(picture.getpalette(), int).reshape(-1, 3)
    height, width = indices.shape
    colours = "".join(
        f"#{n};2;{r};{g};{b}" for n, (r, g, b) in enumerate((palette * 100 + 127) // 255)
    )
    bands = "-".join(_band(indices[top : top + 6]) for top in range(0, height, 6))
    return f'\x1bPq"1;1;{width};{height}{colours}{bands}\x1b\\'


def _band(rows: NDArray[np.uint8]) -> str:
    """Six rows: for each of their colours a line of characters whose bits are its pixels."""
    bits = (1 << np.arange(len(rows)))[:, None]
    lines = (
        f"#{n}{''.join(_runs((((rows == n) * bits).sum(axis=0) + 63).tolist()))}"
        for n in np.unique(rows).tolist()
    )
    return "$".join(lines)


def _runs(codes: list[int]) -> Iterator[str]:
    """Run-length encoded characters, for runs of four and more."""
    begin = 0
    for end in range(1, len(codes) + 1):
        if end < len(codes) and codes[end] == codes[begin]:
            continue
        count, char = end - begin, chr(codes[begin])
        yield f"!{count}{char}" if count > 3 else count * char
        begin = end


def _limited_width(image: Image) -> Image:
    height, width = image.shape[:2]
    if width <= MAX_WIDTH_PX:
        return image
    size = MAX_WIDTH_PX, round(height * MAX_WIDTH_PX / width)
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)
