"""Qualitative states that do not flicker: a change must last before it is believed.

One latch holds many states at once (such as the trend of every pair of objects), as arrays. The
noise thresholds of entering and leaving a state are the caller's, who knows the quantity behind
it; the latch adds the least duration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int8]
UNKNOWN = -1
"""The code of a state of which nothing is known; every latch starts there."""


@dataclass(frozen=True, slots=True, eq=False)
class Latch:
    """Qualitative states with their age.

    Attributes:
        state: int8 codes, any shape; `UNKNOWN` where nothing is known.
        since: Same shape, float: seconds since when each state is believed.
        pending: Same shape, int8: the state that wants to be believed.
        pending_since: Same shape, float: seconds since when it wants that.
    """

    state: Codes
    since: NDArray[np.float64]
    pending: Codes
    pending_since: NDArray[np.float64]

    def select(self, rows: NDArray[np.intp], now: float) -> Latch:
        """The latch of pairs of other objects.

        Args:
            rows: (N,) where each of the new objects stood before, -1 for new ones.
            now: Seconds.

        Returns:
            A latch of shape (N, N); pairs with a new object start unknown.
        """
        blank = unknown_latch((len(rows), len(rows)), now)
        if not (rows >= 0).any() or self.state.size == 0:
            return blank
        at = np.ix_(rows, rows)
        known = (rows >= 0)[:, None] & (rows >= 0)[None, :]
        return Latch(
            np.where(known, self.state[at], blank.state),
            np.where(known, self.since[at], blank.since),
            np.where(known, self.pending[at], blank.pending),
            np.where(known, self.pending_since[at], blank.pending_since),
        )


def unknown_latch(shape: tuple[int, ...], now: float) -> Latch:
    """A latch of which nothing is known yet."""
    codes = np.full(shape, UNKNOWN, dtype=np.int8)
    return Latch(codes, np.full(shape, now), codes, np.full(shape, now))


def step(latch: Latch, wanted: Codes, now: float, minimum_s: float) -> Latch:
    """Move every state towards what the latest measurement wants.

    A known state wants to be believed for `minimum_s` without a break before it is; to become
    unknown takes no time, since nothing is claimed by it.

    Args:
        latch: The states before.
        wanted: Codes of the same shape, what the measurement says now.
        now: Seconds.
        minimum_s: Least duration, seconds.

    Returns:
        The states after; `since` is when the believed state began to show.
    """
    same = wanted == latch.pending
    pending_since = np.where(same, latch.pending_since, now)
    ripe = (now - pending_since >= minimum_s - 1e-9) | (wanted == UNKNOWN)
    change = ripe & (wanted != latch.state)
    return Latch(
        np.where(change, wanted, latch.state).astype(np.int8),
        np.where(change, pending_since, latch.since),
        wanted.astype(np.int8),
        pending_since,
    )
