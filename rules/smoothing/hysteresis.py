"""Qualitative states with hysteresis in time: a change must last before it is accepted.

Many states are processed at once (such as the trend of every pair of objects), as arrays. Noise thresholds
for entering and leaving a state are the caller's, who knows the underlying quantity (`signs_with_hysteresis`
serves for quantities compared with zero); the least duration is added here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Codes = NDArray[np.int8]
Floats = NDArray[np.float64]
UNKNOWN = -1
"""The code of an unknown state; every state starts there."""
BELOW, WITHIN, ABOVE = 0, 1, 2
"""Codes of a sign."""


@dataclass(frozen=True, slots=True, eq=False)
class HysteresisState:
    """Qualitative states with their age.

    Attributes:
        state: int8 codes, any shape; `UNKNOWN` where unknown.
        since: Same shape, float: seconds since when each state has held.
        pending: Same shape, int8: the candidate for the next state.
        pending_since: Same shape, float: seconds since when it has been the candidate.
    """

    state: Codes
    since: Floats
    pending: Codes
    pending_since: Floats

    def select(self, places: NDArray[np.intp], now: float) -> HysteresisState:
        """Re-index the states for other pairs.

        Args:
            places: (N,) former position of each new pair along the last axis, -1 for new
                ones.
            now: Seconds.

        Returns:
            States whose last axis has length N; new pairs start unknown.
        """
        blank = unknown_states((*self.state.shape[:-1], len(places)), now)
        known = places >= 0
        if not known.any():
            return blank
        return HysteresisState(
            np.where(known, self.state.take(places, axis=-1), blank.state),
            np.where(known, self.since.take(places, axis=-1), blank.since),
            np.where(known, self.pending.take(places, axis=-1), blank.pending),
            np.where(known, self.pending_since.take(places, axis=-1), blank.pending_since),
        )


def unknown_states(shape: tuple[int, ...], now: float) -> HysteresisState:
    """Unknown states."""
    codes = np.full(shape, UNKNOWN, dtype=np.int8)
    return HysteresisState(codes, np.full(shape, now), codes, np.full(shape, now))


def advance(
    states: HysteresisState, wanted: Codes, now: float, minimum_s: float | Floats
) -> HysteresisState:
    """Move every state towards the latest measurement.

    A known state is left once nothing has supported it for `minimum_s` without a break, for the one
    measured then; an unknown one once the same has been measured for that long. Becoming unknown takes
    no time, since it claims nothing.

    Args:
        states: The states before.
        wanted: Codes of the same shape, as measured now.
        now: Seconds.
        minimum_s: Least duration, seconds; one for all, or one for each row.

    Returns:
        The states after; `since` is when the new state was first measured.
    """
    if _alike(wanted, states.pending) and _alike(wanted, states.state):
        return states  # fast path: no change
    lasts = np.atleast_1d(np.asarray(minimum_s, dtype=float)).reshape(-1)
    rows, shape = (len(lasts), -1), wanted.shape
    state, since, pending, waiting = _advanced(
        states.state.reshape(rows),
        states.since.reshape(rows),
        states.pending.reshape(rows),
        states.pending_since.reshape(rows),
        wanted.reshape(rows),
        now,
        lasts,
    )
    return HysteresisState(
        state.reshape(shape), since.reshape(shape), pending.reshape(shape), waiting.reshape(shape)
    )


@compiled
def _advanced(
    state: Codes,
    since: Floats,
    pending: Codes,
    pending_since: Floats,
    wanted: Codes,
    now: float,
    lasts: Floats,
) -> tuple[Codes, Floats, Codes, Floats]:
    after, moments, waiting = state.copy(), since.copy(), pending_since.copy()
    for row in range(len(state)):
        for k in range(state.shape[1]):
            # A state keeps being left even if its candidate successor changes.
            was, to, wish = state[row, k], pending[row, k], wanted[row, k]
            left = was != UNKNOWN and to != UNKNOWN and to != was and wish != was
            if wish != to and not left:
                waiting[row, k] = now
            if wanted[row, k] == state[row, k]:
                continue
            if wanted[row, k] == UNKNOWN or now - waiting[row, k] >= lasts[row] - 1e-9:
                after[row, k], moments[row, k] = wanted[row, k], waiting[row, k]
    return after, moments, wanted.copy(), waiting


def _alike(a: Codes, b: Codes) -> bool:
    return a.shape == b.shape and a.tobytes() == b.tobytes()
