"""The views of a lake for queries: its tables with clip names, object names and durations.

The tables of the files are in the schema `lake` (`lake.stages`, ...); unqualified names mean these views.
Both have rows of committed runs only. The schema `lake_index` is internal: the indexes of the partitions, and
the same for runs that are not in a partition yet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from visup.archive.querying.stage_times import CLIP as _CLIP
from visup.archive.querying.stage_times import stage_times
from visup.archive.schema import TABLES
from visup.rules.predicates.snapshot import RELATION_NAMES

if TYPE_CHECKING:
    from visup.archive.lake import LakeSnapshot

_INTERVAL = 't."begin", t."end", t."end" - t."begin" AS seconds, t.open'
_OBJECT_NAMES = "list_transform(t.objects, lambda i: coalesce(n.names[i], 'object ' || i)) AS who"
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
            "the lifetime of an object, with `seconds` from first to last seen",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run), t.last_seen - t.first_seen AS seconds"
            " FROM lake.objects t JOIN lake.runs r USING (run)",
        ),
        "events": (
            "an event, with `who`: the names of the objects",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run), " + _OBJECT_NAMES + ""
            " FROM lake.events t JOIN lake.runs r USING (run)" + _NAMES,
        ),
        "alerts": (
            "an alert, with `who`, and `seconds` that it was open",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run), " + _OBJECT_NAMES + ","
            " coalesce(t.closed, r.seconds) - t.opened AS seconds"
            " FROM lake.alerts t JOIN lake.runs r USING (run)" + _NAMES,
        ),
        "tasks": (
            "an interval in which the state of a task did not change",
            f"SELECT t.run, {_CLIP}, t.task, t.verdict, t.stage, t.confidence, t.success, {_INTERVAL}"
            " FROM lake.tasks t JOIN lake.runs r USING (run)",
        ),
        "stages": (
            "a time in which a stage had one status: stretches of several probabilities are joined, and"
            " `confidence` is their mean over time",
            "SELECT * FROM lake_index.stage_times",
        ),
        "relations": (
            "a time in which a relation held (`truth` true) or was unknown, with the names `first` and"
            " `second`",
            f"SELECT t.run, {_CLIP}, t.relation, t.a, t.b, x.name AS first, y.name AS second, t.truth,"
            f" {_INTERVAL}, t.confidence, t.least, t.most"
            " FROM lake.relations t JOIN lake.runs r USING (run)"
            " LEFT JOIN lake.objects x ON x.run = t.run AND x.object = t.a"
            " LEFT JOIN lake.objects y ON y.run = t.run AND y.object = t.b",
        ),
        "percepts": (
            "percepts of one kind from one behaviour in ten seconds",
            f"SELECT t.run, {_CLIP}, t.* EXCLUDE (run) FROM lake.percepts t JOIN lake.runs r USING (run)",
        ),
        "health": (
            "an interval in which the image, or a kind of percept, was in a state",
            f"SELECT t.run, {_CLIP}, t.about, t.state, {_INTERVAL}"
            " FROM lake.health t JOIN lake.runs r USING (run)",
        ),
    }
)
"""Name -> meaning of a row, and the SELECT."""

RELATIONS = tuple(sorted({*RELATION_NAMES, "distance"} - {*VIEWS}))
"""Each relation is a view of its own: the intervals in which it held."""


_UNJOINED_ROWS = "SELECT * FROM read_parquet({files}) SEMI JOIN lake_index.own USING (run)"
"""The rows of runs that are not in a partition."""
_UNJOINED_HELD = (
    'SELECT o.number, t.relation, t.a, t.b, t."begin", t."end" FROM lake_index.own_relations t'
    " JOIN lake_index.own o USING (run) WHERE t.truth = 'true'"
)
_UNJOINED_MEANT = """
    SELECT unnest(list_distinct(t.names || t.actors ||
               list_filter(map_keys(r.cast_of), lambda k: list_has_any(t.names, r.cast_of[k])))) AS name,
           o.number, t.object
    FROM lake_index.own_objects t JOIN lake_index.own o USING (run)
    JOIN (SELECT run, from_json(coalesce(actors, '{}'), '"MAP(VARCHAR, VARCHAR[])"') AS cast_of
          FROM lake_index.own_runs) r USING (run)
"""


def definitions(found: LakeSnapshot) -> Iterator[str]:
    """The statements that create all views; the table `lake_index.runs` (run, number, own) must exist.

    Args:
        found: Snapshot of the lake.
    """
    yield "CREATE SCHEMA lake"
    yield "CREATE VIEW lake_index.own AS SELECT run, number FROM lake_index.runs WHERE own"
    for name in TABLES:
        yield f"CREATE VIEW lake.{name} AS SELECT * FROM read_parquet({_files(found.files[name])})"
        unjoined_files = [f for f in found.files[name] if f.parent.parent.name == name]
        rows = _UNJOINED_ROWS.format(files=_files([*unjoined_files, found.files[name][0]]))
        yield f"CREATE VIEW lake_index.own_{name} AS {rows}"
    unjoined_stages = f"({stage_times('lake_index.own_runs', 'lake_index.own_stages')})"
    for name, rows in (
        ("held", _UNJOINED_HELD),
        ("meant", _UNJOINED_MEANT),
        ("stage_times", unjoined_stages),
    ):
        joined = found.index_files(name)
        both = f"SELECT * FROM read_parquet({_files(joined)}) UNION ALL ({rows})"
        yield f"CREATE VIEW lake_index.{name} AS {both if joined else rows}"
    for name, (_, select) in VIEWS.items():
        yield f"CREATE VIEW main.{name} AS {select}"
    for name in RELATIONS:
        yield (
            f"CREATE VIEW main.{name} AS SELECT * EXCLUDE (relation, truth) FROM main.relations"
            f" WHERE relation = '{name}' AND truth = 'true'"
        )


def quoted(text: str) -> str:
    """A text as an SQL literal."""
    return "'" + text.replace("'", "''") + "'"


def _files(paths: Sequence[Path]) -> str:
    """A list of files for DuckDB, with special characters escaped."""
    return f"[{', '.join(quoted(escaped(path.absolute())) for path in paths)}]"


def escaped(path: Path) -> str:
    """A path with glob characters escaped."""
    return "".join(f"[{c}]" if c in "*?[" else c for c in str(path))
