"""Actors that stay at rest in all good runs and must not be pushed, and those that come to rest at the end.

A resting body appears to move when another passes in front of it or is placed on it, so *moving* holds at
times; but its velocity is then uncertain, whereas that of a pushed body is well known.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, inf, isfinite

from visup.agent import Mind
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import QUANTITIES
from visup.tasks.learning.order import Occurrence
from visup.tasks.learning.traces import SUSTAINED_S, RunTrace, names_of

REST = 0.02
"""Greatest speed of an actor at rest, image diagonals per second."""
MIN_ALLOWED = 0.04
"""Lowest limit of the invariant, image diagonals per second. From masks, of 40 objects at rest in good worlds
of fresh seeds none clearly moved faster than .01; of 15 that were rammed one moved at .05, one at
.08 and all others at .1 or more."""
SPEED_MARGIN = 4.0
"""The limit is also at least this many times the greatest speed in a good run."""


@dataclass(frozen=True, slots=True)
class RestingActor:
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


def at_rest(run: RunTrace, actor: str) -> bool:
    """Whether an actor never clearly moved in a run, though noise or a swaying camera may have moved it."""
    return actor in run.fastest and run.fastest[actor] <= REST * run.diagonal


def resting_actors(runs: Sequence[RunTrace], actors: Collection[str]) -> Iterator[RestingActor]:
    """The actors at rest in all runs, in alphabetical order.

    Args:
        runs: Good runs.
        actors: The actors of the task.
    """
    diagonal = min(run.diagonal for run in runs)
    for actor in sorted(actors):
        if all(at_rest(run, actor) for run in runs):
            fastest = max(run.fastest[actor] for run in runs)
            allowed = max(MIN_ALLOWED * diagonal, SPEED_MARGIN * fastest)
            yield RestingActor(actor, fastest, 5 * ceil(allowed / 5))


REST_LIMIT = 0.01
"""Lowest speed limit of an actor that has come to rest, image diagonals per second: floating objects bob."""
REST_MARGIN = 1.5
"""The limit is also at least this many times the greatest speed at the end of a good run."""
END_WINDOW_S = 2.0
"""The final rest is measured over this long before the end of a run, seconds."""


@dataclass(frozen=True, slots=True)
class FinalRest:
    """An actor that comes to rest in the last stage of all good runs.

    Attributes:
        actor: Its name.
        allowed: Speed limit, px/s.
        rested_s: Shortest time below it at the end of a run, seconds.
    """

    actor: str
    allowed: int
    rested_s: float

    @property
    def fact(self) -> str:
        """The comparison, as in a task file."""
        return f"speed({self.actor}) < {self.allowed} px/s"


def final_rest_of(runs: Sequence[RunTrace], stage: Occurrence) -> FinalRest | None:
    """The final rest of the actor that moved more of the pair that meets in the last stage, or None.

    Args:
        runs: Good runs.
        stage: The last stage.
    """
    item = stage[0]
    if not isinstance(item, tuple) or item[0] != "touching":
        return None
    actor = max(item[1], key=lambda a: sum(run.moved_s.get(a, 0.0) for run in runs))
    rows = [_speeds(run.minds, actor) for run in runs]
    ends = [
        v for run, row in zip(runs, rows, strict=True) for t, v in row if t > run.end - END_WINDOW_S
    ]
    diagonal = min(run.diagonal for run in runs)
    if not ends or None in ends or (most := max(v or 0.0 for v in ends)) > REST * diagonal:
        return None
    allowed = ceil(max(REST_LIMIT * diagonal, REST_MARGIN * most))
    return FinalRest(actor, allowed, min(_rest_duration_s(row, allowed) for row in rows))


def _speeds(minds: Sequence[Mind], actor: str) -> list[tuple[float, float | None]]:
    """Time and greatest likely speed of an actor at each step, px/s; None while it is out of sight."""
    found = []
    for mind in minds:
        facts = Snapshot(mind)
        numbers = {name: facts.row[n] for n, name in names_of(mind).items() if n in facts.row}
        speed = (
            float(QUANTITIES["speed"].evaluate(facts)[1, numbers[actor]])
            if actor in numbers
            else inf
        )
        found.append((mind.time, speed if isfinite(speed) else None))
    return found


def _rest_duration_s(speeds: Sequence[tuple[float, float | None]], allowed: float) -> float:
    """How long a speed was below a limit until the end, seconds."""
    fast = (t for t, v in reversed(speeds) if v is None or v >= allowed)
    return speeds[-1][0] - next(fast, speeds[0][0])
