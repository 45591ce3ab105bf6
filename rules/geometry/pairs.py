"""Pairs of objects as one flat list: (0, 1), (0, 2), ..., (1, 2), ...; half of a square table."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.intp]


@lru_cache(maxsize=128)
def pairs(m: int) -> tuple[Indices, Indices]:
    """First and second index of every pair of m objects; read only.

    >>> [x.tolist() for x in pairs(3)]
    [[0, 0, 1], [1, 2, 2]]
    """
    first, second = np.triu_indices(m, 1)
    first.flags.writeable = second.flags.writeable = False
    return first, second


@lru_cache(maxsize=32)
def reindexing(old: tuple[int, ...], new: tuple[int, ...]) -> tuple[Indices, Indices]:
    """Indices of objects, and of pairs of them, in an earlier list.

    Args:
        old: Ids before, ascending.
        new: Ids now, ascending.

    Returns:
        For each new object its index among the old ones, for each new pair its number among the
        old pairs; -1 where there was none. Read only.
    """
    place = {object_id: i for i, object_id in enumerate(old)}
    rows = np.array([place.get(i, -1) for i in new], dtype=np.intp)
    i, j = pairs(len(new))
    low, high, m = rows[i], rows[j], len(old)
    number = low * m - low * (low + 1) // 2 + high - low - 1
    number = np.where((low >= 0) & (high >= 0), number, -1).astype(np.intp)
    rows.flags.writeable = number.flags.writeable = False
    return rows, number
