"""What a change of a text loses of what was written: a change may be legal and mean something else.

Words and numbers that a change takes out count; half where others are put in their place, since these may say
the same.
"""

from __future__ import annotations

import re
from collections import Counter

from visup.rules.correction.everyday import FILLERS

_CONTENT = re.compile(r"\d+(?:\.\d+)?|[^\W\d_]+|[|]")
NUMBER_WEIGHT = 2
"""A number is seldom said in other words."""
REPLACED = 0.5
LITTLE = 2.5
"""Loss up to which a change is taken without looking for another: two words left out, or five replaced."""


def loss(before: str, after: str) -> float:
    """What of a text is lost in another.

    >>> loss("touching(a, b) within 5 frames", "touching(a, b) within 5 s")
    0.5
    >>> loss("pick and place", "pick_and_place")
    0.0
    >>> loss("touching(a, b) within 5 frames", "touching(a, b)")
    4.0
    """
    old, new = _content(before), _content(after)
    lost, made_up = (_weight(one - other) for one, other in ((old, new), (new, old)))
    return lost - (1 - REPLACED) * min(lost, made_up)


def _content(text: str) -> Counter[str]:
    """The words and numbers of a text that mean something; comments count, too."""
    said = map(str.casefold, _CONTENT.findall(text))
    return Counter(w for w in said if w not in FILLERS or w == "a")  # an object is often called a


def _weight(words: Counter[str]) -> float:
    return sum(n * (NUMBER_WEIGHT if w[0].isdigit() else 1) for w, n in words.items())
