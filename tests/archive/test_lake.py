"""Lakes: the rows of a run are those of its journal, and a run is committed whole or not at all."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.archive.recordings import meeting, record, recorded
from tests.cli import Call, caller
from tests.paths import ROOT
from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import replacing
from visup.agent.storage.journal_reader import Recording
from visup.archive.adding import add_run
from visup.archive.identity import content_hash, settings_hash
from visup.archive.inputs import run_inputs
from visup.archive.lake import Lake
from visup.archive.run_tables import Provenance, RunTables, run_tables
from visup.archive.schema import TABLES, schema_text
from visup.runs.replay import replay
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings

arrow = pytest.importorskip("pyarrow", reason="needs the extra `cluster`")
parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra `cluster`")


@pytest.fixture
def visup(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(monkeypatch, capfd)


DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})
KEY = "ab" * 16


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return recorded(tmp_path_factory.mktemp("run"), DOCK)


def tables_of(recording: Recording) -> RunTables:
    settings = recorded_settings(recording.facts(), "")
    provenance = Provenance(KEY, "s", "t", 1e9, {"gripper": "new"})
    return run_tables(recording, settings, provenance)


@pytest.fixture(scope="module")
def tables(run: Recording) -> RunTables:
    return tables_of(run)


def as_records(tables: RunTables, name: str) -> list[dict[str, object]]:
    return [dict(zip(TABLES[name].names, row, strict=True)) for row in tables[name]]


def test_the_rows_of_a_run_are_deterministic(run: Recording, tables: RunTables) -> None:
    assert tables_of(run) == tables
    assert list(tables) == list(TABLES)
    assert all(len(row) == len(TABLES[name].columns) for name in TABLES for row in tables[name])
    assert {row[0] for rows in tables.values() for row in rows} == {KEY}


def test_rows_are_the_beliefs_of_each_step(tmp_path: Path) -> None:
    steps = record(tmp_path, meeting(), DOCK)
    tables = tables_of(Recording.open(tmp_path))
    stages, relations = as_records(tables, "stages"), as_records(tables, "relations")
    for number, step in enumerate(steps):

        def now(rows: list[dict[str, object]], frame: int = number) -> list[dict[str, object]]:
            return [r for r in rows if r["first_frame"] <= frame < r["first_frame"] + r["steps"]]  # type: ignore[operator]

        statuses = {(r["task"], r["stage"]): r["status"] for r in now(stages)}
        assert statuses == {(t.task, s.stage): s.status for t in step.mind.tasks for s in t.stages}
        converging = {
            (r["a"], r["b"])
            for r in now(relations)
            if r["relation"] == "converging" and r["truth"] == "true"
        }
        assert converging == {
            r.objects for r in step.mind.relations if r.name == "converging" and r.truth == "true"
        }
    assert {r["relation"] for r in relations} >= {"converging", "touching", "diverging"}
    ids = {i for s in steps for i in s.mind.objects}
    assert {r["object"] for r in as_records(tables, "objects")} == ids
    assert [e["text"] for e in as_records(tables, "events")] == [
        e.text for s in steps for e in s.events
    ]


def test_written_tables_are_read_back(run: Recording, tables: RunTables, tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    assert lake.commit(tables, run, run_inputs(DOCK))
    assert not lake.commit(tables, run, run_inputs(DOCK))
    for name in TABLES:
        read, expected = list(lake.rows(name)), as_records(tables, name)
        for row in read:
            if name == "runs":
                row["taken"] = row["taken"].timestamp()  # type: ignore[index]
        assert read == expected, name
    schemas = {name: {str(parquet.read_schema(f)) for f in lake.files(name)} for name in TABLES}
    assert {name for name, files in schemas.items() if len(files) != 1} == set()


def test_a_stored_run_can_be_replayed_without_its_files(tmp_path: Path) -> None:
    folder = tmp_path / "tasks"
    folder.mkdir()
    (folder / "part.task").write_text("zone bay is (0, 0) (9, 0) (9, 9)\n")
    (folder / "mine.task").write_text(
        'include "part.task"\n<mine> ::= converging(arm, satellite)\n'
    )
    (folder / "mine.rules").write_text('rule near(a, b): info when touching(a, b) say "Near."\n')
    settings = WatchSettings(
        "clip.mp4",
        tasks=(str(folder / "mine.task"),),
        rules=(folder / "mine.rules",),
        actors={"satellite": ("spartan",)},
    )
    record(tmp_path / "run", meeting(), settings)
    lake = Lake.create(tmp_path / "lake")
    key, added = add_run(lake, tmp_path / "run")
    assert added
    assert add_run(lake, tmp_path / "run") == (key, False)
    for file in folder.iterdir():
        file.unlink()
    recording, stored_settings = lake.recorded(key)
    assert list(replay(recording, stored_settings).events) == list(recording.events())


def files_in(lake: Lake) -> set[str]:
    return {str(p.relative_to(lake.path)) for p in lake.path.rglob("*") if p.is_file()}


def test_a_commit_may_fail_anywhere(
    run: Recording, tables: RunTables, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, lake = Lake.create(tmp_path / "whole"), Lake.create(tmp_path / "lake")
    before = files_in(whole)
    whole.commit(tables, run, run_inputs(DOCK))
    written = len(files_in(whole) - before)
    assert written > len(TABLES)
    allowed = 0

    @contextmanager
    def failing(path: Path) -> Iterator[Path]:
        nonlocal allowed
        allowed -= 1
        if allowed < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        with replacing(path) as draft:
            yield draft

    monkeypatch.setattr("visup.archive.lake.replacing", failing)
    monkeypatch.setattr("visup.agent.storage.atomic.replacing", failing)
    for stop in range(written):
        allowed = stop
        with pytest.raises(OutputError, match="No space left"):
            lake.commit(tables, run, run_inputs(DOCK))
        assert lake.runs() == []
        assert list(lake.rows("events")) == []
    allowed = written
    assert lake.commit(tables, run, run_inputs(DOCK))
    assert files_in(lake) == files_in(whole)
    for name in TABLES:
        assert list(lake.rows(name)) == list(whole.rows(name))


def test_hashes_depend_on_the_content_of_files(tmp_path: Path) -> None:
    first, second = tmp_path / "one", tmp_path / "two"
    for folder in (first, second):
        folder.mkdir()
        (folder / "a.task").write_text("<a> ::= converging(arm, satellite)\n")
        (folder / "db").write_bytes(b"models")

    def hashed(folder: Path, **more: object) -> str:
        task = str(folder / "a.task")
        return settings_hash(WatchSettings("x", tasks=(task,), models=folder / "db", **more))  # type: ignore[arg-type]

    assert hashed(first) == hashed(second) != hashed(first, every=2)
    (second / "a.task").write_text("<a> ::= diverging(arm, satellite)\n")
    assert hashed(first) != hashed(second)
    (second / "a.task").write_text("<a> ::= converging(arm, satellite)\n")
    (second / "db").write_bytes(b"others")
    assert hashed(first) != hashed(second)
    assert content_hash(first) != content_hash(second)
    (second / "db").write_bytes(b"models")
    assert content_hash(first) == content_hash(second)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "there is no lake here"),
        ("[]", "this is not a lake"),
        ('{"version": 99}', "this lake has version 99"),
        ("{", "this is not a lake"),
    ],
)
def test_a_folder_that_is_no_lake_is_refused(
    tmp_path: Path, text: str | None, message: str
) -> None:
    if text is not None:
        (tmp_path / "lake.json").write_text(text)
    with pytest.raises(OutputError, match=message):
        Lake.open(tmp_path)


def test_a_folder_with_other_files_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="no lake"):
        Lake.create(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


def test_the_command_adds_the_runs_it_can(visup: Call, tmp_path: Path) -> None:
    record(tmp_path / "good", meeting())
    record(tmp_path / "cut", meeting(5), ended=None)
    result = visup(
        "archive", "add", tmp_path / "cut", tmp_path / "good", "--into", tmp_path / "lake"
    )
    assert result.code == 1
    assert "the run has not ended" in result.err
    assert len(Lake.open(tmp_path / "lake").runs()) == 1
    assert (
        "was already there"
        in visup("archive", "add", tmp_path / "good", "--into", tmp_path / "lake").out
    )


def test_the_documentation_has_the_schema_of_the_tables() -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    assert schema_text() in page
    assert json.dumps({"format": "visup lake", "version": 1}) in page
