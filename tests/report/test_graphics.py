"""Pictures on terminals: what is sent is the picture."""

from __future__ import annotations

import re
from base64 import b64decode
from io import StringIO

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from PIL import Image
from rich.console import Console

from visup.report.graphics import (
    COLOURS,
    Graphics,
    graphics_of,
    kitty_codes,
    sixel_codes,
    terminal_picture,
)
from visup.report.spotlight import DIMMED, spotlight
from visup.testing import region_of

PICTURES = st.builds(
    lambda seed, h, w, levels: (
        np.random.default_rng(seed).integers(0, levels, (h, w, 3)) * (255 // max(1, levels - 1))
    ).astype(np.uint8),
    st.integers(0, 999),
    st.integers(1, 20),
    st.integers(1, 30),
    st.integers(2, 5),
)


def unsixel(codes: str) -> NDArray[np.int64]:
    """A reader of sixels that knows as little as it can: (H, W, 3) RGB, 0 to 100."""
    found = re.fullmatch(
        r'\x1bPq"1;1;(\d+);(\d+)((?:#\d+;2;\d+;\d+;\d+)+)(.*)\x1b\\', codes, re.DOTALL
    )
    assert found is not None
    width, height = int(found[1]), int(found[2])
    told = re.findall(r"#(\d+);2;(\d+);(\d+);(\d+)", found[3])
    palette = {int(n): tuple(map(int, c)) for n, *c in told}
    made = np.full((height, width, 3), -1)
    for band, lines in enumerate(found[4].split("-")):
        for line in lines.split("$"):
            number = re.match(r"#(\d+)", line)
            assert number is not None
            column = 0
            for count, char in re.findall(r"(?:!(\d+))?([?-~])", line[number.end() :]):
                for x in range(column, column + int(count or 1)):
                    for bit in range(6):
                        if (ord(char) - 63) >> bit & 1:
                            made[6 * band + bit, x] = palette[int(number[1])]
                column += int(count or 1)
    return made


@given(PICTURES)
def test_sixels_decode_to_the_picture_in_fewer_colours(picture: NDArray[np.uint8]) -> None:
    quantized = Image.fromarray(np.ascontiguousarray(picture[:, :, ::-1])).quantize(COLOURS)
    expected = (np.asarray(quantized.convert("RGB"), int) * 100 + 127) // 255
    assert np.array_equal(unsixel(sixel_codes(picture)), expected)


@given(PICTURES)
def test_kitty_pictures_are_sent_in_chunks(picture: NDArray[np.uint8]) -> None:
    big = np.tile(picture, (6, 9, 1))
    pieces = re.findall(r"\x1b_G([^;]*);([^\x1b]*)\x1b\\", kitty_codes(big))
    assert [head.endswith("m=1") for head, _ in pieces] == [True] * (len(pieces) - 1) + [False]
    assert all(len(data) <= 4096 for _, data in pieces)
    data = b64decode("".join(data for _, data in pieces))
    read = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert read is not None
    assert np.array_equal(read, big)


@pytest.mark.parametrize(
    ("environment", "graphics"),
    [
        ({}, Graphics.TEXT),
        ({"TERM": "xterm-256color"}, Graphics.TEXT),
        ({"TERM": "xterm-kitty"}, Graphics.KITTY),
        ({"TERM": "xterm-256color", "KITTY_WINDOW_ID": "1"}, Graphics.KITTY),
        ({"TERM": "xterm-256color", "TERM_PROGRAM": "WezTerm"}, Graphics.KITTY),
        ({"TERM": "xterm-ghostty"}, Graphics.KITTY),
        ({"TERM": "foot-extra"}, Graphics.SIXEL),
        ({"TERM": "mlterm"}, Graphics.SIXEL),
        ({"TERM": "tmux-256color", "KITTY_WINDOW_ID": "1"}, Graphics.TEXT),
        ({"TERM": "xterm-kitty", "VISUP_GRAPHICS": "text"}, Graphics.TEXT),
        ({"TERM": "xterm", "VISUP_GRAPHICS": "SIXEL"}, Graphics.SIXEL),
        ({"TERM": "xterm", "VISUP_GRAPHICS": "nonsense"}, Graphics.TEXT),
    ],
)
def test_the_graphics_protocol_follows_the_environment(
    environment: dict[str, str], graphics: Graphics
) -> None:
    assert graphics_of(environment) is graphics


@pytest.mark.parametrize("graphics", list(Graphics))
def test_a_pipe_gets_no_codes(graphics: Graphics) -> None:
    picture = np.zeros((12, 12, 3), np.uint8)
    for terminal in (True, False):
        out = StringIO()
        console = Console(file=out, force_terminal=terminal, color_system="truecolor")
        console.print(terminal_picture(picture, 40, graphics))
        assert ("\x1b_G" in out.getvalue()) is (terminal and graphics is Graphics.KITTY)
        assert ("\x1bPq" in out.getvalue()) is (terminal and graphics is Graphics.SIXEL)


def test_regions_of_an_explanation_are_highlighted() -> None:
    frame = np.full((60, 80, 3), 200, np.uint8)
    region = region_of(np.ones((20, 20), bool), 3, at=(40, 30), size=(80, 60))
    made = spotlight(frame, [region, region])
    assert made[40, 50].tolist() == [200] * 3
    assert made[55, 5].tolist() == [int(200 * DIMMED)] * 3
    assert not np.array_equal(made[29:31, 40:60], made[45:47, 40:60])  # an outline
    assert frame.min() == 200
