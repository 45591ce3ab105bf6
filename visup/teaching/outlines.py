"""Outlines as a user types them: `NAME=x,y x,y ...`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from visup.agent.model.errors import SettingsError

EXPECTED = 'NAME=x,y x,y x,y ..., such as "gripper=480,122 532,122 524,165"'

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_BETWEEN = re.compile(r"[\s,;()\[\]]*")
_CORNER = re.compile(rf"[(\[]?\s*({_NUMBER})\s*[,\s]\s*({_NUMBER})\s*[)\]]?")
_LOOKS_LIKE_CORNERS = re.compile(r"[\d\s.,;()\[\]+-]+")


@dataclass(frozen=True, slots=True)
class DrawnOutline:
    """A thing's outline, drawn in one picture.

    Attributes:
        name: Of the thing.
        corners: At least three (x, y), pixels of the picture, y down.
    """

    name: str
    corners: tuple[tuple[float, float], ...]


def parse_outline(text: str) -> DrawnOutline:
    """An outline as it was typed; corners may stand in brackets, be separated by blanks or semicolons.

    >>> parse_outline("part = 10,20 30,20; (30, 40)")
    DrawnOutline(name='part', corners=((10.0, 20.0), (30.0, 20.0), (30.0, 40.0)))

    Raises:
        SettingsError: It cannot be read; the message quotes the place.
    """
    name, equals, rest = text.partition("=")
    name = name.strip()
    if not equals or not name:
        raise SettingsError(f"--outline {_short(text)!r} has no name", expected=EXPECTED)
    corners = tuple(_corners(name, rest))
    if len(corners) < 3:
        raise SettingsError(
            f"the outline of '{name}' has too few corners: {len(corners)}",
            expected=EXPECTED,
        )
    return DrawnOutline(name, corners)


def _corners(name: str, text: str) -> Iterable[tuple[float, float]]:
    at = _skip(text, 0)
    while at < len(text):
        found = _CORNER.match(text, at)
        if found is None:
            raise SettingsError(
                f"the outline of '{name}' cannot be read at {_short(text[at:])!r}",
                expected=EXPECTED,
            )
        x, y = (float(n) for n in found.groups())
        if not (math.isfinite(x) and math.isfinite(y)):
            raise SettingsError(f"the outline of '{name}' has a corner that is nowhere")
        yield x, y
        at = _skip(text, found.end())


def _skip(text: str, at: int) -> int:
    between = _BETWEEN.match(text, at)
    return between.end() if between else at


def _short(text: str) -> str:
    return text if len(text) <= 24 else text[:23] + "…"


def parse_things(texts: Iterable[str]) -> dict[str, int]:
    """What objects of a run were, from `NAME=OBJECT`.

    >>> parse_things(["gripper=4", "part = 2"])
    {'gripper': 4, 'part': 2}

    Raises:
        SettingsError: One is not of that form, or an object or a name is there twice.
    """
    things: dict[str, int] = {}
    for text in texts:
        name, _, number = (part.strip() for part in text.rpartition("="))
        if not (name and number.isdecimal()):
            raise SettingsError(
                f"--thing {text!r} cannot be read", expected="NAME=OBJECT, such as gripper=4"
            )
        if name in things or int(number) in things.values():
            raise SettingsError(f"--thing {text!r}: '{name}' or object {number} is there twice")
        things[name] = int(number)
    return things


def join_corners(words: Sequence[str], flag: str = "--outline") -> list[str]:
    """Words of a command line in which the corners of an outline are one word, quoted or not.

    >>> join_corners(["clip.mp4", "--outline", "part=1,2", "3,4", "5,6", "--models", "a.models"])
    ['clip.mp4', '--outline', 'part=1,2 3,4 5,6', '--models', 'a.models']
    """
    joined: list[str] = []
    expects_outline = in_outline = False
    for word in words:
        if expects_outline or word.startswith(f"{flag}="):
            joined.append(word)
            expects_outline, in_outline = False, True
        elif in_outline and _LOOKS_LIKE_CORNERS.fullmatch(word):
            joined[-1] += f" {word}"
        else:
            joined.append(word)
            expects_outline, in_outline = word == flag, False
    return joined
