"""The tables of a lake as people ask for them: with the clip's name, the objects' names and durations.

The tables as they stand in the files are in the schema `lake` (`lake.stages`, ...); these views are what a
plain name means. Only rows of committed runs are in either.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from visup.archive.schema import TABLES
from visup.rules.predicates.snapshot import RELATION_NAMES

_CLIP = "regexp_replace(rtrim(r.source, '/\\'), '.*[/\\\\]', '') AS clip"
_STRETCH = 't."begin", t."end", t."end" - t."begin" AS seconds, t.open'
_WHO = "list_transform(t.objects, lambda i: coalesce(n.names[i], 'object ' || i)) AS who"
_NAMES = (
    " LEFT JOIN (SELECT run, map(list(object), list(name)) AS names FROM lake.objects GROUP BY run) n"
    " USING (run)"
)

VIEWS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "runs": (
            "a run, with `clip` (the file's name) and `week` (the Monday of the week in which it was taken)",
            f"SELECT r.run, {_CLIP}, date_trunc('week', r.taken)::DATE AS week, r.* EXCLUDE (run)"
            " FROM lake.runs r",
        ),
        "objects": (
            "the life of an object, with `seconds` from first to last seen",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run), t.last_seen - t.first_seen AS seconds"
            " FROM lake.objects t JOIN lake.runs r USING (run)",
        ),
        "events": (
            "something that happened, with `who`: the names of the objects",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run), " + _WHO + ""
            " FROM lake.events t JOIN lake.runs r USING (run)" + _NAMES,
        ),
        "alerts": (
            "an alert, with `who`, and `seconds` that it was open",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run), " + _WHO + ","
            " coalesce(t.closed, r.seconds) - t.opened AS seconds"
            " FROM lake.alerts t JOIN lake.runs r USING (run)" + _NAMES,
        ),
        "tasks": (
            "a stretch in which a task stood as it did",
            f"SELECT t.run, {_CLIP}, t.task, t.verdict, t.stage, t.confidence, t.success, {_STRETCH}"
            " FROM lake.tasks t JOIN lake.runs r USING (run)",
        ),
        "stages": (
            "a time in which a stage had one status: stretches of several probabilities are joined, and"
            " `confidence` is their mean over time",
            f"""
            SELECT s.run, {_CLIP}, s.task, s.stage, s.status,
                   min(s."begin") AS "begin", max(s."end") AS "end",
                   max(s."end") - min(s."begin") AS seconds, bool_or(s.open) AS open,
                   coalesce(sum(s.confidence * s.steps) / sum(s.steps), 0) AS confidence
            FROM (
                SELECT *, sum(turned) OVER (PARTITION BY run, task, stage ORDER BY "begin") AS part
                FROM (
                    SELECT *, (status IS DISTINCT FROM lag(status) OVER (
                        PARTITION BY run, task, stage ORDER BY "begin"))::INT AS turned
                    FROM lake.stages
                )
            ) s JOIN lake.runs r USING (run)
            GROUP BY s.run, r.source, s.task, s.stage, s.status, s.part
            """,
        ),
        "relations": (
            "a time in which a relation held (`truth` true) or was unknown, with the names `first` and"
            " `second`",
            f"SELECT t.run, {_CLIP}, t.relation, t.a, t.b, x.name AS first, y.name AS second, t.truth,"
            f" {_STRETCH}, t.confidence, t.least, t.most"
            " FROM lake.relations t JOIN lake.runs r USING (run)"
            " LEFT JOIN lake.objects x ON x.run = t.run AND x.object = t.a"
            " LEFT JOIN lake.objects y ON y.run = t.run AND y.object = t.b",
        ),
        "percepts": (
            "what a behaviour gave of one kind in ten seconds",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run) FROM lake.percepts t JOIN lake.runs r USING (run)",
        ),
        "health": (
            "a time in which the image, or what is perceived, was in a state",
            f"SELECT t.run, {_CLIP}, t.about, t.state, {_STRETCH}"
            " FROM lake.health t JOIN lake.runs r USING (run)",
        ),
    }
)
"""Name -> what a row is, and its SELECT."""

RELATIONS = tuple(sorted({*RELATION_NAMES, "distance"} - {*VIEWS}))
"""Each relation is a view of its own: the times in which it held."""


def definitions(tables: Path) -> Iterator[str]:
    """The statements that make all views.

    Args:
        tables: Folder of the tables of a lake.
    """
    yield "CREATE SCHEMA lake"
    for name in TABLES:
        rows = f"SELECT * FROM read_parquet({quoted(pattern(tables / name))})"
        committed = "" if name == "runs" else " t SEMI JOIN lake.runs USING (run)"
        yield f"CREATE VIEW lake.{name} AS SELECT * FROM ({rows}){committed}"
    for name, (_, select) in VIEWS.items():
        yield f"CREATE VIEW main.{name} AS {select}"
    for name in RELATIONS:
        yield (
            f"CREATE VIEW main.{name} AS SELECT * EXCLUDE (relation, truth) FROM main.relations"
            f" WHERE relation = '{name}' AND truth = 'true'"
        )


def quoted(text: str) -> str:
    """A text as SQL writes it."""
    return "'" + text.replace("'", "''") + "'"


def pattern(folder: Path) -> str:
    """All Parquet files below a folder, whatever it is called."""
    return f"{escaped(folder.absolute())}/**/*.parquet"


def escaped(path: Path) -> str:
    """A path as it stands in a pattern."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in str(path))
