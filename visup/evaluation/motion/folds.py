"""Figures on what was left out: folds of families, and choice by the rest.

Two sequences of one family (the same scene, camera or film) never stand on both sides of a fold. All
functions are pure; `visup.evaluation.cross_validation` measures what they judge.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from visup.evaluation.families import Scores, family_of


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
