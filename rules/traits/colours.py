"""Colour terms: how well a colour fits a word.

Each term is a box of hue, chroma and lightness in CIE L*a*b* with soft edges. Hues are angles in that space:
red is at about 35 degrees, yellow 100, green 140, cyan 200, blue 285, magenta 330. The edges follow the
boundaries of basic colour names; neighbouring boxes overlap, since people do not agree on boundaries either.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

HUE_SOFT, CHROMA_SOFT, LIGHTNESS_SOFT = 12.0, 8.0, 10.0
"""Widths of the edges, degrees and units, over which a fit falls from 1 to 0."""

DARKEST = 12.0
"""Colours darker than this have no discernible hue: they are black."""


@dataclass(frozen=True, slots=True)
class ColourTerm:
    """A colour term.

    Attributes:
        hue: (from, to) degrees, ascending, beyond 360 on wrap-around; None for any hue.
        chroma: (least, most).
        lightness: (least, most), 0 to 100.
    """

    hue: tuple[float, float] | None
    chroma: tuple[float, float]
    lightness: tuple[float, float]


ANY = (0.0, 200.0)
STRONG, WEAK, NONE = (22.0, 200.0), (8.0, 30.0), (0.0, 11.0)
ALL_LIGHT = (DARKEST, 100.0)

_RED, _ORANGE, _YELLOW, _GREEN = (352.0, 410.0), (50.0, 80.0), (82.0, 112.0), (112.0, 172.0)
_CYAN, _BLUE, _PURPLE, _MAGENTA = (172.0, 235.0), (235.0, 312.0), (308.0, 338.0), (318.0, 362.0)
_PINK = (322.0, 395.0)

TERMS: Mapping[str, ColourTerm] = MappingProxyType(
    {
        "red": ColourTerm(_RED, (26.0, 200.0), (DARKEST, 66.0)),
        "scarlet": ColourTerm((380.0, 412.0), (60.0, 200.0), (35.0, 66.0)),
        "crimson": ColourTerm((370.0, 395.0), (45.0, 200.0), (25.0, 55.0)),
        "maroon": ColourTerm((360.0, 405.0), (18.0, 60.0), (DARKEST, 35.0)),
        "burgundy": ColourTerm((355.0, 395.0), (18.0, 60.0), (DARKEST, 38.0)),
        "pink": ColourTerm(_PINK, (14.0, 90.0), (60.0, 95.0)),
        "fuchsia": ColourTerm(_MAGENTA, (45.0, 200.0), (40.0, 75.0)),
        "magenta": ColourTerm(_MAGENTA, (45.0, 200.0), (30.0, 75.0)),
        "purple": ColourTerm(_PURPLE, STRONG, (DARKEST, 70.0)),
        "violet": ColourTerm((294.0, 338.0), STRONG, (DARKEST, 80.0)),
        "lilac": ColourTerm((298.0, 338.0), (12.0, 55.0), (60.0, 92.0)),
        "mauve": ColourTerm((305.0, 355.0), (10.0, 45.0), (45.0, 85.0)),
        "orange": ColourTerm((48.0, 82.0), (40.0, 200.0), (50.0, 85.0)),
        "bronze": ColourTerm((55.0, 90.0), (18.0, 60.0), (35.0, 62.0)),
        "brown": ColourTerm((32.0, 88.0), (10.0, 55.0), (DARKEST, 52.0)),
        "tan": ColourTerm((55.0, 95.0), (12.0, 42.0), (58.0, 82.0)),
        "beige": ColourTerm((55.0, 105.0), (6.0, 30.0), (72.0, 96.0)),
        "cream": ColourTerm((65.0, 112.0), (5.0, 30.0), (85.0, 100.0)),
        "ochre": ColourTerm((62.0, 92.0), (32.0, 80.0), (45.0, 75.0)),
        "mustard": ColourTerm((78.0, 102.0), (38.0, 90.0), (52.0, 82.0)),
        "gold": ColourTerm((70.0, 100.0), (32.0, 200.0), (55.0, 92.0)),
        "yellow": ColourTerm((80.0, 114.0), (32.0, 200.0), (62.0, 100.0)),
        "khaki": ColourTerm((85.0, 118.0), (12.0, 48.0), (45.0, 92.0)),
        "olive": ColourTerm((88.0, 125.0), (14.0, 62.0), (25.0, 62.0)),
        "lime": ColourTerm((108.0, 145.0), (48.0, 200.0), (62.0, 100.0)),
        "green": ColourTerm(_GREEN, (16.0, 200.0), ALL_LIGHT),
        "teal": ColourTerm((175.0, 225.0), (14.0, 60.0), (20.0, 60.0)),
        "turquoise": ColourTerm((168.0, 222.0), (18.0, 200.0), (50.0, 95.0)),
        "cyan": ColourTerm(_CYAN, (16.0, 200.0), (45.0, 100.0)),
        "blue": ColourTerm(_BLUE, (16.0, 200.0), ALL_LIGHT),
        "navy": ColourTerm((265.0, 315.0), (12.0, 90.0), (5.0, 30.0)),
        "indigo": ColourTerm((285.0, 325.0), (25.0, 200.0), (10.0, 45.0)),
        "white": ColourTerm(None, (0.0, 12.0), (80.0, 100.0)),
        "silver": ColourTerm(None, NONE, (58.0, 88.0)),
        "gray": ColourTerm(None, NONE, (28.0, 80.0)),
        "grey": ColourTerm(None, NONE, (28.0, 80.0)),
        "black": ColourTerm(None, (0.0, 16.0), (0.0, 24.0)),
    }
)
"""All colour words that a task may use."""

SHADES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"light": (60.0, 100.0), "dark": (0.0, 42.0)}
)
"""Modifier of a colour word -> required lightness."""


def colour_fit(words: str, lightness: float, a: float, b: float) -> float:
    """Fit of a colour to its words.

    Args:
        words: `red`, `dark blue`.
        lightness: L*, 0 to 100.
        a: a*.
        b: b*.

    Returns:
        0 to 1.

    Example:
        >>> colour_fit("red", 53.0, 80.0, 67.0), colour_fit("dark red", 53.0, 80.0, 67.0)
        (1.0, 0.0)
    """
    *shade, word = words.split()
    term = TERMS[word]
    least, most = term.lightness
    if shade:  # it narrows the term; dark shades of a light colour go by their hue
        low, high = SHADES[shade[0]]
        least, most = (max(least, low), 100.0) if shade[0] == "light" else (0.0, min(most, high))
    chroma = math.hypot(a, b)
    fit = _soft(lightness, least, most, LIGHTNESS_SOFT) * _soft(chroma, *term.chroma, CHROMA_SOFT)
    return fit if term.hue is None or fit == 0.0 else fit * _hue_fit(a, b, *term.hue)


def colour_share(words: str, palette: Iterable[tuple[float, float, float, float]]) -> float:
    """Share of a palette that fits a colour word: the sum of shares weighted by fit."""
    return sum(share * colour_fit(words, lightness, a, b) for lightness, a, b, share in palette)


def _soft(value: float, least: float, most: float, soft: float) -> float:
    """1 between two bounds, 0 from `soft` outside them, linear in between."""
    outside = max(least - value, value - most, 0.0)
    return max(0.0, 1.0 - outside / soft)


def _hue_fit(a: float, b: float, start: float, end: float) -> float:
    middle, half = (start + end) / 2.0, (end - start) / 2.0
    turn = (math.degrees(math.atan2(b, a)) - middle + 180.0) % 360.0 - 180.0
    return _soft(abs(turn), 0.0, half, HUE_SOFT)
