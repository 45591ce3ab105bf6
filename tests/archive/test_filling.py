"""Lakes are filled despite failures: no run twice, none lost, and each failed clip reported."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from tests.archive.watches import clips, scripted
from tests.cli import Call, caller
from tests.clips import moving_disc, write_clip
from tests.paths import ROOT
from visup.agent.model.errors import OutputError, SettingsError, SourceError
from visup.archive.filling.attempts import Attempts, forget_interrupted
from visup.archive.filling.clips import Clip, clips_of
from visup.archive.filling.filling import FillResult, clear_attempts, fill, only_filler
from visup.archive.filling.plan import Plan, make_plan
from visup.archive.filling.pool import Pool, open_pool
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.filling.watching import ClipOutcome, Watch, watch_job
from visup.archive.lake import Lake
from visup.archive.schema import TABLES
from visup.runs.settings import WatchSettings

pytest.importorskip("pyarrow", reason="needs the extra `cluster`")

SETTINGS = WatchSettings("")


def rows(lake: Lake) -> dict[str, list[Any]]:
    return {name: list(lake.rows(name)) for name in TABLES}


def fill_lake(
    lake: Lake, clip_list: list[Clip], watch: Watch = scripted
) -> tuple[Plan, FillResult]:
    plan = make_plan(lake, clip_list, SETTINGS)
    return plan, fill(lake, plan, Pool(), lambda outcome: None, watch)


def test_only_missing_runs_are_made(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    clip_list = clips(tmp_path / "clips", "1", "2", "1")
    plan, result = fill_lake(lake, clip_list)
    assert (len(plan.jobs), plan.present, plan.same, result.added) == (2, 0, 1, 2)
    before = rows(lake)
    plan, result = fill_lake(lake, clip_list)
    assert (len(plan.jobs), plan.present, result.added) == (0, 3, 0)
    assert rows(lake) == before
    Path(str(clip_list[0].source)).write_text("3")
    plan, result = fill_lake(lake, clip_list)
    assert (len(plan.jobs), plan.present, len(lake.runs())) == (1, 2, 3)
    assert len(make_plan(lake, clip_list, WatchSettings("", every=2)).jobs) == 3


def test_a_failed_clip_is_reported_and_the_others_are_watched(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    clip_list = clips(tmp_path / "clips", "1", "bad", "fault", "2")
    clip_list.append(Clip(tmp_path / "gone.mp4"))
    _, result = fill_lake(lake, clip_list)
    assert result.added == len(lake.runs()) == 2
    reasons = {Path(f.source).name: f.reason for f in result.failed}
    assert reasons == {
        "clip-1.mp4": "this is not a video",
        "clip-2.mp4": "visup has a fault: RuntimeError: the fuse blew",
        "gone.mp4": "it cannot be read (No such file or directory)",
    }
    assert list((lake.path / "work").iterdir()) == list((lake.path / "attempts").iterdir()) == []


class Killed(BaseException):
    """The worker dies without cleaning up."""


def dying(clip_index: int) -> tuple[Watch, Callable[[], bool]]:
    """Watches like `scripted` until the given clip, at which its worker dies."""
    remaining = iter(range(clip_index))
    alive = True

    def watch(settings: WatchSettings, folder: Path) -> None:
        nonlocal alive
        if next(remaining, None) is None:
            alive = False
            raise Killed
        scripted(settings, folder)

    return watch, lambda: alive


def test_an_interrupted_filling_continues_to_the_same_lake(tmp_path: Path) -> None:
    clip_list = clips(tmp_path / "clips", "1", "2", "3")
    whole = Lake.create(tmp_path / "whole")
    fill_lake(whole, clip_list)
    lake = Lake.create(tmp_path / "lake")
    for clip_index in (0, 1, 1):
        with only_filler(lake):
            clear_attempts(lake, retry=False)
            with pytest.raises(Killed):
                fill_lake(lake, clip_list, dying(clip_index)[0])
    with only_filler(lake):
        clear_attempts(lake, retry=False)
        plan, result = fill_lake(lake, clip_list)
    assert (plan.present, result.added, result.failed) == (2, 1, [])
    assert rows(lake) == rows(whole)


def test_a_clip_that_kills_two_workers_is_set_aside(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    (job,) = make_plan(lake, clips(tmp_path / "clips", "1"), SETTINGS).jobs
    for _ in range(2):
        with pytest.raises(Killed):
            watch_job(lake, job, dying(0)[0])
    outcome = watch_job(lake, job, dying(0)[0])
    assert outcome.failure is not None
    assert outcome.failure.put_aside
    clear_attempts(lake, retry=False)
    plan = make_plan(lake, clips(tmp_path / "clips", "1"), SETTINGS)
    assert (plan.jobs, [f.put_aside for f in plan.failed]) == ((), [True])
    clear_attempts(lake, retry=True)
    assert fill_lake(lake, clips(tmp_path / "clips", "1"))[1].added == 1


def test_interrupted_attempts_are_forgotten(tmp_path: Path) -> None:
    once, twice = Attempts(tmp_path, "one"), Attempts(tmp_path, "two")
    assert (once.begin(), twice.begin(), twice.begin(), twice.begin()) == (True, True, True, False)
    forget_interrupted(tmp_path)
    assert not twice.begin()
    assert (once.begin(), once.begin(), once.begin()) == (True, True, False)


def test_only_one_process_fills_a_lake(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    with only_filler(lake), pytest.raises(OutputError, match="this lake"), only_filler(lake):
        pass


def test_dask_workers_fill_the_same_lake_despite_a_deadly_clip(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    clip_list = clips(tmp_path / "clips", "1", "deadly", "2", "bad", "3")
    lake, alone = Lake.create(tmp_path / "lake"), Lake.create(tmp_path / "alone")
    plan = make_plan(lake, clip_list, SETTINGS)
    with open_pool(PoolSettings(workers=2)) as pool:
        result = fill(lake, plan, pool, lambda outcome: None, scripted)
    assert {(Path(f.source).name, f.put_aside) for f in result.failed} == {
        ("clip-1.mp4", True),
        ("clip-3.mp4", False),
    }
    fill_lake(alone, [c for c in clip_list if Path(str(c.source)).read_text().isdecimal()])
    assert rows(lake) == rows(alone)


def fork_servers() -> list[int]:
    """Ids of the child processes that workers are forked from."""
    psutil = pytest.importorskip("psutil", reason="processes are found with psutil")
    pids = []
    for process in psutil.Process().children():
        with suppress(psutil.Error):  # it has just ended
            pids += [process.pid] if "forkserver" in " ".join(process.cmdline()) else []
    return pids


def kill_fork_servers(until: Event) -> None:
    """Kill the process that workers are forked from, and each one that replaces it."""
    while not until.wait(0.2):
        for pid in fork_servers():
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def ten_clips(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Clip]:
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    monkeypatch.setattr("visup.archive.filling.local_workers.POLL_S", 0.1)
    return clips(tmp_path / "clips", *map(str, range(1, 11)))


def test_workers_are_restarted_until_they_can_be_started(
    tmp_path: Path, ten_clips: list[Clip]
) -> None:
    """The fork server and its replacements are killed before they have forked a worker."""
    lake, alone, finished = Lake.create(tmp_path / "lake"), Lake.create(tmp_path / "alone"), Event()
    killer = Thread(target=kill_fork_servers, args=(finished,))

    with open_pool(PoolSettings(workers=2)) as pool:
        local_workers = pool.own
        assert local_workers is not None

        def kill(outcome: ClipOutcome) -> None:
            if killer.ident is None:
                killer.start()
                # Until Dask has given workers up: how long that takes depends on how busy the machine is.
                while not local_workers.renewals:
                    time.sleep(0.02)
                finished.set()
                killer.join()

        result = fill(lake, make_plan(lake, ten_clips, SETTINGS), pool, kill, scripted)
        assert finished.is_set()
    assert result.added + len(result.failed) == len(ten_clips)
    assert all(f.put_aside for f in result.failed)
    clear_attempts(lake, retry=True)
    fill_lake(lake, ten_clips)
    fill_lake(alone, ten_clips)
    assert rows(lake) == rows(alone)


def test_workers_that_cannot_be_restarted_end_the_filling(
    tmp_path: Path, ten_clips: list[Clip], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("visup.archive.filling.local_workers.MAX_RENEWALS", 1)
    lake, finished = Lake.create(tmp_path / "lake"), Event()
    killer = Thread(target=kill_fork_servers, args=(finished,))

    def kill(outcome: ClipOutcome) -> None:
        if killer.ident is None:
            killer.start()

    plan = make_plan(lake, ten_clips, SETTINGS)
    with open_pool(PoolSettings(workers=2)) as pool:
        with pytest.raises(SettingsError, match="all workers were lost"):
            fill(lake, plan, pool, kill, scripted)
        finished.set()
        killer.join()
    clear_attempts(lake, retry=True)
    fill_lake(lake, ten_clips)
    assert len(lake.runs()) == len(ten_clips)


def test_an_unreachable_scheduler_is_reported() -> None:
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    with (
        pytest.raises(SettingsError, match="the scheduler cannot be reached"),
        open_pool(PoolSettings(scheduler="nonsense://here")),
    ):
        pass


@pytest.fixture
def folder_of_clips(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("a.mp4", "deep/b.avi", "deep/notes.txt", "frames-7/1.png", "mot/img1/1.jpg"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("sources", "expected"),
    [
        (["a.mp4"], ["a.mp4"]),
        (
            ["deep/notes.txt"],
            ["deep/notes.txt"],
        ),  # named explicitly: whether it is a video is found out later
        (["."], ["a.mp4", "deep/b.avi", "frames-7", "mot"]),
        (["mot", "frames-7"], ["mot", "frames-7"]),
        (["*.mp4", "a.mp4"], ["a.mp4"]),
        (["**/*.avi"], ["deep/b.avi"]),
        (["deep/*"], ["deep/b.avi"]),
    ],
)
def test_sources_are_found(folder_of_clips: Path, sources: list[str], expected: list[str]) -> None:
    assert [
        str(Path(str(c.source)).relative_to(folder_of_clips)) for c in clips_of(sources)
    ] == expected


def test_a_manifest_gives_tasks_actors_and_labels_of_clips(folder_of_clips: Path) -> None:
    (folder_of_clips / "m.csv").write_text(
        "source,task,actor,taken,gripper\n"
        "a.mp4,dock;undock,satellite=hubble;arm=rms,2026-03-01T12:00:00Z,new\n"
        "deep/b.avi,,,,\n"
    )
    first, second = clips_of(["m.csv"])
    assert first == Clip(
        folder_of_clips / "a.mp4",
        ("dock", "undock"),
        {"satellite": ("hubble",), "arm": ("rms",)},
        1772366400.0,
        {"gripper": "new"},
    )
    assert second == Clip(folder_of_clips / "deep/b.avi")


@pytest.mark.parametrize("sources", [["m.csv", "."], [".", "m.csv"]])
def test_a_manifest_applies_to_clips_also_named_elsewhere(
    folder_of_clips: Path, sources: list[str]
) -> None:
    (folder_of_clips / "m.csv").write_text("source,gripper\na.mp4,new\n")
    labels = {Path(str(c.source)).name: c.labels for c in clips_of(sources)}
    assert labels.pop("a.mp4") == {"gripper": "new"}
    assert list(labels.values()) == [{}, {}, {}]


def test_the_manifest_of_the_documentation_is_valid(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```\n(source,task.*?)```", page, re.DOTALL)
    (tmp_path / "m.csv").write_text(text)
    (tmp_path / "m1.mp4").touch()
    (tmp_path / "m2.mp4").touch()
    first, second = clips_of([str(tmp_path / "m.csv")])
    assert (first.tasks, first.actors) == (("dock",), {"satellite": ("spartan",)})
    assert (second.tasks, second.labels) == (("dock", "undock"), {"gripper": "old"})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("clip,task\na.mp4,dock\n", "no column `source`"),
        ("source\nz.mp4\n", "m.csv:2: there is no such clip"),
        ("source\n\n,\n", "more fields than the head"),
        ("source,taken\na.mp4,yesterday\n", "'yesterday' is no time"),
    ],
)
def test_an_invalid_manifest_is_refused(folder_of_clips: Path, text: str, message: str) -> None:
    (folder_of_clips / "m.csv").write_text(text)
    with pytest.raises(SourceError) as caught:
        clips_of(["m.csv"])
    assert message in str(caught.value)


@pytest.mark.parametrize("source", ["nowhere.mp4", "*.webm", "deep/none"])
def test_a_source_without_clips_is_refused(folder_of_clips: Path, source: str) -> None:
    with pytest.raises(SourceError, match="no clip is found here"):
        clips_of([source])


def test_the_command_fills_a_lake_and_reports_failures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    (tmp_path / "clips").mkdir()
    write_clip(tmp_path / "clips" / "disc.avi", moving_disc(20))
    (tmp_path / "clips" / "no.mp4").write_bytes(b"this is no video at all")
    arguments = ("archive", "run", tmp_path / "clips", "--into", tmp_path / "lake", "--workers", 0)
    assert "2 to watch" in visup(*arguments, "--plan").out
    assert not (tmp_path / "lake").exists()
    result = visup(*arguments)
    assert result.code == 1, result.err
    assert "disc.avi: watched, 1 s of video" in result.out
    assert "no.mp4: failed: " in result.out
    assert "1 to watch" in visup(*arguments, "--plan").out
    assert visup(*arguments, "--task", "docc").code == 2
    (tmp_path / "clips" / "no.mp4").unlink()
    assert visup(*arguments).code == 0
