"""Words for places of a picture: its nine parts, and its four sides."""

from __future__ import annotations

Box = tuple[int, int, int, int]
"""(x, y, width, height), pixels, y down."""

MAX_BORDER_GAP = 0.015
"""A box that comes so near to the border, in picture sides, is cut by it or about to be."""

SIDES = ("left", "right", "top", "bottom")
_COLUMNS, _ROWS = ("left", "", "right"), ("top", "", "bottom")


def place_of(box: Box, size: tuple[int, int]) -> str:
    """The part of the picture in which the middle of a box lies.

    >>> place_of((0, 0, 10, 10), (640, 480)), place_of((300, 220, 40, 40), (640, 480))
    ('at the top left', 'in the middle')

    Args:
        box: Of a region.
        size: (width, height) of the picture, pixels.
    """
    x, y = box[0] + box[2] / 2, box[1] + box[3] / 2
    column = _COLUMNS[_third(x, size[0])]
    row = _ROWS[_third(y, size[1])]
    words = " ".join(w for w in (row, column) if w)
    if not words:
        return "in the middle"
    return f"at the {words}" if row else f"on the {words}"


def _third(value: float, length: int) -> int:
    return min(2, max(0, int(3 * value / max(1, length))))


def sides_of(box: Box, size: tuple[int, int]) -> tuple[str, ...]:
    """The sides of the picture that a box reaches.

    >>> sides_of((0, 200, 30, 30), (640, 480)), sides_of((300, 200, 30, 30), (640, 480))
    (('left',), ())

    Args:
        box: Of a region.
        size: (width, height) of the picture, pixels.
    """
    x, y, w, h = box
    gaps = (x / size[0], 1 - (x + w) / size[0], y / size[1], 1 - (y + h) / size[1])
    near = [(gap, side) for gap, side in zip(gaps, SIDES, strict=True) if gap <= MAX_BORDER_GAP]
    return tuple(side for _, side in sorted(near, key=lambda g: g[0]))
