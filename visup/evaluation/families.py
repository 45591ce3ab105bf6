"""Families of sequences (one scene, camera or film), and how sure a mean over them is: they fail together."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Mapping

Scores = Mapping[str, float]
"""A figure of each sequence, by name."""

_FIRST_WORD = re.compile(r"[^\W\d_]+")


def family_of(name: str) -> str:
    """The family of a sequence: the first word of the last part of its name.

    Data sets name sequences of one scene, camera or film alike, and this says so too often rather than too
    seldom: two sets' `tennis` are one family.

    >>> [family_of(n) for n in ("moseg/cars4", "davis/drift-straight", "09")]
    ['cars', 'drift', '09']
    """
    last = name.rsplit("/", 1)[-1].lower()
    found = _FIRST_WORD.match(last)
    return found[0] if found else last


def mean_and_spread(scores: Scores) -> tuple[float, float]:
    """The mean over sequences, and its standard error when families are what was drawn.

    Sequences of one family fail together, so their deviations are summed before they are squared.

    Args:
        scores: Of at least one sequence.

    Returns:
        Mean and standard error; the latter is infinite where there is only one family.
    """
    mean = sum(scores.values()) / len(scores)
    off: dict[str, float] = defaultdict(float)
    for name, value in scores.items():
        off[family_of(name)] += value - mean
    families = len(off)
    if families < 2:
        return mean, math.inf
    total = sum(d * d for d in off.values())
    return mean, math.sqrt(total * families / (families - 1)) / len(scores)
