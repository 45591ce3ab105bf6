"""Stage coverage of a task by runs, analogous to test coverage."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from visup.agent import Status
from visup.tasks.analysis.judging import JudgedRun
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.structure import stage_names


@dataclass(frozen=True, slots=True)
class StageCoverage:
    """How often a stage was executed.

    Attributes:
        stage: Its name.
        runs: Number of runs.
        statuses: Number of runs by final status.
        begun: Number of runs in which it began.
    """

    stage: str
    runs: int
    statuses: Mapping[Status, int]
    begun: int

    @property
    def covered(self) -> bool:
        """Whether some run completed it."""
        return self.statuses.get(Status.DONE, 0) > 0

    @property
    def failed(self) -> int:
        """Number of runs in which it failed."""
        return self.statuses.get(Status.FAILED, 0) + self.statuses.get(Status.FAILING, 0)

    def __str__(self) -> str:
        if not self.begun:
            return f"<{self.stage}>: never begun"
        clauses = [f"done in {self.statuses.get(Status.DONE, 0)} of {self.runs}"]
        clauses += [f"failed in {self.failed}"] if self.failed else []
        clauses += [] if self.failed else ["never failed"]
        return f"<{self.stage}>: {', '.join(clauses)}"


def coverage_of(task: Task, runs: Sequence[JudgedRun]) -> list[StageCoverage]:
    """The coverage of each stage of a task.

    Args:
        task: The task.
        runs: Its judged runs.
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
    """The share of stages that some run completed, 0 to 1."""
    return sum(s.covered for s in stages) / len(stages) if stages else 1.0
