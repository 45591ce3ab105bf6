"""Qualitative states that do not flicker: a change must last before it is believed.

Many states are held at once (such as the trend of every pair of objects), as arrays. The noise
thresholds of entering and leaving a state are the caller's, who knows the quantity behind it
(`signs_with_hysteresis` serves for quantities that are compared with zero); the least duration is added here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled

Codes = NDArray[np.int8]
Floats = NDArray[np.float64]
UNKNOWN = -1
"""The code of a state of which nothing is known; every state starts there."""
BELOW, WITHIN, ABOVE = 0, 1, 2
"""Codes of a sign."""


@dataclass(frozen=True, slots=True, eq=False)
class HysteresisState:
    """Qualitative states with their age.

    Attributes:
        state: int8 codes, any shape; `UNKNOWN` where nothing is known.
        since: Same shape, float: seconds since when each state is believed.
        pending: Same shape, int8: the state that wants to be believed.
        pending_since: Same shape, float: seconds since when it wants that.
    """

    state: Codes
    since: Floats
    pending: Codes
    pending_since: Floats

    def select(self, places: NDArray[np.intp], now: float) -> HysteresisState:
        """The states of other pairs.

        Args:
            places: (N,) where each of the new pairs stood before along the last axis, -1 for new
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
    """States of which nothing is known yet."""
    codes = np.full(shape, UNKNOWN, dtype=np.int8)
    return HysteresisState(codes, np.full(shape, now), codes, np.full(shape, now))


def advance(
    states: HysteresisState, wanted: Codes, now: float, minimum_s: float | Floats
) -> HysteresisState:
    """Move every state towards what the latest measurement wants.

    A known state is left once nothing has spoken for it for `minimum_s` without a break, for what is
    wanted then; from an unknown one the same must have been wanted for so long. To become unknown takes
    no time, since nothing is claimed by it.

    Args:
        states: The states before.
        wanted: Codes of the same shape, what the measurement says now.
        now: Seconds.
        minimum_s: Least duration, seconds; one for all, or one for each row.

    Returns:
        The states after; `since` is when the believed state began to show.
    """
    if _alike(wanted, states.pending) and _alike(wanted, states.state):
        return states  # Nothing wants to change, as nearly always.
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
            # What is left for one thing now, for another next, is left all the same.
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
