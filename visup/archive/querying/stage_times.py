"""The intervals in which a stage had one status, merged from the intervals of its probabilities."""

from __future__ import annotations

CLIP = "regexp_replace(rtrim(r.source, '/\\'), '.*[/\\\\]', '') AS clip"
"""The file name of the clip of a row `r` of `runs`."""


def stage_times(runs: str, stages: str) -> str:
    """The SELECT that merges the intervals of stages.

    Args:
        runs: Table expression with rows of `runs`.
        stages: Table expression with rows of `stages`.
    """
    return f"""
        SELECT s.run, {CLIP}, s.task, s.stage, s.status,
               min(s."begin") AS "begin", max(s."end") AS "end",
               max(s."end") - min(s."begin") AS seconds, bool_or(s.open) AS open,
               coalesce(sum(s.confidence * s.steps) / sum(s.steps), 0) AS confidence
        FROM (
            SELECT *, sum(turned) OVER (PARTITION BY run, task, stage ORDER BY "begin") AS part
            FROM (
                SELECT *, (status IS DISTINCT FROM lag(status) OVER (
                    PARTITION BY run, task, stage ORDER BY "begin"))::INT AS turned
                FROM {stages}
            )
        ) s JOIN {runs} r USING (run)
        GROUP BY s.run, r.source, s.task, s.stage, s.status, s.part
        ORDER BY s.run, s.task, s.stage, "begin"
    """
