"""Statistics of a lake: durations of stages, drifts, and failure modes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from visup.archive.querying.database import LakeDatabase

DURATIONS_SQL = (
    "(SELECT run, task, stage, sum(seconds) AS took FROM stages"
    " WHERE status IN ('active', 'progressing', 'paused', 'stalled') GROUP BY ALL)"
)
"""Seconds of each run in each stage."""
QUANTILES = (
    "count(*) AS runs, quantile_cont(took, 0.1) AS low, median(took) AS mid,"
    " quantile_cont(took, 0.9) AS high, max(took) AS longest"
)
GROUPED_SQL = """
    SELECT run, e.key || ' = ' || e.value AS who FROM (
        SELECT run, unnest(map_entries(labels)) AS e FROM lake.runs)
    UNION ALL
    SELECT run, e.key || ' = ' || array_to_string(e.value, ', ') FROM (
        SELECT run, unnest(map_entries(from_json(coalesce(actors, '{}'),
               '"MAP(VARCHAR, VARCHAR[])"'))) AS e FROM lake.runs)
"""
"""The cast and the manifest labels of a run."""
MIN_CHANGE = 0.05
SIGNIFICANCE = 0.01
"""Significance level of a drift, corrected for the number of stages."""
MIN_RUNS = 10
MAX_MODES = 20


@dataclass(frozen=True, slots=True)
class StageDuration:
    """The durations of a stage.

    Attributes:
        task: Its task.
        stage: Its name.
        group: The week, or the cast; '' for all runs.
        runs: Number of runs that reached it.
        low: 10th percentile, s.
        mid: Median, s.
        high: 90th percentile, s.
        longest: Maximum, s.
    """

    task: str
    stage: str
    group: str
    runs: int
    low: float
    mid: float
    high: float
    longest: float


@dataclass(frozen=True, slots=True)
class Drift:
    """A stage whose duration changes over time.

    Attributes:
        task: Its task.
        stage: Its name.
        runs: Number of runs that reached it.
        before: Median of the first quarter of them, s.
        after: Median of the last quarter, s.
        chance: p-value of the order of durations without drift.
    """

    task: str
    stage: str
    runs: int
    before: float
    after: float
    chance: float

    @property
    def change(self) -> float:
        """Relative change of the duration."""
        return self.after / self.before - 1.0 if self.before > 0 else 0.0


@dataclass(frozen=True, slots=True)
class FailureMode:
    """A failure mode of runs.

    Attributes:
        stage: 'task: stage' that was failing, or ''.
        alert: Kind of the most severe alert meanwhile, or ''.
        runs: Number of runs.
        share: Share of all failed runs.
        clip: An example.
        run: Its key.
    """

    stage: str
    alert: str
    runs: int
    share: float
    clip: str
    run: str


@dataclass(frozen=True, slots=True)
class LakeStatistics:
    """All statistics of a lake.

    Attributes:
        runs: Number of runs.
        hours: Hours of video.
        verdicts: (week, verdict, count), by week.
        durations: Durations of stages over all runs.
        by_week: Durations by the week in which runs were recorded.
        by_actor: Durations by cast and by manifest labels.
        drifts: Drifts, strongest first.
        failures: Failure modes, most frequent first.
    """

    runs: int
    hours: float
    verdicts: tuple[tuple[str, str, int], ...]
    durations: tuple[StageDuration, ...]
    by_week: tuple[StageDuration, ...]
    by_actor: tuple[StageDuration, ...]
    drifts: tuple[Drift, ...]
    failures: tuple[FailureMode, ...]


def lake_statistics(database: LakeDatabase) -> LakeStatistics:
    """Compute all statistics of a lake."""
    ((runs, hours),) = _rows(
        database, "SELECT count(*), coalesce(sum(seconds), 0) / 3600 FROM lake.runs"
    )
    verdicts = _rows(
        database,
        "SELECT coalesce(week::VARCHAR, ''), coalesce(verdict, 'none'), count(*) FROM runs"
        " GROUP BY ALL ORDER BY ALL",
    )
    return LakeStatistics(
        runs,
        hours,
        tuple(verdicts),
        _durations(database, "''", ""),
        _durations(database, "week::VARCHAR", "JOIN runs USING (run) WHERE week IS NOT NULL"),
        _durations(database, "who", f"JOIN ({GROUPED_SQL}) USING (run)"),
        drifts(database),
        failure_modes(database),
    )


def drifts(database: LakeDatabase) -> tuple[Drift, ...]:
    """Stages whose durations rise or fall significantly over time."""
    taken: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for task, stage, at, duration in _rows(
        database,
        f"SELECT task, stage, epoch(taken), took FROM {DURATIONS_SQL} JOIN lake.runs USING (run)"
        " WHERE taken IS NOT NULL ORDER BY taken, run",
    ):
        taken.setdefault((task, stage), []).append((at, duration))
    tried = [_drift(*key, np.array(of)) for key, of in taken.items() if len(of) >= MIN_RUNS]
    found = [
        d for d in tried if d.chance < SIGNIFICANCE / len(tried) and abs(d.change) >= MIN_CHANGE
    ]
    return tuple(sorted(found, key=lambda d: (-abs(d.change), d.task, d.stage)))


def _drift(task: str, stage: str, of: NDArray[np.float64]) -> Drift:
    """The drift of a stage from (N, 2) times and durations, sorted by time."""
    quarter = max(1, len(of) // 4)
    if np.ptp(of[:, 0]) == 0 or np.ptp(of[:, 1]) == 0:
        chance = 1.0  # all times or durations are equal
    else:
        chance = float(stats.kendalltau(of[:, 0], of[:, 1]).pvalue)
    before, after = (float(np.median(of[s, 1])) for s in (slice(quarter), slice(-quarter, None)))
    return Drift(task, stage, len(of), before, after, chance)


def failure_modes(database: LakeDatabase) -> tuple[FailureMode, ...]:
    """Failure modes by failed stage and most severe alert, most frequent first."""
    found = _rows(
        database,
        """
        WITH failed AS (SELECT run, clip FROM runs WHERE verdict IN ('failed', 'interrupted')),
        last AS (SELECT run, arg_max(task || ': ' || stage, "begin") AS stage FROM stages
                 SEMI JOIN failed USING (run) WHERE status IN ('failing', 'failed') GROUP BY run),
        alert AS (SELECT run, arg_max(kind, (CASE severity WHEN 'critical' THEN 2
                  WHEN 'warning' THEN 1 ELSE 0 END, opened)) AS kind FROM lake.alerts
                  SEMI JOIN failed USING (run) GROUP BY run)
        SELECT coalesce(last.stage, ''), coalesce(alert.kind, ''), count(*) AS n,
               count(*) / sum(count(*)) OVER () AS share, min(clip), arg_min(run, clip)
        FROM failed LEFT JOIN last USING (run) LEFT JOIN alert USING (run)
        GROUP BY ALL ORDER BY n DESC, 1, 2
        """,
    )
    return tuple(FailureMode(*row) for row in found[:MAX_MODES])


def _durations(database: LakeDatabase, group: str, more: str) -> tuple[StageDuration, ...]:
    sql = f"SELECT task, stage, {group} AS part, {QUANTILES} FROM {DURATIONS_SQL} {more}"
    return tuple(
        StageDuration(*row) for row in _rows(database, f"{sql} GROUP BY ALL ORDER BY 1, 2, 3")
    )


def _rows(database: LakeDatabase, sql: str) -> list[tuple[Any, ...]]:
    table = database.ask(sql)
    return list(zip(*(column.to_pylist() for column in table.columns), strict=True))
