"""Allen's interval algebra (1983), and the rectangle algebra, which is Allen's along both axes."""

from __future__ import annotations

from visup.rules.calculi.rcc import Box

ALLEN = ("<", "m", "o", "s", "d", "f", "=", ">", "mi", "oi", "si", "di", "fi")
NAMES = {
    "<": "before",
    "m": "meets",
    "o": "overlaps",
    "s": "starts",
    "d": "during",
    "f": "finishes",
    "=": "equal",
    ">": "after",
    "mi": "met_by",
    "oi": "overlapped_by",
    "si": "started_by",
    "di": "contains",
    "fi": "finished_by",
}
"""Sign of a relation -> its name."""


def allen(a: tuple[float, float], b: tuple[float, float]) -> str:
    """The relation of interval a to interval b.

    Args:
        a: Start and end, the end later.
        b: Another interval.

    Returns:
        One of `ALLEN`.

    >>> allen((0, 2), (1, 3)), allen((1, 2), (0, 3)), allen((0, 1), (1, 3))
    ('o', 'd', 'm')
    """
    if a[1] < b[0]:
        return "<"
    if a[0] > b[1]:
        return ">"
    if a[1] == b[0]:
        return "m"
    if a[0] == b[1]:
        return "mi"
    if a[0] == b[0]:
        return "=" if a[1] == b[1] else "s" if a[1] < b[1] else "si"
    if a[1] == b[1]:
        return "f" if a[0] > b[0] else "fi"
    if a[0] < b[0]:
        return "o" if a[1] < b[1] else "di"
    return "d" if a[1] < b[1] else "oi"


def rectangle_relation(a: Box, b: Box) -> tuple[str, str]:
    """The relations of box a to box b along x and y: two of `ALLEN`."""
    return allen((a[0], a[2]), (b[0], b[2])), allen((a[1], a[3]), (b[1], b[3]))
