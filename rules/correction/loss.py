"""What a change of a text loses of what was written: a change may be legal and mean something else.

Words and numbers that a change takes out count; half where others are put in their place, since these may say
the same. Those that turn a meaning round count more, and what nobody has written counts a little.
"""

from __future__ import annotations

import re
from collections import Counter

from visup.rules.correction.everyday import FILLERS

KNOWN = 1.75
"""What a usual meaning may lose more than an edit of which nothing is known but that it is legal."""

_CONTENT = re.compile(r"\d+(?:\.\d+)?|[^\W\d_]+|[|]")
NUMBER_WEIGHT = 2
"""A number is seldom said in other words."""
REPLACED = 0.5
TURNING_WEIGHT = 3
"""Without them a text says the contrary, or the same of another time; or they begin a statement."""
TURNING = frozenset(
    (
        *("not", "never", "already", "optional", "another", "unless", "eventually", "henceforth"),
        *("once", "previous", "since", "until", "always", "actor", "bystander", "zone", "ground"),
        *("parameter", "task", "include", "part"),
    )
)
MADE_UP = 0.25
"""Putting a word in is better than leaving one out, and worse than a sign alone."""
LITTLE = 0.75
"""Loss up to which a change is taken without looking for another: a word replaced, or three put in."""


def loss(before: str, after: str) -> float:
    """What of a text is lost in another.

    >>> loss("touching(a, b) within 5 frames", "touching(a, b) within 5 s")
    0.5
    >>> loss("pick and place", "pick_and_place")
    0.0
    >>> loss("touching(a, b) within 5 frames", "touching(a, b)")
    4.0
    >>> loss("hidden(a) not", "not hidden(a)"), loss("hidden(a) not", "hidden(a)")
    (0.0, 3.0)
    """
    old, new = _content(before), _content(after)
    lost, made_up = old - new, Counter(set((new - old).elements()))
    turned = TURNING_WEIGHT * _turning(lost) + _turning(made_up)
    left_out, put_in = _weight(lost), _weight(made_up)
    replaced = min(left_out, put_in)
    return turned + left_out - (1 - REPLACED) * replaced + MADE_UP * (put_in - replaced)


def _content(text: str) -> Counter[str]:
    """The words and numbers of a text that mean something; comments count, too."""
    said = map(str.casefold, _CONTENT.findall(text))
    dull = FILLERS | {"and"}
    return Counter(w for w in said if w not in dull or w == "a")  # an object is often called a


def _weight(words: Counter[str]) -> float:
    some = ((w, n) for w, n in words.items() if w not in TURNING)
    return sum(n * (NUMBER_WEIGHT if w[0].isdigit() else 1) for w, n in some)


def _turning(words: Counter[str]) -> int:
    return sum(n for w, n in words.items() if w in TURNING)
