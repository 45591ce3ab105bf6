"""Which parts of a task runs have exercised, as one asks it of tests."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from visup.agent import Status
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import stage_names
from visup.tasks.learning.judging import JudgedRun


@dataclass(frozen=True, slots=True)
class StageCoverage:
    """How often a stage was gone through.

    Attributes:
        stage: Its name.
        runs: How many runs there are.
        statuses: In how many runs it ended so.
        begun: In how many runs it was begun.
    """

    stage: str
    runs: int
    statuses: Mapping[Status, int]
    begun: int

    @property
    def covered(self) -> bool:
        """Whether some run saw it through."""
        return self.statuses.get(Status.DONE, 0) > 0

    @property
    def failed(self) -> int:
        """In how many runs it failed."""
        return self.statuses.get(Status.FAILED, 0) + self.statuses.get(Status.FAILING, 0)

    def __str__(self) -> str:
        if not self.begun:
            return f"<{self.stage}>: never begun"
        said = [f"done in {self.statuses.get(Status.DONE, 0)} of {self.runs}"]
        said += [f"failed in {self.failed}"] if self.failed else []
        said += [] if self.failed else ["never failed"]
        return f"<{self.stage}>: {', '.join(said)}"


def coverage_of(task: Task, runs: Sequence[JudgedRun]) -> list[StageCoverage]:
    """How often each stage of a task was gone through.

    Args:
        task: The task.
        runs: How it went in each.
    """
    found = []
    for stage in stage_names(task):
        statuses = Counter(r.statuses[stage] for r in runs if stage in r.statuses)
        begun = sum(
            any(e.data.get("stage") == stage and e.kind == "stage_started" for e in r.events)
            for r in runs
        )
        found.append(StageCoverage(stage, len(runs), statuses, begun))
    return found


def share_covered(stages: Sequence[StageCoverage]) -> float:
    """The share of stages that some run saw through, 0 to 1."""
    return sum(s.covered for s in stages) / len(stages) if stages else 1.0
