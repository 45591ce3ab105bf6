"""Questions in SQL: the answers are those of the tables, and a question can do nothing but read them."""

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
    place = tmp_path_factory.mktemp("it's [one] *")
    made = Lake.create(place / "lake")
    plan = make_plan(made, clips(place / "clips", "1", "190", "240", "2"), DOCK)
    fill(made, plan, Pool(), lambda outcome: None, scripted)
    (lost,) = (f for f in made.files("runs") if f.stem == plan.jobs[3].run)
    lost.unlink()
    return made


@pytest.fixture(scope="module")
def database(lake: Lake) -> Iterator[LakeDatabase]:
    with open_database(lake) as found:
        yield found


def ask(database: LakeDatabase, sql: str) -> list[dict[str, Any]]:
    return answer_rows(database.ask(sql))


def test_only_committed_runs_are_there(lake: Lake, database: LakeDatabase) -> None:
    assert len(lake.files("events")) == 1 + 4
    for view in (*VIEWS, "touching", *(f"lake.{name}" for name in VIEWS)):
        found = {row["run"] for row in ask(database, f"SELECT run FROM {view}")}
        assert found <= set(lake.runs()), view
    assert {r["run"] for r in ask(database, "SELECT run FROM events")} == set(lake.runs())


def test_stored_tables_are_what_is_in_the_files(lake: Lake, database: LakeDatabase) -> None:
    for name in VIEWS:
        stored = [json.dumps(r, default=str, sort_keys=True) for r in lake.rows(name)]
        asked = database.ask(f"SELECT * FROM lake.{name}").to_pylist()
        assert sorted(json.dumps(r, default=str, sort_keys=True) for r in asked) == sorted(stored)


def test_stages_are_joined_and_nothing_is_lost(database: LakeDatabase) -> None:
    stored = ask(
        database,
        'SELECT run, stage, sum("end" - "begin") AS s FROM lake.stages GROUP BY ALL ORDER BY ALL',
    )
    joined = ask(
        database, "SELECT run, stage, sum(seconds) AS s FROM stages GROUP BY ALL ORDER BY ALL"
    )
    assert [(r["run"], r["stage"], pytest.approx(r["s"])) for r in stored] == [
        (r["run"], r["stage"], r["s"]) for r in joined
    ]
    rows = ask(database, 'SELECT * FROM stages ORDER BY run, task, stage, "begin"')
    assert len(rows) > 6
    for one, other in pairwise(rows):
        if (one["run"], one["stage"]) == (other["run"], other["stage"]):
            assert one["status"] != other["status"]
            assert one["end"] == other["begin"]


def test_each_relation_has_its_times(database: LakeDatabase) -> None:
    counted = {
        r["relation"]: r["n"]
        for r in ask(
            database,
            "SELECT relation, count(*) AS n FROM lake.relations WHERE truth = 'true' GROUP BY ALL",
        )
    }
    assert {"converging", "touching", "distance"} <= set(counted)
    for name in RELATIONS:
        (found,) = ask(database, f"SELECT count(*) AS n FROM {name}")
        assert found["n"] == counted.get(name, 0), name
    pairs = [set(r.values()) for r in ask(database, "SELECT first, second FROM converging")]
    assert {"arm", "spartan"} in pairs


def test_all_questions_have_answers(database: LakeDatabase) -> None:
    assert len(EXAMPLES) == len({q.sql for q in EXAMPLES}) == 15
    answered = [q.words for q in EXAMPLES if ask(database, q.sql)]
    assert len(answered) >= 7, answered


EVIL = (
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


@pytest.mark.parametrize("sql", EVIL)
def test_a_question_can_only_read_the_lake(lake: Lake, database: LakeDatabase, sql: str) -> None:
    place = lake.path.parent
    (place / "secret.txt").write_text("a,b\n1,2\n")
    (place / "secret.csv").write_text("a,b\n1,2\n")
    before = sorted(place.rglob("*"))
    words = {"tables": str(lake.path / "tables"), "place": str(place)}
    with pytest.raises(QueryError):
        database.ask(sql.format(**{k: v.replace("'", "''") for k, v in words.items()}))
    assert sorted(place.rglob("*")) == before


@pytest.mark.parametrize(
    ("sql", "said"),
    [
        ("", "the query is empty"),
        ("SELECT 1; SELECT 2", "these are 2 statements"),
        ("SELECT * FROM stage", "visup query LAKE --tables"),
        ("SELECT nothing FROM runs", "visup query LAKE --tables"),
        ("SELEC 1", "syntax error"),
        ("DELETE FROM lake.runs", "a lake is only read, and this is DELETE"),
    ],
)
def test_what_cannot_be_answered_says_why(database: LakeDatabase, sql: str, said: str) -> None:
    with pytest.raises(QueryError) as told:
        database.ask(sql)
    assert said in str(told.value)


def test_the_command_gives_the_same_answer_in_each_form(
    lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    sql = "SELECT clip, seconds, labels, taken FROM runs ORDER BY run"
    told = json.loads(visup("query", lake.path, sql, "--format", "json").out)
    assert [r["seconds"] for r in told] == [1.1, 1.1, 1.1]
    rows = list(csv.DictReader(visup("query", lake.path, sql, "--format", "csv").out.splitlines()))
    assert [float(r["seconds"]) for r in rows] == [1.1, 1.1, 1.1]
    assert [r["clip"] for r in rows] == [r["clip"] for r in told]
    visup("query", lake.path, sql, "--out", tmp_path / "a.parquet")
    assert answer_rows(parquet.read_table(tmp_path / "a.parquet")) == told
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


def test_the_page_says_what_can_be_asked() -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    assert [n for n, (meaning, _) in VIEWS.items() if f"| `{n}` | {meaning} |\n" not in page] == []
