"""Cross-validation folds of families, and the choice of settings on the other folds.

Sequences of one family (the same scene, camera or film) are never on both sides of a fold. All functions are
pure; `visup.evaluation.cross_validation` does the measuring.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from visup.evaluation.families import Scores, family_of


def dealt(names: Iterable[str], folds: int) -> dict[str, int]:
    """Assign whole families to folds, the largest first, each to the smallest fold so far.

    Args:
        names: Names of sequences.
        folds: Number of folds, at least 1.

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
    """The settings with which each fold is scored: the best on all other folds.

    Args:
        tried: Scores of every sequence for each of the settings; the first are the defaults.
        fold: The fold of each sequence.

    Returns:
        Number of a fold -> index of its settings; the earlier among equals, and the defaults without other
        folds.
    """
    out = {}
    for number in sorted(set(fold.values())):
        rest = [n for n, f in fold.items() if f != number]
        sums = [sum(scores[n] for n in rest) for scores in tried]
        out[number] = sums.index(max(sums))
    return out


def gains(scores: Scores, before: Scores) -> dict[str, float]:
    """The gain of each sequence over an earlier score, for common sequences."""
    return {n: value - before[n] for n, value in scores.items() if n in before}
