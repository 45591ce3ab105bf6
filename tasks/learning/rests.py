"""Actors that stay at rest in all good runs, and the invariant that they must not be pushed.

A resting body appears to move when another passes in front of it or is placed on it, so *moving* holds at
times; but its velocity is then uncertain, whereas that of a pushed body is well known.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from math import ceil

from visup.tasks.learning.traces import SUSTAINED_S, RunTrace

REST = 0.02
"""Greatest speed of an actor at rest, image diagonals per second."""
LEAST_ALLOWED = 0.04
"""Lowest limit of the invariant, image diagonals per second. From masks, of 40 objects at rest in good worlds
of fresh seeds none clearly moved faster than .01; of 15 that were rammed one moved at .05, one at
.08 and all others at .1 or more."""
TIMES_SEEN = 4.0
"""The limit is also at least this many times the greatest speed in a good run."""


@dataclass(frozen=True, slots=True)
class Rest:
    """An actor at rest in all good runs.

    Attributes:
        actor: Its name.
        seen: Greatest speed of clear motion, px/s.
        allowed: Speed limit, px/s.
    """

    actor: str
    seen: float
    allowed: int

    def invariant(self, runs: str) -> str:
        """The invariant as a line of a task file.

        Args:
            runs: Number of supporting runs, in words.
        """
        fast = f"speed({self.actor}) > {self.allowed} px/s and moving_clearly({self.actor})"
        return f"never {fast} for {SUSTAINED_S:g} s  # in {runs} at most {self.seen:.0f} px/s"


def rests_of(runs: Sequence[RunTrace], actors: Collection[str]) -> Iterator[Rest]:
    """The actors at rest in all runs, in alphabetical order.

    Args:
        runs: Good runs.
        actors: The actors of the task.
    """
    diagonal = min(run.diagonal for run in runs)
    for actor in sorted(actors):
        speeds = [run.fastest[actor] for run in runs if actor in run.fastest]
        if len(speeds) == len(runs) and max(speeds) <= REST * diagonal:
            allowed = max(LEAST_ALLOWED * diagonal, TIMES_SEEN * max(speeds))
            yield Rest(actor, max(speeds), 5 * ceil(allowed / 5))
