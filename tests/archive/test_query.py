"""Queries in SQL: answers agree with the tables, and a query can do nothing but read them."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.archive.watches import clips, scripted
from tests.cli import Call, caller
from tests.paths import ROOT
from visup.archive.filling.filling import fill
from visup.archive.filling.plan import make_plan
from visup.archive.filling.pool import Pool
from visup.archive.lake import Lake
from visup.archive.querying.answers import answer_rows
from visup.archive.querying.database import LakeDatabase, QueryError, open_database
from visup.archive.querying.examples import EXAMPLES
from visup.archive.querying.views import RELATIONS, VIEWS
from visup.runs.settings import WatchSettings

pytest.importorskip("duckdb", reason="needs the extra `cluster`")
parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra `cluster`")

DOCK = WatchSettings("", tasks=("dock",), actors={"satellite": ("spartan",)})


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """A lake of three runs in a folder of an awkward name, and a run that was not committed."""
    folder = tmp_path_factory.mktemp("it's [one] *")
    lake = Lake.create(folder / "lake")
    plan = make_plan(lake, clips(folder / "clips", "1", "190", "240", "2"), DOCK)
    fill(lake, plan, Pool(), lambda outcome: None, scripted)
    (uncommitted,) = (f for f in lake.files("runs") if f.stem == plan.jobs[3].run)
    uncommitted.unlink()
    return lake


@pytest.fixture(scope="module")
def database(lake: Lake) -> Iterator[LakeDatabase]:
    with open_database(lake) as opened:
        yield opened


def rows_of(database: LakeDatabase, sql: str) -> list[dict[str, Any]]:
    return answer_rows(database.ask(sql))


def test_only_committed_runs_are_in_the_views(lake: Lake, database: LakeDatabase) -> None:
    assert len(lake.files("events")) == 1 + 4
    for view in (*VIEWS, "touching", *(f"lake.{name}" for name in VIEWS)):
        runs = {row["run"] for row in rows_of(database, f"SELECT run FROM {view}")}
        assert runs <= set(lake.runs()), view
    assert {r["run"] for r in rows_of(database, "SELECT run FROM events")} == set(lake.runs())


def test_stored_tables_equal_the_files(lake: Lake, database: LakeDatabase) -> None:
    for name in VIEWS:
        stored = [json.dumps(r, default=str, sort_keys=True) for r in lake.rows(name)]
        asked = database.ask(f"SELECT * FROM lake.{name}").to_pylist()
        assert sorted(json.dumps(r, default=str, sort_keys=True) for r in asked) == sorted(stored)


def test_adjacent_stages_are_merged_without_loss(database: LakeDatabase) -> None:
    stored = rows_of(
        database,
        'SELECT run, stage, sum("end" - "begin") AS s FROM lake.stages GROUP BY ALL ORDER BY ALL',
    )
    joined = rows_of(
        database, "SELECT run, stage, sum(seconds) AS s FROM stages GROUP BY ALL ORDER BY ALL"
    )
    assert [(r["run"], r["stage"], pytest.approx(r["s"])) for r in stored] == [
        (r["run"], r["stage"], r["s"]) for r in joined
    ]
    rows = rows_of(database, 'SELECT * FROM stages ORDER BY run, task, stage, "begin"')
    assert len(rows) > 6
    for row, next_row in pairwise(rows):
        if (row["run"], row["stage"]) == (next_row["run"], next_row["stage"]):
            assert row["status"] != next_row["status"]
            assert row["end"] == next_row["begin"]


def test_each_relation_has_a_view_of_its_intervals(database: LakeDatabase) -> None:
    counted = {
        r["relation"]: r["n"]
        for r in rows_of(
            database,
            "SELECT relation, count(*) AS n FROM lake.relations WHERE truth = 'true' GROUP BY ALL",
        )
    }
    assert {"converging", "touching", "distance"} <= set(counted)
    for name in RELATIONS:
        (row,) = rows_of(database, f"SELECT count(*) AS n FROM {name}")
        assert row["n"] == counted.get(name, 0), name
    pairs = [set(r.values()) for r in rows_of(database, "SELECT first, second FROM converging")]
    assert {"arm", "spartan"} in pairs


def test_the_example_queries_can_be_run(database: LakeDatabase) -> None:
    assert len(EXAMPLES) == len({q.sql for q in EXAMPLES}) == 15
    answered = [q.words for q in EXAMPLES if rows_of(database, q.sql)]
    assert len(answered) >= 7, answered


FORBIDDEN = (
    "COPY (SELECT 1) TO '{tables}/x.csv'",
    "COPY (SELECT 1) TO '{place}/x.csv'",
    "SELECT * FROM read_text('{place}/secret.txt')",
    "SELECT * FROM read_csv('{place}/secret.txt')",
    "SELECT * FROM '{place}/secret.csv'",
    "SELECT * FROM read_text('{tables}/../lake.json')",
    "SELECT * FROM glob('{place}/*')",
    "ATTACH '{place}/x.db'",
    "CREATE TABLE t AS SELECT 1",
    "DROP VIEW main.runs",
    "INSERT INTO lake.runs SELECT * FROM lake.runs",
    "SET enable_external_access = true",
    "SET VARIABLE x = 1",
    "RESET lock_configuration",
    "PRAGMA database_list",
    "INSTALL httpfs",
    "LOAD httpfs",
    "EXPORT DATABASE '{tables}/x'",
    "CALL pragma_version()",
    "SELECT * FROM read_parquet('http://127.0.0.1:1/x')",
    "SELECT * FROM query('COPY (SELECT 1) TO ''{tables}/x.csv''')",
    "SELECT 1; COPY (SELECT 1) TO '{tables}/x.csv'",
    "SELECT getenv('HOME')",
    "EXPLAIN ANALYZE COPY (SELECT 1) TO '{tables}/x.csv'",
)


@pytest.mark.parametrize("sql", FORBIDDEN)
def test_a_query_can_only_read_the_lake(lake: Lake, database: LakeDatabase, sql: str) -> None:
    folder = lake.path.parent
    (folder / "secret.txt").write_text("a,b\n1,2\n")
    (folder / "secret.csv").write_text("a,b\n1,2\n")
    before = sorted(folder.rglob("*"))
    paths = {"tables": str(lake.path / "tables"), "place": str(folder)}
    with pytest.raises(QueryError):
        database.ask(sql.format(**{k: v.replace("'", "''") for k, v in paths.items()}))
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("sql", "message"),
    [
        ("", "the query is empty"),
        ("SELECT 1; SELECT 2", "these are 2 statements"),
        ("SELECT * FROM stage", "visup query LAKE --tables"),
        ("SELECT nothing FROM runs", "visup query LAKE --tables"),
        ("SELEC 1", "syntax error"),
        ("DELETE FROM lake.runs", "a lake is only read, and this is DELETE"),
    ],
)
def test_invalid_queries_are_explained(database: LakeDatabase, sql: str, message: str) -> None:
    with pytest.raises(QueryError) as caught:
        database.ask(sql)
    assert message in str(caught.value)


def test_the_command_gives_the_same_answer_in_each_format(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    sql = "SELECT clip, seconds, labels, taken FROM runs ORDER BY run"
    answer = json.loads(visup("query", lake.path, sql, "--format", "json").out)
    assert [r["seconds"] for r in answer] == [1.1, 1.1, 1.1]
    rows = list(csv.DictReader(visup("query", lake.path, sql, "--format", "csv").out.splitlines()))
    assert [float(r["seconds"]) for r in rows] == [1.1, 1.1, 1.1]
    assert [r["clip"] for r in rows] == [r["clip"] for r in answer]
    visup("query", lake.path, sql, "--out", tmp_path / "a.parquet")
    assert answer_rows(parquet.read_table(tmp_path / "a.parquet")) == answer
    visup("query", lake.path, sql, "--out", tmp_path / "a.csv")
    assert list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines())) == rows
    many = visup("query", lake.path, "SELECT * FROM range(70)").out
    assert "and 20 more rows" in many
    shown = visup("query", lake.path, "SELECT '[red]x' AS \"[b]y\"").out
    assert "[red]x" in shown
    assert "[b]y" in shown
    assert "touching" in visup("query", lake.path, "--tables").out
    assert visup("query", lake.path, sql, "--format", "xml").code == 2
    assert visup("query", lake.path).code == 2


def test_the_documentation_lists_all_views() -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    assert [n for n, (meaning, _) in VIEWS.items() if f"| `{n}` | {meaning} |\n" not in page] == []
