"""Lakes in stores: what is read anywhere is what was filled, whole runs only, whenever a writer stops."""

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

    def __init__(self, place: Path, patch: pytest.MonkeyPatch) -> None:
        self._place, self._patch = place, patch

    def __call__(self, name: str) -> None:
        """From now on, this machine is meant."""
        self._patch.setenv("XDG_CACHE_HOME", str(self._place / name))


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    at = Machine(tmp_path / "machines", monkeypatch)
    at("here")
    return at


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Lake:
    """The lake of two clips in a folder."""
    place = tmp_path_factory.mktemp("whole")
    lake = Lake.create(place / "lake")
    some = clips(place / "clips", "1", "2")
    fill(lake, make_plan(lake, some, WatchSettings("")), Pool(), lambda outcome: None, scripted)
    return lake


def without_places(lake: Lake) -> dict[str, list[dict[str, Any]]]:
    """All rows, but for where the clips were."""
    own = ("source", "settings")
    return {
        name: [{k: v for k, v in row.items() if k not in own} for row in of]
        for name, of in rows(lake).items()
    }


def filled(place: str, folder: Path) -> Lake:
    lake, store = create_lake(place), store_of(place)
    assert store is not None
    plan = make_plan(lake, clips(folder / "clips", "1", "2"), WatchSettings(""))
    fill(lake, plan, Pool(), pushed(store, lake, lambda outcome: None), scripted)
    store.push(lake)
    return lake


def check_store(place: str, folder: Path, machine: Machine, whole: Lake) -> None:
    """What is asked of any store."""
    filled(place, folder)
    machine("elsewhere")
    lake = open_lake(place)
    assert without_places(lake) == without_places(whole)
    assert not (lake.path / "recordings").exists()
    run = lake.runs()[0]
    assert len(list(lake.recorded(run)[0].events())) == len(list(whole.recorded(run)[0].events()))
    compact(lake, grace_s=0.0)
    LakeStore(place).push(lake)
    left = fsspec.core.url_to_fs(place)[0].glob(f"{place}/tables/runs/??/*.parquet")
    assert left == []
    machine("third")
    again = open_lake(place)
    assert without_places(again) == without_places(whole)
    with open_database(again) as database:
        assert database.ask("SELECT count(*) AS n FROM runs").to_pylist() == [{"n": 2}]


def test_a_lake_in_memory(tmp_path: Path, machine: Machine, whole: Lake) -> None:
    check_store(f"memory://{uuid4().hex}/lake", tmp_path, machine, whole)


def test_a_lake_on_a_disk_that_is_named_by_a_url(
    tmp_path: Path, machine: Machine, whole: Lake
) -> None:
    check_store(f"file://{tmp_path}/store/lake", tmp_path, machine, whole)


def test_a_lake_in_a_bucket(bucket: str, tmp_path: Path, machine: Machine, whole: Lake) -> None:
    check_store(f"{bucket}/lake", tmp_path, machine, whole)


def test_wherever_a_writer_stops_there_are_whole_runs_and_the_rest_comes(
    tmp_path: Path, machine: Machine, whole: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    send, expected, seen = lake_store._upload, without_places(whole), set[int]()
    for allowed in (16, 24):
        machine(f"writer-{allowed}")
        place, left = f"memory://{uuid4().hex}", iter(range(allowed))

        def failing(*given: Any, left: Iterator[int] = left) -> None:
            if next(left, None) is None:
                raise ConnectionResetError("the network is gone")
            send(*given)

        monkeypatch.setattr(lake_store, "_upload", failing)
        with pytest.raises(OutputError, match="the network is gone"):
            filled(place, tmp_path)
        monkeypatch.setattr(lake_store, "_upload", send)
        machine(f"reader-{allowed}")
        there = set(open_lake(place).runs()) if LakeStore(place).exists() else set[str]()
        seen.add(len(there))
        if there:
            assert {k: [r for r in of if r["run"] in there] for k, of in expected.items()} == (
                without_places(open_lake(place))
            )
        machine(f"writer-{allowed}")
        filled(place, tmp_path)
        machine(f"reader-{allowed}")
        assert without_places(open_lake(place)) == expected
    assert {0} < seen  # some were there, and others not


def test_who_has_joined_meanwhile_is_not_overruled(tmp_path: Path, machine: Machine) -> None:
    place = f"memory://{uuid4().hex}"
    mine = filled(place, tmp_path)
    machine("elsewhere")
    other = open_lake(place)
    compact(other)
    LakeStore(place).push(other)
    compact(mine)
    with pytest.raises(OutputError, match="another has joined files"):
        LakeStore(place).push(mine)
    machine("here")
    LakeStore(place).push(open_lake(place))
    assert len(open_lake(place).runs()) == 2


@pytest.mark.parametrize("place", ["memory://nowhere", "nonsense://x/lake"])
def test_what_is_no_lake_is_told(place: str, machine: Machine) -> None:
    with pytest.raises(OutputError, match=r"no lake here|cannot be read"):
        open_lake(place)


def test_the_commands(
    tmp_path: Path,
    machine: Machine,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    place = f"memory://{uuid4().hex}/lake"
    record(tmp_path / "run", meeting(30))
    assert visup("query", place, "SELECT * FROM runs").code == 2
    assert visup("archive", "add", tmp_path / "run", "--into", place).code == 0
    machine("elsewhere")
    told = visup("query", place, "SELECT clip FROM runs", "--format", "csv")
    assert (told.code, told.out.split()) == (0, ["clip", "clip.mp4"])
    found = visup("find", place, "converging(arm, spartan)")
    lake = Lake.create(tmp_path / "lake")
    add_run(lake, tmp_path / "run")
    same = visup("find", lake.path, "converging(arm, spartan)")
    assert (found.code, found.out.splitlines()[:2]) == (same.code, same.out.splitlines()[:2])
    assert visup("archive", "compact", place, "--now").code == 0
