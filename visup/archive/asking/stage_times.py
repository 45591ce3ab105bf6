"""The times in which a stage had one status: from the stretches of several probabilities, joined."""

from __future__ import annotations

CLIP = "regexp_replace(rtrim(r.source, '/\\'), '.*[/\\\\]', '') AS clip"
"""The name of the clip, of a row `r` of `runs`."""


def stage_times(runs: str, stages: str) -> str:
    """The SELECT that joins the stretches of stages.

    Args:
        runs: What gives rows of the table `runs`.
        stages: What gives rows of the table `stages`.
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
