"""Colours for objects, severities and states, distinguishable by the colour-blind.

The object colours are those of Okabe and Ito ("Color Universal Design", 2008), ordered so that the first ones
stand out both on a dark sky and on a light page.
"""

from __future__ import annotations

from visup.agent import Severity, Status

Rgb = tuple[int, int, int]

OBJECT_COLOURS: tuple[Rgb, ...] = (
    (86, 180, 233),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (240, 228, 66),
    (0, 114, 178),
    (213, 94, 0),
)

SEVERITY_COLOURS: dict[Severity, Rgb] = {
    Severity.INFO: (92, 107, 125),
    Severity.WARNING: (245, 176, 26),
    Severity.CRITICAL: (200, 40, 50),
}

STATUS_COLOURS: dict[Status, Rgb] = {
    Status.PENDING: (120, 130, 142),
    Status.ACTIVE: (86, 150, 205),
    Status.PROGRESSING: (38, 112, 188),
    Status.PAUSED: (110, 110, 170),
    Status.STALLED: (230, 159, 0),
    Status.FAILING: (224, 96, 30),
    Status.FAILED: (186, 32, 44),
    Status.DONE: (0, 140, 102),
    Status.UNKNOWN: (150, 118, 170),
}


def object_colour(object_id: int) -> Rgb:
    """(r, g, b) of an object; the colours repeat cyclically."""
    return OBJECT_COLOURS[(object_id - 1) % len(OBJECT_COLOURS)]


def css(colour: Rgb) -> str:
    """A CSS colour such as `#56b4e9`."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
