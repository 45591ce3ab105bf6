"""Fifteen example queries."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ExampleQuestion:
    """An example query.

    Attributes:
        words: The question in English.
        sql: The query for `visup query`.
    """

    words: str
    sql: str


EXAMPLES = (
    ExampleQuestion(
        "How did the runs end?",
        "SELECT verdict, count(*) AS runs, sum(seconds) AS seconds FROM runs GROUP BY ALL ORDER BY runs DESC",
    ),
    ExampleQuestion(
        "How many runs and hours are there of each week?",
        "SELECT week, count(*) AS runs, sum(seconds) / 3600 AS hours FROM runs GROUP BY week ORDER BY week",
    ),
    ExampleQuestion(
        "Which runs failed, and why?",
        "SELECT clip, cause, opened FROM alerts JOIN runs USING (run, clip)"
        " WHERE runs.verdict = 'failed' ORDER BY clip, opened",
    ),
    ExampleQuestion(
        "Which alerts are raised most often, and for how long?",
        "SELECT kind, severity, count(*) AS alerts, count(DISTINCT run) AS runs,"
        " median(seconds) AS median_s FROM alerts GROUP BY ALL ORDER BY alerts DESC, kind",
    ),
    ExampleQuestion(
        "How long does each stage take (median, and the slowest tenth)?",
        "SELECT task, stage, count(*) AS runs, median(took) AS median_s, quantile_cont(took, 0.9) AS p90_s"
        " FROM (SELECT run, task, stage, sum(seconds) AS took FROM stages"
        " WHERE status IN ('active', 'progressing', 'paused', 'stalled') GROUP BY ALL)"
        " GROUP BY ALL ORDER BY task, stage",
    ),
    ExampleQuestion(
        "In which runs does a stage stall for more than 10 seconds?",
        'SELECT clip, task, stage, "begin", seconds FROM stages'
        " WHERE status = 'stalled' AND seconds > 10 ORDER BY seconds DESC",
    ),
    ExampleQuestion(
        "At which stage do runs fail?",
        "SELECT task, stage, count(DISTINCT run) AS runs FROM stages"
        " WHERE status IN ('failing', 'failed') GROUP BY ALL ORDER BY runs DESC, task, stage",
    ),
    ExampleQuestion(
        "Who touched whom, when and for how long?",
        'SELECT clip, first, second, "begin", seconds, confidence FROM touching ORDER BY clip, "begin"',
    ),
    ExampleQuestion(
        "In which runs did two things touch and move apart within five seconds of parting?",
        'SELECT DISTINCT t.clip, t.first, t.second, t."end" AS parted FROM touching t'
        " JOIN diverging d ON d.run = t.run AND d.a = t.a AND d.b = t.b"
        ' AND d."end" >= t."begin" AND d."begin" <= t."end" + 5 ORDER BY clip, parted',
    ),
    ExampleQuestion(
        "How close did each pair come, where the distance was known?",
        "SELECT clip, first, second, min(least) AS gap_px FROM distance GROUP BY ALL ORDER BY gap_px, clip",
    ),
    ExampleQuestion(
        "How much of the time was it unknown whether two things touch?",
        "SELECT clip, sum(seconds) FILTER (truth = 'unknown') AS unknown_s,"
        " sum(seconds) FILTER (truth = 'true') AS touching_s FROM relations"
        " WHERE relation = 'touching' GROUP BY clip ORDER BY unknown_s DESC NULLS LAST, clip",
    ),
    ExampleQuestion(
        "What was seen, how often, and for how long on average?",
        "SELECT name, count(*) AS objects, avg(seconds) AS mean_s FROM objects WHERE confirmed"
        " GROUP BY name ORDER BY objects DESC, name",
    ),
    ExampleQuestion(
        "Whom did visup take for something else at some time?",
        "SELECT clip, object, name, names FROM objects WHERE confirmed AND len(names) > 1"
        " ORDER BY clip, object",
    ),
    ExampleQuestion(
        "In which runs could the image not be trusted, and for how long?",
        "SELECT clip, state, sum(seconds) AS seconds FROM health WHERE about = 'image' AND state <> 'ok'"
        " GROUP BY ALL ORDER BY seconds DESC, clip",
    ),
    ExampleQuestion(
        "Which runs came to nothing because nobody was recognised?",
        "SELECT clip, seconds FROM runs WHERE len(tasks) > 0 AND run NOT IN"
        " (SELECT run FROM objects WHERE len(actors) > 0) ORDER BY clip",
    ),
)
