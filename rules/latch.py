"""Qualitative states that do not flicker: a change must last before it is believed.

One latch holds many states at once (such as the trend of every pair of objects), as arrays. The
noise thresholds of entering and leaving a state are the caller's, who knows the quantity behind
it (`hold_sign` serves for quantities that are compared with zero); the latch adds the least
duration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int8]
Floats = NDArray[np.float64]
UNKNOWN = -1
"""The code of a state of which nothing is known; every latch starts there."""
BELOW, WITHIN, ABOVE = 0, 1, 2
"""Codes of a sign."""


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
    since: Floats
    pending: Codes
    pending_since: Floats

    def select(self, places: NDArray[np.intp], now: float) -> Latch:
        """The latch of other pairs.

        Args:
            places: (N,) where each of the new pairs stood before along the last axis, -1 for new
                ones.
            now: Seconds.

        Returns:
            A latch whose last axis has length N; new pairs start unknown.
        """
        blank = unknown_latch((*self.state.shape[:-1], len(places)), now)
        known = places >= 0
        if not known.any():
            return blank
        return Latch(
            np.where(known, self.state[..., places], blank.state),
            np.where(known, self.since[..., places], blank.since),
            np.where(known, self.pending[..., places], blank.pending),
            np.where(known, self.pending_since[..., places], blank.pending_since),
        )


def unknown_latch(shape: tuple[int, ...], now: float) -> Latch:
    """A latch of which nothing is known yet."""
    codes = np.full(shape, UNKNOWN, dtype=np.int8)
    return Latch(codes, np.full(shape, now), codes, np.full(shape, now))


def step(latch: Latch, wanted: Codes, now: float, minimum_s: float | Floats) -> Latch:
    """Move every state towards what the latest measurement wants.

    A known state wants to be believed for `minimum_s` without a break before it is; to become
    unknown takes no time, since nothing is claimed by it.

    Args:
        latch: The states before.
        wanted: Codes of the same shape, what the measurement says now.
        now: Seconds.
        minimum_s: Least duration, seconds; one for all, or an array that can be broadcast.

    Returns:
        The states after; `since` is when the believed state began to show.
    """
    if _alike(wanted, latch.pending) and _alike(wanted, latch.state):
        return latch  # Nothing wants to change, as nearly always.
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


def _alike(a: Codes, b: Codes) -> bool:
    return a.shape == b.shape and a.tobytes() == b.tobytes()


def hold_sign(values: Floats, before: Codes, enter: float | Floats, leave: float | Floats) -> Codes:
    """The signs of quantities, with hysteresis (a Schmitt trigger on either side of zero).

    A sign begins beyond `enter` and ends within `leave`. One that is not known yet is judged by the
    middle of the two, so that noise must cross half of the band to change it, wherever in the band
    the quantity may lie.

    Args:
        values: Any shape; NaN unknown.
        before: Same shape: signs so far, `BELOW`, `WITHIN`, `ABOVE` or `UNKNOWN`.
        enter: Magnitude beyond which a quantity has a sign.
        leave: Magnitude within which it has none; at most `enter`.

    Returns:
        Signs of the same shape; `UNKNOWN` for NaN.
    """
    sign = (values > 0.0).view(np.int8) * np.int8(2)
    size = np.abs(values)
    held = np.where(before == UNKNOWN, size > 0.5 * (enter + leave), before == sign)
    held &= size > leave
    held |= size > enter
    # What is in the band but was on the other side of zero has crossed it: no sign.
    code = np.where(held, sign, np.int8(WITHIN))
    unknown = values != values  # NaN is not equal to itself
    if unknown.any():
        code[unknown] = UNKNOWN
    return code
