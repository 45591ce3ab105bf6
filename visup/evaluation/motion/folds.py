"""Figures on what was left out: families of sequences, folds of families, choice by the rest, spreads.

Two sequences of one family (the same scene, camera or film) never stand on both sides of a fold. All
functions are pure; `visup.evaluation.cross_validation` measures what they judge.
"""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence

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


def dealt(names: Iterable[str], folds: int) -> dict[str, int]:
    """The fold of each sequence: whole families, the largest first, each to the fold that has least so far.

    Args:
        names: Of sequences.
        folds: How many folds, at least 1.

    Returns:
        Name -> number of its fold, from 0.
    """
    names = sorted(names)
    sizes = Counter(family_of(n) for n in names)
    filled = [0] * folds
    fold: dict[str, int] = {}
    for family in sorted(sizes, key=lambda f: (-sizes[f], f)):
        fold[family] = min(range(folds), key=lambda i: (filled[i], i))
        filled[fold[family]] += sizes[family]
    return {n: fold[family_of(n)] for n in names}


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


def chosen(tried: Sequence[Scores], fold: Mapping[str, int]) -> dict[int, int]:
    """Which of the tried settings each fold is scored with: the best on all other folds.

    Args:
        tried: For each of the settings the figure of every sequence; the first are the defaults.
        fold: The fold of each sequence.

    Returns:
        Number of a fold -> place of its settings; the earlier among equals, and where nothing is left to
        choose by, the defaults.
    """
    out = {}
    for number in sorted(set(fold.values())):
        rest = [n for n, f in fold.items() if f != number]
        sums = [sum(scores[n] for n in rest) for scores in tried]
        out[number] = sums.index(max(sums))
    return out


def gains(scores: Scores, before: Scores) -> dict[str, float]:
    """How much higher each sequence's figure is than before; sequences that both have."""
    return {n: value - before[n] for n, value in scores.items() if n in before}
