"""What a change of a text loses of what was written: a change may be legal and mean something else.

Words and numbers that a change takes out count; half where others are put in their place, since these may say
the same. Those that turn a meaning round count more, and what nobody has written counts a little.
"""

from __future__ import annotations

import re
from collections import Counter

from visup.rules.correction.everyday_phrases import FILLERS

COMMON_FIX_BONUS = 1.75
"""What a usual meaning may lose more than an edit of which nothing is known but that it is legal."""

_DULL = FILLERS | {"and"}
_CONTENT = re.compile(r"\d+(?:\.\d+)?|[^\W\d_]+|[|]")
NUMBER_WEIGHT = 2
"""A number is seldom said in other words."""
REPLACED_WEIGHT = 0.5
NEGATING_WEIGHT = 3
"""Without them a text says the contrary, or the same of another time; or they begin a statement."""
NEGATING = frozenset(
    (
        *("not", "never", "already", "optional", "another", "unless", "eventually", "henceforth"),
        *("once", "previous", "since", "until", "always", "actor", "bystander", "zone", "ground"),
        *("parameter", "task", "include", "part"),
    )
)
ADDED_WEIGHT = 0.25
"""Putting a word in is better than leaving one out, and worse than a sign alone."""
SMALL_LOSS = 0.75
"""Loss up to which a change is taken without looking for another: a word replaced, or three put in."""


def meaning_lost(before: str, after: str) -> float:
    """What of a text is lost in another.

    >>> meaning_lost("touching(a, b) within 5 frames", "touching(a, b) within 5 s")
    0.5
    >>> meaning_lost("pick and place", "pick_and_place")
    0.0
    >>> meaning_lost("touching(a, b) within 5 frames", "touching(a, b)")
    4.0
    >>> meaning_lost("hidden(a) not", "not hidden(a)"), meaning_lost("hidden(a) not", "hidden(a)")
    (0.0, 3.0)
    """
    old, new = _content(before), _content(after)
    lost, made_up = old - new, Counter(set((new - old).elements()))
    turned = NEGATING_WEIGHT * _negating(lost) + _negating(made_up)
    left_out, put_in = _weight(lost), _weight(made_up)
    replaced = min(left_out, put_in)
    return turned + left_out - (1 - REPLACED_WEIGHT) * replaced + ADDED_WEIGHT * (put_in - replaced)


def _content(text: str) -> Counter[str]:
    """The words and numbers of a text that mean something; comments count, too."""
    said = map(str.casefold, _CONTENT.findall(text))
    return Counter(w for w in said if w not in _DULL or w == "a")  # an object is often called a


def _weight(words: Counter[str]) -> float:
    some = ((w, n) for w, n in words.items() if w not in NEGATING)
    return sum(n * (NUMBER_WEIGHT if w[0].isdigit() else 1) for w, n in some)


def _negating(words: Counter[str]) -> int:
    return sum(n for w, n in words.items() if w in NEGATING)
