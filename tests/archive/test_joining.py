"""Compacting a lake changes none of its rows, answers and hits, even if it is interrupted."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.archive.recordings import recorded
from tests.cli import Call, caller
from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import replacing
from visup.agent.storage.journal_reader import Recording
from visup.archive.finding.search import read_search
from visup.archive.inputs import run_inputs
from visup.archive.joining import compacting
from visup.archive.joining.compacting import compact
from visup.archive.joining.manifest import FOLDER, MANIFEST, read_manifest
from visup.archive.lake import Lake
from visup.archive.querying.database import open_database
from visup.archive.querying.views import RELATIONS, VIEWS
from visup.archive.run_tables import Provenance, RunTables, run_tables
from visup.archive.schema import TABLES
from visup.runs.resume import recorded_settings
from visup.runs.settings import WatchSettings

pytest.importorskip("pyarrow", reason="needs the extra `cluster`")
pytest.importorskip("duckdb", reason="needs the extra `cluster`")

DOCK = WatchSettings("clip.mp4", tasks=("dock",), actors={"satellite": ("spartan",)})
KEYS = tuple(f"{n:02x}" * 16 for n in range(5))
SEARCHES = (
    "converging(arm, satellite) and then touching(arm, satellite)",
    "touching(a, object_2) within 1 s and not close_to(a, b)",
    "diverging(spartan, arm)",
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, RunTables]:
    recording = recorded(tmp_path_factory.mktemp("run"), DOCK)
    run_settings = recorded_settings(recording.facts(), "")
    return recording, run_tables(
        recording, run_settings, Provenance("", "s", "t", 1e9, {"gripper": "new"})
    )


def add(lake: Lake, run: tuple[Recording, RunTables], *keys: str) -> Lake:
    """Commit runs that differ in their key alone; the last one has no relations."""
    recording, tables = run
    for key in keys:
        rows_by_table: dict[str, Any] = {
            t: [(key, *row[1:]) for row in rows] for t, rows in tables.items()
        }
        if key == KEYS[-1]:
            rows_by_table["relations"] = rows_by_table["alerts"] = []
        lake.commit(rows_by_table, recording, run_inputs(DOCK))
    return lake


@pytest.fixture(scope="module")
def loose(
    tmp_path_factory: pytest.TempPathFactory, run: tuple[Recording, RunTables]
) -> tuple[dict[str, Any], Lake]:
    """The contents of a lake that is not compacted, and the lake."""
    lake = add(Lake.create(tmp_path_factory.mktemp("loose") / "lake"), run, *KEYS)
    return contents(lake), lake


def contents(lake: Lake) -> dict[str, Any]:
    """The contents of a lake: its rows, those of every view, and the runs in which conditions may hold."""
    everything: dict[str, Any] = {name: list(lake.rows(name)) for name in TABLES}
    with open_database(lake) as database:
        for view in (*VIEWS, *RELATIONS[:3], *(f"lake.{name}" for name in TABLES)):
            rows = database.ask(f"SELECT * FROM {view}").to_pylist()
            everything[f"view {view}"] = sorted(json.dumps(r, default=str) for r in rows)
        for text in SEARCHES:
            everything[text] = read_search(text).possible_runs(database)
    return {**everything, "keys": lake.runs(), "has": [lake.has(key) for key in KEYS]}


def test_a_compacted_lake_has_the_same_contents(
    tmp_path: Path, run: tuple[Recording, RunTables], loose: tuple[dict[str, Any], Lake]
) -> None:
    lake = add(Lake.create(tmp_path / "lake"), run, *KEYS[:3])
    assert compact(lake, now=1e9).joined == 3
    add(lake, run, *KEYS[2:])  # one again, which is there
    half = contents(lake)
    assert compact(lake, now=1e9 + 1, grace_s=0.0).tidied == 5
    assert half == contents(lake) == loose[0]
    assert not [f for name in TABLES for f in lake.files(name) if f.stem in KEYS]
    assert len(list((lake.path / FOLDER).iterdir())) == 1  # the first was small, and went into it
    assert compact(lake).joined == 0


@settings(max_examples=3, deadline=None)
@given(st.permutations(KEYS[:4]), st.integers(1, 3), st.integers(1, 3))
def test_partitions_contain_each_run_once_in_any_order(
    tmp_path_factory: pytest.TempPathFactory,
    run: tuple[Recording, RunTables],
    keys: list[str],
    first: int,
    max_runs: int,
) -> None:
    """Whatever the order in which they came; and no partition is larger than it may be."""
    lake = Lake.create(tmp_path_factory.mktemp("order") / "lake")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compacting, "MAX_RUNS", max_runs)
        for part in (keys[:first], keys[first:]):
            compact(add(lake, run, *part))
        parts = read_manifest(lake.path).partitions
    assert sorted(key for part in parts for key in part.runs) == sorted(keys)
    assert all(len(part.runs) <= max_runs for part in parts)
    assert len({part.number for part in parts}) == len(parts)
    assert [r["run"] for r in lake.rows("runs")] == sorted(keys)


def test_compacting_may_stop_anywhere(
    tmp_path: Path,
    run: tuple[Recording, RunTables],
    loose: tuple[dict[str, Any], Lake],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    lake = add(Lake.create(tmp_path / "lake"), run, *KEYS)
    allowed = 0

    @contextmanager
    def failing(path: Path) -> Iterator[Path]:
        nonlocal allowed
        allowed -= 1
        if allowed < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        with replacing(path) as draft:
            yield draft

    monkeypatch.setattr("visup.archive.joining.partition.replacing", failing)
    monkeypatch.setattr("visup.agent.storage.atomic.replacing", failing)
    for stop in (0, 5, len(TABLES) + 3):  # in the first file, in the middle, at the manifest
        allowed = stop
        with pytest.raises(OutputError, match="No space left"):
            compact(lake, grace_s=0.0)
        assert lake.runs() == list(KEYS)
        assert not (lake.path / MANIFEST).exists()
    allowed = 100
    assert compact(lake, grace_s=0.0).joined == len(KEYS)
    assert contents(lake) == loose[0]


def test_a_reader_is_not_disturbed_by_compacting(
    tmp_path: Path, run: tuple[Recording, RunTables]
) -> None:
    lake = add(Lake.create(tmp_path / "lake"), run, *KEYS[:3])
    query = "SELECT count(*) AS n, count(DISTINCT run) AS runs FROM relations"
    with open_database(lake) as database:
        before = database.ask(query).to_pylist()
        compact(lake)
        add(lake, run, KEYS[3])
        assert database.ask(query).to_pylist() == before
    with open_database(lake) as database:
        assert database.ask(query).to_pylist()[0]["runs"] == 4


@pytest.mark.parametrize("text", ["{", '{"version": 9}', '{"version": 1}'])
def test_a_damaged_manifest_is_refused(tmp_path: Path, text: str) -> None:
    lake = Lake.create(tmp_path / "lake")
    (lake.path / MANIFEST).write_text(text)
    with pytest.raises(OutputError, match="list of partitions"):
        lake.runs()


def test_the_command_reports_merged_runs(
    loose: tuple[dict[str, Any], Lake],
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    first = visup("archive", "compact", loose[1].path)
    assert (first.code, first.out) == (0, "Merged 5 runs; the lake has 1 partition.\n")
    again = visup("archive", "compact", loose[1].path, "--now")
    assert again.out == (
        "Merged 0 runs; the lake has 1 partition. Replaced files of 5 runs were removed.\n"
    )
    assert visup("archive", "compact", loose[1].path.parent).code == 2
