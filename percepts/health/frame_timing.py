"""Frame timing: gaps in frame numbers or times, and repeats in place of missing frames."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from visup.percepts.health.repeated_frames import Repeat

WINDOW_S = 1.0
MAX_FRAMES = 128
FEWEST_INTERVALS = 6  # fewest intervals to estimate the usual one


@dataclass(frozen=True, slots=True)
class Arrival:
    """One frame's arrival.

    Attributes:
        time: Seconds.
        step: Frames since the previous one, by number.
        wait: Seconds since the previous one.
        repeated: Its image is that of the previous one.
        stale: Number of preceding frames that only repeated another while motion went on, if this one
            is new.
        sure: Motion is clearly further than one usual step after them.
    """

    time: float
    step: int
    wait: float
    repeated: bool
    stale: int
    sure: bool


class ArrivalMonitor:
    """The last seconds of arrivals.

    Args:
        lost: Share of frames that must be missing within a second; twice that for repeats.
        gap: Frames missing in a row that are reported at once.
        frozen_s: Repeats that last this long are another fault, seconds.
    """

    def __init__(self, lost: float, gap: int, frozen_s: float) -> None:
        self._lost, self._gap, self._frozen_s = lost, gap, frozen_s
        self._recent: deque[Arrival] = deque(maxlen=MAX_FRAMES)
        self._steps: deque[int] = deque(maxlen=MAX_FRAMES)
        self._waits: deque[float] = deque(maxlen=MAX_FRAMES)
        self._repeats: deque[bool] = deque(maxlen=MAX_FRAMES)
        self._run = 0
        self._run_s = 0.0
        self._last: tuple[int, float] | None = None

    def arrive(self, index: int, time: float, repeat: Repeat | None) -> int:
        """Add a frame.

        Args:
            index: Its number.
            time: Seconds.
            repeat: Comparison of its image with earlier ones; None when a fault of the image prevents it.


        Returns:
            Number of recently missing frames if too many, else 0.
        """
        last, self._last = self._last, (index, time)
        if last is None:
            return 0
        stale = self._stale(repeat, time - last[1])
        sure = stale > 0 and repeat is not None and repeat.catches_up
        repeated = repeat is not None and repeat.near
        new = Arrival(time, index - last[0], time - last[1], repeated, stale, sure)
        self._recent.append(new)
        past = []
        while time - self._recent[0].time >= WINDOW_S:
            past.append(self._recent.popleft().repeated)
        missing = self._missing()
        if not missing:
            self._repeats.extend(past)
            self._steps.append(new.step)
            self._waits.append(new.wait)
        if len(self._repeats) < FEWEST_INTERVALS:
            # Until the window has filled, the first frames alone define the usual rate.
            self._repeats.append(new.repeated)
        return missing

    def _stale(self, repeat: Repeat | None, wait: float) -> int:
        """Length of the run of repeats that ends with this frame, if motion continued during it."""
        if repeat is None:
            self._run, self._run_s = 0, 0.0
            return 0
        run, lasted = self._run, self._run_s
        self._run, self._run_s = (run + 1, lasted + wait) if repeat.near else (0, 0.0)
        return run if repeat.resumes and lasted < self._frozen_s else 0

    def _missing(self) -> int:
        if len(self._waits) < FEWEST_INTERVALS:
            return 0
        step = max(1.0, float(np.median(self._steps)))
        wait = float(np.quantile(self._waits, 0.75))
        # Many cameras repeat frames all the time, in low light or to fill a rate.
        repeats_usually = float(np.mean(self._repeats)) > 0.04
        gaps = [max(a.step / step, a.wait / wait) - 1.0 for a in self._recent]
        total = sum(g for g in gaps if g > 0.6) - self._early(wait, step)
        stale = 0 if repeats_usually else self._recent_stale()
        expected = WINDOW_S / wait
        if max(gaps, default=0.0) > self._gap - 0.4:
            return round(total)
        # Frame numbers are reliable; an image may repeat another for a frame or two by chance.
        sure = total >= max(3.0, self._lost * expected)
        too_many = sure or total + stale >= max(3.0, 2.0 * self._lost * expected)
        return round(total + stale) if too_many else 0

    def _early(self, wait: float, step: float) -> float:
        """Frames that came early; they compensate for late ones, which are not missing."""
        shares = [a.wait / wait for a in self._recent if a.step <= step]
        return sum(1.0 - share for share in shares if share < 0.4)

    def _recent_stale(self) -> int:
        """Recent frames replaced by repeats; a single run counts only if motion caught up after it."""
        runs = [a for a in self._recent if a.stale]
        believed = len(runs) > 1 or any(a.sure for a in runs)
        return sum(a.stale for a in runs) if believed else 0
