"""What a lake tells as a whole: how long stages take, what drifts, how runs fail."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from visup.archive.asking.database import LakeDatabase

TOOK = (
    "(SELECT run, task, stage, sum(seconds) AS took FROM stages"
    " WHERE status IN ('active', 'progressing', 'paused', 'stalled') GROUP BY ALL)"
)
"""How long each run was at each stage."""
QUANTILES = (
    "count(*) AS runs, quantile_cont(took, 0.1) AS low, median(took) AS mid,"
    " quantile_cont(took, 0.9) AS high, max(took) AS longest"
)
BY = """
    SELECT run, e.key || ' = ' || e.value AS who FROM (
        SELECT run, unnest(map_entries(labels)) AS e FROM lake.runs)
    UNION ALL
    SELECT run, e.key || ' = ' || array_to_string(e.value, ', ') FROM (
        SELECT run, unnest(map_entries(from_json(coalesce(actors, '{}'),
               '"MAP(VARCHAR, VARCHAR[])"'))) AS e FROM lake.runs)
"""
"""Who played in a run, and what its manifest says of it."""
LEAST_CHANGE = 0.05
CHANCE = 0.01
"""A drift is told when chance alone gives one as strong in one lake of a hundred, whatever the stages."""
LEAST_RUNS = 10
MOST_MODES = 20


@dataclass(frozen=True, slots=True)
class StageDuration:
    """How long a stage takes.

    Attributes:
        task: Its task.
        stage: Its name.
        group: The week, or who played; '' for all runs.
        runs: How many came to it.
        low: A tenth of them took less, s.
        mid: Median, s.
        high: A tenth of them took more, s.
        longest: s.
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
    """A stage that has become slower or faster over the months.

    Attributes:
        task: Its task.
        stage: Its name.
        runs: How many came to it.
        before: Median of the first quarter of them, s.
        after: Median of the last quarter, s.
        chance: How likely the order of durations would be as far from any, were there no drift.
    """

    task: str
    stage: str
    runs: int
    before: float
    after: float
    chance: float

    @property
    def change(self) -> float:
        """By which share it takes longer now."""
        return self.after / self.before - 1.0 if self.before > 0 else 0.0


@dataclass(frozen=True, slots=True)
class FailureMode:
    """A way in which runs fail.

    Attributes:
        stage: 'task: stage' that was failing, or '' where no stage was.
        alert: The gravest kind of alert meanwhile, or ''.
        runs: How many failed so.
        share: Of all runs that failed.
        clip: One of them.
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
    """All of it.

    Attributes:
        runs: How many runs there are.
        hours: Of video.
        verdicts: (week, verdict, how many), by week.
        durations: Of stages in all runs.
        by_week: Of stages, by the week in which runs were taken.
        by_actor: Of stages, by who played, and by the labels of the manifest.
        drifts: The strongest first.
        failures: The most frequent first.
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
    """What a lake tells as a whole."""
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
        _durations(database, "who", f"JOIN ({BY}) USING (run)"),
        drifts(database),
        failure_modes(database),
    )


def drifts(database: LakeDatabase) -> tuple[Drift, ...]:
    """Stages whose durations go up or down with time, more than chance would have it."""
    taken: dict[tuple[str, str], list[tuple[float, float]]] = {}
    for task, stage, at, took in _rows(
        database,
        f"SELECT task, stage, epoch(taken), took FROM {TOOK} JOIN lake.runs USING (run)"
        " WHERE taken IS NOT NULL ORDER BY taken, run",
    ):
        taken.setdefault((task, stage), []).append((at, took))
    tried = [_drift(*key, np.array(of)) for key, of in taken.items() if len(of) >= LEAST_RUNS]
    found = [d for d in tried if d.chance < CHANCE / len(tried) and abs(d.change) >= LEAST_CHANGE]
    return tuple(sorted(found, key=lambda d: (-abs(d.change), d.task, d.stage)))


def _drift(task: str, stage: str, of: NDArray[np.float64]) -> Drift:
    """What becomes of a stage with time: (N, 2) times and durations, by time."""
    quarter = max(1, len(of) // 4)
    if np.ptp(of[:, 0]) == 0 or np.ptp(of[:, 1]) == 0:
        chance = 1.0  # nothing to be ordered by
    else:
        chance = float(stats.kendalltau(of[:, 0], of[:, 1]).pvalue)
    before, after = (float(np.median(of[s, 1])) for s in (slice(quarter), slice(-quarter, None)))
    return Drift(task, stage, len(of), before, after, chance)


def failure_modes(database: LakeDatabase) -> tuple[FailureMode, ...]:
    """How runs fail, the most frequent first: by the stage that failed and the gravest alert."""
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
    return tuple(FailureMode(*row) for row in found[:MOST_MODES])


def _durations(database: LakeDatabase, group: str, more: str) -> tuple[StageDuration, ...]:
    sql = f"SELECT task, stage, {group} AS part, {QUANTILES} FROM {TOOK} {more}"
    return tuple(
        StageDuration(*row) for row in _rows(database, f"{sql} GROUP BY ALL ORDER BY 1, 2, 3")
    )


def _rows(database: LakeDatabase, sql: str) -> list[tuple[Any, ...]]:
    table = database.ask(sql)
    return list(zip(*(column.to_pylist() for column in table.columns), strict=True))
