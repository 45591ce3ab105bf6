"""Families of sequences (same scene, camera or film), and standard errors over families."""

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

    Data sets name sequences of one scene, camera or film alike; this errs on the side of merging: the
    `tennis` of two sets is one family.

    >>> [family_of(n) for n in ("moseg/cars4", "davis/drift-straight", "09")]
    ['cars', 'drift', '09']
    """
    last = name.rsplit("/", 1)[-1].lower()
    match = _FIRST_WORD.match(last)
    return match[0] if match else last


def mean_and_spread(scores: Scores) -> tuple[float, float]:
    """The mean over sequences, and its standard error with families as clusters.

    Sequences of one family are correlated, so their deviations are summed before they are squared.

    Args:
        scores: Scores of at least one sequence.

    Returns:
        Mean and standard error; the latter is infinite for a single family.
    """
    mean = sum(scores.values()) / len(scores)
    family_deviations: dict[str, float] = defaultdict(float)
    for name, value in scores.items():
        family_deviations[family_of(name)] += value - mean
    families = len(family_deviations)
    if families < 2:
        return mean, math.inf
    total = sum(deviation * deviation for deviation in family_deviations.values())
    return mean, math.sqrt(total * families / (families - 1)) / len(scores)
