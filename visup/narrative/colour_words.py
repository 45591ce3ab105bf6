"""One plain word for the colour of an object, where it has one."""

from __future__ import annotations

from visup.percepts.colour import Palette
from visup.rules.traits.colours import colour_share

COLOUR_WORDS = (
    "red",
    "orange",
    "yellow",
    "green",
    "blue",
    "purple",
    "pink",
    "brown",
    "white",
    "black",
)
GREY = "grey"

MIN_SHARE = 0.35
"""Least share of an object's pixels for it to be called by a colour."""


def colour_word(palette: Palette) -> str | None:
    """The basic colour of most of an object, or None when no colour is that of much of it.

    A colour comes before grey, which is what light and shade leave of anything: a blue car is blue though
    its windows and tyres are not.

    >>> colour_word(((52.0, 80.0, 70.0, 0.7), (50.0, 0.0, 0.0, 0.3)))
    'red'
    """
    shares = {word: colour_share(word, palette) for word in COLOUR_WORDS}
    best = max(shares, key=lambda word: shares[word])
    if shares[best] >= MIN_SHARE:
        return best
    return GREY if colour_share(GREY, palette) >= MIN_SHARE else None
