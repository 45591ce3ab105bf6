"""Clips in stores: found, identified by their metadata, copied to be watched, recorded by their URL."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from tests.archive.recordings import meeting, record
from visup.agent.model.errors import SourceError
from visup.archive.filling.clips import Clip, clips_of
from visup.archive.filling.filling import FillResult, fill
from visup.archive.filling.plan import Plan, make_plan
from visup.archive.filling.pool import Pool
from visup.archive.filling.stores import StoredFile, is_url
from visup.archive.lake import Lake
from visup.runs.settings import WatchSettings

fsspec = pytest.importorskip("fsspec", reason="needs the extra `cluster`")
arrow = pytest.importorskip("pyarrow", reason="needs the extra `cluster`")
parquet = pytest.importorskip("pyarrow.parquet", reason="needs the extra `cluster`")


@pytest.fixture
def memory() -> str:
    """A store in memory with three clips."""
    url = f"memory://{uuid4().hex}"
    return write_clips(url)


@pytest.fixture(scope="module")
def bucket() -> Iterator[str]:
    """A bucket of an object store that runs on this machine."""
    # Not among the libraries for development: moto's server and rtamt want different versions of others.
    pytest.importorskip("s3fs", reason="s3fs is not installed: pip install s3fs")
    server = pytest.importorskip("moto.server", reason="no moto: pip install 'moto[server]'")
    running = server.ThreadedMotoServer(ip_address="127.0.0.1", port=0)
    running.start()
    host, port = running.get_host_and_port()
    keys = {"AWS_ACCESS_KEY_ID": "x", "AWS_SECRET_ACCESS_KEY": "x", "AWS_REGION": "us-east-1"}
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {**keys, "AWS_ENDPOINT_URL": f"http://{host}:{port}"}.items():
            patch.setenv(name, value)
        fsspec.filesystem("s3").mkdir("clips")
        yield write_clips("s3://clips")
    running.stop()


def write_clips(url: str) -> str:
    for name in ("a.mp4", "b.avi", "deep/c.mp4", "deep/notes.txt"):
        with fsspec.open(f"{url}/{name}", "wb") as file:
            file.write(b"1" if name == "a.mp4" else b"22")
    return url


def watch(settings: WatchSettings, folder: Path) -> None:
    """A meeting whose place follows from the clip's content."""
    assert not is_url(settings.source)
    record(folder, meeting(12, shift=float(Path(settings.source).read_text())), settings)


def run(lake: Lake, clip_list: list[Clip]) -> tuple[Plan, FillResult]:
    plan = make_plan(lake, clip_list, WatchSettings(""))
    return plan, fill(lake, plan, Pool(), lambda outcome: None, watch)


def names(url: str, *paths: str) -> list[str]:
    clip_list = clips_of([f"{url}/{path}" if path else url for path in paths])
    return [str(c.source).split(url.partition("://")[2])[-1].strip("/") for c in clip_list]


def check_store(url: str, lake: Lake) -> None:
    """Check what any store must do."""
    assert names(url, "") == ["a.mp4", "b.avi", "deep/c.mp4"]
    paths = names(url, "a.mp4", "*.avi", "**/*.mp4", "deep")
    assert sorted(paths) == ["a.mp4", "b.avi", "deep/c.mp4"]
    plan, result = run(lake, clips_of([url]))
    assert (len(plan.jobs), result.failed) == (3, [])
    assert plan.bytes == 5
    sources = {row["source"] for row in lake.rows("runs")}
    assert sources == {str(c.source) for c in clips_of([url])}
    assert all(lake.recorded(key)[1].source in sources for key in lake.runs())
    assert list((lake.path / "work").iterdir()) == []
    with fsspec.open(f"{url}/a.mp4", "wb") as file:
        file.write(b"333")
    plan, _ = run(lake, clips_of([url]))
    assert (len(plan.jobs), plan.present) == (1, 2)


def test_clips_can_be_stored_in_memory(memory: str, tmp_path: Path) -> None:
    check_store(memory, Lake.create(tmp_path / "lake"))


def test_clips_can_be_stored_in_a_bucket(bucket: str, tmp_path: Path) -> None:
    check_store(bucket, Lake.create(tmp_path / "lake"))


def test_a_missing_clip_is_reported_and_the_others_are_watched(memory: str, tmp_path: Path) -> None:
    lake, clip_list = Lake.create(tmp_path / "lake"), clips_of([memory])
    fsspec.filesystem("memory").rm(str(clip_list[1].source))
    _, result = run(lake, clip_list)
    assert result.added == 2
    assert [f.source for f in result.failed] == [str(clip_list[1].source)]
    assert "it cannot be read" in result.failed[0].reason


@pytest.mark.parametrize("source", ["memory://nowhere/x.mp4", "nonsense://x/y.mp4"])
def test_a_url_without_a_clip_is_refused(source: str) -> None:
    with pytest.raises(SourceError, match="it cannot be read") as caught:
        clips_of([source])
    assert source in str(caught.value)


def test_a_parquet_manifest_equals_the_csv_one(memory: str, tmp_path: Path) -> None:
    (tmp_path / "m1.mp4").touch()
    rows: dict[str, list[Any]] = {
        "source": ["m1.mp4", f"{memory}/a.mp4"],
        "task": [["dock", "undock"], None],
        "taken": ["2026-03-01T12:00:00Z", ""],
        "gripper": ["new", 7],
    }
    rows["gripper"] = list(map(str, rows["gripper"]))
    parquet.write_table(arrow.table(rows), tmp_path / "m.parquet")
    (tmp_path / "m.csv").write_text(
        "source,task,taken,gripper\n"
        f"m1.mp4,dock;undock,2026-03-01T12:00:00Z,new\n{memory}/a.mp4,,,7\n"
    )
    first, second = (clips_of([str(tmp_path / name)]) for name in ("m.csv", "m.parquet"))
    assert first == second
    assert isinstance(first[1].source, StoredFile)
    parquet.write_table(arrow.table({"clip": ["a"]}), tmp_path / "bad.parquet")
    with pytest.raises(SourceError, match="no column `source`"):
        clips_of([str(tmp_path / "bad.parquet")])
    (tmp_path / "worse.parquet").write_bytes(os.urandom(20))
    with pytest.raises(SourceError, match="the manifest cannot be read"):
        clips_of([str(tmp_path / "worse.parquet")])
