"""Who rests in all good runs: what then must not be pushed about.

What rests seems to move where something passes before it or is put on it, so that *moving* is true at times;
its velocity is not well known then, as that of what is pushed is.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from math import ceil

from visup.tasks.learning.traces import SUSTAINED_S, RunTrace

REST = 0.02
"""Who never moves faster rests, image diagonals a second."""
LEAST_ALLOWED = 0.04
"""No slower motion is forbidden, image diagonals a second. By masks, of 40 things at rest in good worlds of
fresh seeds none clearly moved faster than .01; of 15 that were rammed one moved at .05, one at
.08 and all others at .1 or more."""
TIMES_SEEN = 4.0
"""Nor any that is not so many times as fast as what was seen in a good run."""


@dataclass(frozen=True, slots=True)
class Rest:
    """An actor that rests in all good runs.

    Attributes:
        actor: Who.
        seen: How fast it clearly moved at most, px/s.
        allowed: How fast it may, px/s.
    """

    actor: str
    seen: float
    allowed: int

    def invariant(self, runs: str) -> str:
        """The line of a task file that asks for it.

        Args:
            runs: How many runs tell of it, in words.
        """
        fast = f"speed({self.actor}) > {self.allowed} px/s and moving_clearly({self.actor})"
        return f"never {fast} for {SUSTAINED_S:g} s  # in {runs} at most {self.seen:.0f} px/s"


def rests_of(runs: Sequence[RunTrace], actors: Collection[str]) -> Iterator[Rest]:
    """Those of some actors that rest in all runs, in the order of the alphabet.

    Args:
        runs: Good ones.
        actors: Who plays in the task.
    """
    diagonal = min(run.diagonal for run in runs)
    for actor in sorted(actors):
        speeds = [run.fastest[actor] for run in runs if actor in run.fastest]
        if len(speeds) == len(runs) and max(speeds) <= REST * diagonal:
            allowed = max(LEAST_ALLOWED * diagonal, TIMES_SEEN * max(speeds))
            yield Rest(actor, max(speeds), 5 * ceil(allowed / 5))
