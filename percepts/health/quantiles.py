"""Quantiles of few numbers, without the overhead of NumPy's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def quantiles(values: NDArray[np.floating[Any]], *shares: float) -> list[float]:
    """Quantiles, linearly interpolated.

    Args:
        values: At least one, of any shape.
        shares: 0 to 1.

    >>> quantiles(np.array([3.0, 1.0, 2.0]), 0.5, 0.75)
    [2.0, 2.5]
    """
    ordered = np.sort(values, axis=None)
    last = len(ordered) - 1
    found = []
    for share in shares:
        low = int(share * last)
        one, other = float(ordered[low]), float(ordered[min(low + 1, last)])
        found.append(one + (share * last - low) * (other - one))
    return found
