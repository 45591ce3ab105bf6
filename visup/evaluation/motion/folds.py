"""Cross-validation folds of families, and the choice of settings on the other folds.

Sequences of one family (the same scene, camera or film) are never on both sides of a fold. All functions are
pure; `visup.evaluation.cross_validation` does the measuring.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from visup.evaluation.families import Scores, family_of


def assign_folds(names: Iterable[str], folds: int) -> dict[str, int]:
    """Assign whole families to folds, the largest first, each to the smallest fold so far.

    Args:
        names: Names of sequences.
        folds: Number of folds, at least 1.

    Returns:
        Name -> number of its fold, from 0.
    """
    names = sorted(names)
    family_sizes = Counter(family_of(n) for n in names)
    fold_sizes = [0] * folds
    fold_of_family: dict[str, int] = {}
    for family in sorted(family_sizes, key=lambda f: (-family_sizes[f], f)):
        fold_of_family[family] = min(range(folds), key=lambda i: (fold_sizes[i], i))
        fold_sizes[fold_of_family[family]] += family_sizes[family]
    return {n: fold_of_family[family_of(n)] for n in names}


def select_settings(
    scores_by_settings: Sequence[Scores], fold_of: Mapping[str, int]
) -> dict[int, int]:
    """The settings with which each fold is scored: the best on all other folds.

    Args:
        scores_by_settings: Scores of every sequence for each of the settings; the first are the defaults.
        fold_of: The fold of each sequence.

    Returns:
        Number of a fold -> index of its settings; the earlier among equals, and the defaults without other
        folds.
    """
    choice = {}
    for number in sorted(set(fold_of.values())):
        others = [n for n, f in fold_of.items() if f != number]
        sums = [sum(scores[n] for n in others) for scores in scores_by_settings]
        choice[number] = sums.index(max(sums))
    return choice


def gains(scores: Scores, before: Scores) -> dict[str, float]:
    """The gain of each sequence over an earlier score, for common sequences."""
    return {n: value - before[n] for n, value in scores.items() if n in before}
