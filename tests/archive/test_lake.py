"""Lakes: the rows of a run are those of its journal, and a run is there whole or not at all."""

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
    given = Provenance(KEY, "s", "t", 1e9, {"gripper": "new"})
    return run_tables(recording, settings, given)


@pytest.fixture(scope="module")
def tables(run: Recording) -> RunTables:
    return tables_of(run)


def as_records(tables: RunTables, name: str) -> list[dict[str, object]]:
    return [dict(zip(TABLES[name].names, row, strict=True)) for row in tables[name]]


def test_the_rows_are_always_the_same(run: Recording, tables: RunTables) -> None:
    assert tables_of(run) == tables
    assert list(tables) == list(TABLES)
    assert all(len(row) == len(TABLES[name].columns) for name in TABLES for row in tables[name])
    assert {row[0] for rows in tables.values() for row in rows} == {KEY}


def test_rows_are_what_was_believed_at_each_step(tmp_path: Path) -> None:
    steps = record(tmp_path, meeting(), DOCK)
    tables = tables_of(Recording.open(tmp_path))
    stages, relations = as_records(tables, "stages"), as_records(tables, "relations")
    for number, step in enumerate(steps):

        def now(rows: list[dict[str, object]], at: int = number) -> list[dict[str, object]]:
            return [r for r in rows if r["first_frame"] <= at < r["first_frame"] + r["steps"]]  # type: ignore[operator]

        told = {(r["task"], r["stage"]): r["status"] for r in now(stages)}
        assert told == {(t.task, s.stage): s.status for t in step.mind.tasks for s in t.stages}
        held = {
            (r["a"], r["b"])
            for r in now(relations)
            if r["relation"] == "converging" and r["truth"] == "true"
        }
        assert held == {
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
        read, wanted = list(lake.rows(name)), as_records(tables, name)
        for row in read:
            if name == "runs":
                row["taken"] = row["taken"].timestamp()  # type: ignore[index]
        assert read == wanted, name
    schemas = {name: {str(parquet.read_schema(f)) for f in lake.files(name)} for name in TABLES}
    assert {name for name, found in schemas.items() if len(found) != 1} == set()


def test_a_kept_run_is_reasoned_about_again_without_its_files(tmp_path: Path) -> None:
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
    recording, kept = lake.recorded(key)
    assert list(replay(recording, kept).events) == list(recording.events())


def files_in(lake: Lake) -> set[str]:
    return {str(p.relative_to(lake.path)) for p in lake.path.rglob("*") if p.is_file()}


def test_a_writer_may_stop_anywhere(
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


def test_settings_are_told_apart_by_content(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    for folder in (one, two):
        folder.mkdir()
        (folder / "a.task").write_text("<a> ::= converging(arm, satellite)\n")
        (folder / "db").write_bytes(b"models")

    def hashed(folder: Path, **more: object) -> str:
        task = str(folder / "a.task")
        return settings_hash(WatchSettings("x", tasks=(task,), models=folder / "db", **more))  # type: ignore[arg-type]

    assert hashed(one) == hashed(two) != hashed(one, every=2)
    (two / "a.task").write_text("<a> ::= diverging(arm, satellite)\n")
    assert hashed(one) != hashed(two)
    (two / "a.task").write_text("<a> ::= converging(arm, satellite)\n")
    (two / "db").write_bytes(b"others")
    assert hashed(one) != hashed(two)
    assert content_hash(one) != content_hash(two)
    (two / "db").write_bytes(b"models")
    assert content_hash(one) == content_hash(two)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (None, "there is no lake here"),
        ("[]", "this is not a lake"),
        ('{"version": 99}', "this lake has version 99"),
        ("{", "this is not a lake"),
    ],
)
def test_what_is_no_lake_is_refused(tmp_path: Path, text: str | None, said: str) -> None:
    if text is not None:
        (tmp_path / "lake.json").write_text(text)
    with pytest.raises(OutputError, match=said):
        Lake.open(tmp_path)


def test_a_folder_with_something_else_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="no lake"):
        Lake.create(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


def test_the_command_adds_what_it_can(visup: Call, tmp_path: Path) -> None:
    record(tmp_path / "good", meeting())
    record(tmp_path / "cut", meeting(5), ended=None)
    told = visup("archive", "add", tmp_path / "cut", tmp_path / "good", "--into", tmp_path / "lake")
    assert told.code == 1
    assert "the run has not ended" in told.err
    assert len(Lake.open(tmp_path / "lake").runs()) == 1
    assert (
        "was already there"
        in visup("archive", "add", tmp_path / "good", "--into", tmp_path / "lake").out
    )


def test_the_page_says_what_the_tables_hold() -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    assert schema_text() in page
    assert json.dumps({"format": "visup lake", "version": 1}) in page
