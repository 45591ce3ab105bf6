"""Lakes in stores: readers see what was written, in whole runs, even if a writer is interrupted."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from tests.archive.recordings import meeting, record
from tests.archive.test_filling import rows
from tests.archive.test_stores import bucket
from tests.archive.watches import clips, scripted
from tests.cli import Call, caller
from visup.agent.model.errors import OutputError
from visup.archive.adding import add_run
from visup.archive.filling.filling import fill
from visup.archive.filling.plan import make_plan
from visup.archive.filling.pool import Pool
from visup.archive.joining.compacting import compact
from visup.archive.lake import Lake
from visup.archive.querying.database import open_database
from visup.archive.storing import lake_store
from visup.archive.storing.lake_store import LakeStore
from visup.archive.storing.places import create_lake, open_lake, pushed, store_of
from visup.runs.settings import WatchSettings

__all__ = ["bucket"]

fsspec = pytest.importorskip("fsspec", reason="needs the extra `cluster`")
pytest.importorskip("pyarrow", reason="needs the extra `cluster`")
pytest.importorskip("duckdb", reason="needs the extra `cluster`")


class Machine:
    """A machine with its own copies of lakes."""

    def __init__(self, caches: Path, patch: pytest.MonkeyPatch) -> None:
        self._caches, self._patch = caches, patch

    def __call__(self, name: str) -> None:
        """Act as this machine from now on."""
        self._patch.setenv("XDG_CACHE_HOME", str(self._caches / name))


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    machine_of = Machine(tmp_path / "machines", monkeypatch)
    machine_of("here")
    return machine_of


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """The lake of two clips in a folder."""
    folder = tmp_path_factory.mktemp("whole")
    lake = Lake.create(folder / "lake")
    clip_list = clips(folder / "clips", "1", "2")
    fill(
        lake, make_plan(lake, clip_list, WatchSettings("")), Pool(), lambda outcome: None, scripted
    )
    return lake


def rows_without_sources(lake: Lake) -> dict[str, list[dict[str, Any]]]:
    """All rows, without the paths of the clips."""
    omitted = ("source", "settings")
    return {
        name: [{k: v for k, v in row.items() if k not in omitted} for row in of]
        for name, of in rows(lake).items()
    }


def fill_store(url: str, folder: Path) -> Lake:
    lake, store = create_lake(url), store_of(url)
    assert store is not None
    plan = make_plan(lake, clips(folder / "clips", "1", "2"), WatchSettings(""))
    fill(lake, plan, Pool(), pushed(store, lake, lambda outcome: None), scripted)
    store.push(lake)
    return lake


def check_store(url: str, folder: Path, machine: Machine, whole: Lake) -> None:
    """Check what any store must do."""
    fill_store(url, folder)
    machine("elsewhere")
    lake = open_lake(url)
    assert rows_without_sources(lake) == rows_without_sources(whole)
    assert not (lake.path / "recordings").exists()
    run = lake.runs()[0]
    assert len(list(lake.recorded(run)[0].events())) == len(list(whole.recorded(run)[0].events()))
    compact(lake, grace_s=0.0)
    LakeStore(url).push(lake)
    loose = fsspec.core.url_to_fs(url)[0].glob(f"{url}/tables/runs/??/*.parquet")
    assert loose == []
    machine("third")
    again = open_lake(url)
    assert rows_without_sources(again) == rows_without_sources(whole)
    with open_database(again) as database:
        assert database.ask("SELECT count(*) AS n FROM runs").to_pylist() == [{"n": 2}]


def test_a_lake_can_be_stored_in_memory(tmp_path: Path, machine: Machine, whole: Lake) -> None:
    check_store(f"memory://{uuid4().hex}/lake", tmp_path, machine, whole)


def test_a_lake_can_be_stored_at_a_file_url(tmp_path: Path, machine: Machine, whole: Lake) -> None:
    check_store(f"file://{tmp_path}/store/lake", tmp_path, machine, whole)


def test_a_lake_can_be_stored_in_a_bucket(
    bucket: str, tmp_path: Path, machine: Machine, whole: Lake
) -> None:
    check_store(f"{bucket}/lake", tmp_path, machine, whole)


def test_an_interrupted_upload_leaves_whole_runs_and_can_be_completed(
    tmp_path: Path, machine: Machine, whole: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    send, expected, counts = lake_store._upload, rows_without_sources(whole), set[int]()
    for allowed in (16, 24):
        machine(f"writer-{allowed}")
        url, remaining = f"memory://{uuid4().hex}", iter(range(allowed))

        def failing(*arguments: Any, remaining: Iterator[int] = remaining) -> None:
            if next(remaining, None) is None:
                raise ConnectionResetError("the network is gone")
            send(*arguments)

        monkeypatch.setattr(lake_store, "_upload", failing)
        with pytest.raises(OutputError, match="the network is gone"):
            fill_store(url, tmp_path)
        monkeypatch.setattr(lake_store, "_upload", send)
        machine(f"reader-{allowed}")
        committed = set(open_lake(url).runs()) if LakeStore(url).exists() else set[str]()
        counts.add(len(committed))
        if committed:
            assert {k: [r for r in of if r["run"] in committed] for k, of in expected.items()} == (
                rows_without_sources(open_lake(url))
            )
        machine(f"writer-{allowed}")
        fill_store(url, tmp_path)
        machine(f"reader-{allowed}")
        assert rows_without_sources(open_lake(url)) == expected
    assert {0} < counts  # of some uploads nothing was committed, of others something


def test_compacting_by_another_writer_is_not_overwritten(tmp_path: Path, machine: Machine) -> None:
    url = f"memory://{uuid4().hex}"
    mine = fill_store(url, tmp_path)
    machine("elsewhere")
    other = open_lake(url)
    compact(other)
    LakeStore(url).push(other)
    compact(mine)
    with pytest.raises(OutputError, match="another has joined files"):
        LakeStore(url).push(mine)
    machine("here")
    LakeStore(url).push(open_lake(url))
    assert len(open_lake(url).runs()) == 2


@pytest.mark.parametrize("url", ["memory://nowhere", "nonsense://x/lake"])
def test_a_url_without_a_lake_is_reported(url: str, machine: Machine) -> None:
    with pytest.raises(OutputError, match=r"no lake here|cannot be read"):
        open_lake(url)


def test_the_commands_work_on_urls(
    tmp_path: Path,
    machine: Machine,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    url = f"memory://{uuid4().hex}/lake"
    record(tmp_path / "run", meeting(30))
    assert visup("query", url, "SELECT * FROM runs").code == 2
    assert visup("archive", "add", tmp_path / "run", "--into", url).code == 0
    machine("elsewhere")
    result = visup("query", url, "SELECT clip FROM runs", "--format", "csv")
    assert (result.code, result.out.split()) == (0, ["clip", "clip.mp4"])
    found = visup("find", url, "converging(arm, spartan)")
    lake = Lake.create(tmp_path / "lake")
    add_run(lake, tmp_path / "run")
    same = visup("find", lake.path, "converging(arm, spartan)")
    assert (found.code, found.out.splitlines()[:2]) == (same.code, same.out.splitlines()[:2])
    assert visup("archive", "compact", url, "--now").code == 0
