"""Lakes are filled whatever happens: nothing twice, nothing lost, and each clip that fails is told."""

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


def filled(lake: Lake, found: list[Clip], watch: Watch = scripted) -> tuple[Plan, FillResult]:
    plan = make_plan(lake, found, SETTINGS)
    return plan, fill(lake, plan, Pool(), lambda outcome: None, watch)


def test_only_what_is_missing_is_done(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    some = clips(tmp_path / "clips", "1", "2", "1")
    plan, result = filled(lake, some)
    assert (len(plan.jobs), plan.present, plan.same, result.added) == (2, 0, 1, 2)
    before = rows(lake)
    plan, result = filled(lake, some)
    assert (len(plan.jobs), plan.present, result.added) == (0, 3, 0)
    assert rows(lake) == before
    Path(str(some[0].source)).write_text("3")
    plan, result = filled(lake, some)
    assert (len(plan.jobs), plan.present, len(lake.runs())) == (1, 2, 3)
    assert len(make_plan(lake, some, WatchSettings("", every=2)).jobs) == 3


def test_a_clip_that_fails_is_told_and_the_others_are_done(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    some = clips(tmp_path / "clips", "1", "bad", "fault", "2")
    some.append(Clip(tmp_path / "gone.mp4"))
    _, result = filled(lake, some)
    assert result.added == len(lake.runs()) == 2
    told = {Path(f.source).name: f.reason for f in result.failed}
    assert told == {
        "clip-1.mp4": "this is not a video",
        "clip-2.mp4": "visup has a fault: RuntimeError: the fuse blew",
        "gone.mp4": "it cannot be read (No such file or directory)",
    }
    assert list((lake.path / "work").iterdir()) == list((lake.path / "attempts").iterdir()) == []


class Killed(BaseException):
    """The worker dies: nothing of its own is done any more."""


def dying(at: int) -> tuple[Watch, Callable[[], bool]]:
    """Watches like `scripted` until the given clip, at which its worker dies."""
    left = iter(range(at))
    alive = True

    def watch(settings: WatchSettings, folder: Path) -> None:
        nonlocal alive
        if next(left, None) is None:
            alive = False
            raise Killed
        scripted(settings, folder)

    return watch, lambda: alive


def test_stopped_anywhere_it_goes_on_to_the_same_lake(tmp_path: Path) -> None:
    some = clips(tmp_path / "clips", "1", "2", "3")
    whole = Lake.create(tmp_path / "whole")
    filled(whole, some)
    lake = Lake.create(tmp_path / "lake")
    for at in (0, 1, 1):
        with only_filler(lake):
            clear_attempts(lake, retry=False)
            with pytest.raises(Killed):
                filled(lake, some, dying(at)[0])
    with only_filler(lake):
        clear_attempts(lake, retry=False)
        plan, result = filled(lake, some)
    assert (plan.present, result.added, result.failed) == (2, 1, [])
    assert rows(lake) == rows(whole)


def test_a_clip_that_ends_two_workers_is_put_aside(tmp_path: Path) -> None:
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
    assert filled(lake, clips(tmp_path / "clips", "1"))[1].added == 1


def test_marks_of_what_was_under_way_are_forgotten(tmp_path: Path) -> None:
    once, twice = Attempts(tmp_path, "one"), Attempts(tmp_path, "two")
    assert (once.begin(), twice.begin(), twice.begin(), twice.begin()) == (True, True, True, False)
    forget_interrupted(tmp_path)
    assert not twice.begin()
    assert (once.begin(), once.begin(), once.begin()) == (True, True, False)


def test_one_process_at_a_time_fills_a_lake(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    with only_filler(lake), pytest.raises(OutputError, match="this lake"), only_filler(lake):
        pass


def test_workers_of_dask_fill_the_same_lake_and_survive_a_deadly_clip(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    some = clips(tmp_path / "clips", "1", "deadly", "2", "bad", "3")
    lake, alone = Lake.create(tmp_path / "lake"), Lake.create(tmp_path / "alone")
    plan = make_plan(lake, some, SETTINGS)
    with open_pool(PoolSettings(workers=2)) as pool:
        result = fill(lake, plan, pool, lambda outcome: None, scripted)
    assert {(Path(f.source).name, f.put_aside) for f in result.failed} == {
        ("clip-1.mp4", True),
        ("clip-3.mp4", False),
    }
    filled(alone, [c for c in some if Path(str(c.source)).read_text().isdecimal()])
    assert rows(lake) == rows(alone)


def starters() -> list[int]:
    """The processes of this one that workers are forked from."""
    psutil = pytest.importorskip("psutil", reason="processes are found with psutil")
    found = []
    for process in psutil.Process().children():
        with suppress(psutil.Error):  # it has just ended
            found += [process.pid] if "forkserver" in " ".join(process.cmdline()) else []
    return found


def kill_starters(until: Event) -> None:
    """Kill the process that workers are forked from, and whatever takes its place, as soon as it is there."""
    while not until.wait(0.2):
        for pid in starters():
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def ten(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Clip]:
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    monkeypatch.setattr("visup.archive.filling.local_workers.POLL_S", 0.1)
    return clips(tmp_path / "clips", *map(str, range(1, 11)))


def test_workers_come_again_when_they_cannot_be_started_at_once(
    tmp_path: Path, ten: list[Clip]
) -> None:
    """What workers are forked from is killed, and so is what takes its place, before it has any."""
    lake, alone, over = Lake.create(tmp_path / "lake"), Lake.create(tmp_path / "alone"), Event()
    killer = Thread(target=kill_starters, args=(over,))

    with open_pool(PoolSettings(workers=2)) as pool:
        own = pool.own
        assert own is not None

        def kill(outcome: ClipOutcome) -> None:
            if killer.ident is None:
                killer.start()
                # Until Dask has given places up: how long that takes depends on how busy the machine is.
                while not own.renewals:
                    time.sleep(0.02)
                over.set()
                killer.join()

        result = fill(lake, make_plan(lake, ten, SETTINGS), pool, kill, scripted)
        assert over.is_set()
    assert result.added + len(result.failed) == len(ten)
    assert all(f.put_aside for f in result.failed)
    clear_attempts(lake, retry=True)
    filled(lake, ten)
    filled(alone, ten)
    assert rows(lake) == rows(alone)


def test_workers_that_never_come_again_are_not_waited_for(
    tmp_path: Path, ten: list[Clip], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("visup.archive.filling.local_workers.MAX_RENEWALS", 1)
    lake, over = Lake.create(tmp_path / "lake"), Event()
    killer = Thread(target=kill_starters, args=(over,))

    def kill(outcome: ClipOutcome) -> None:
        if killer.ident is None:
            killer.start()

    plan = make_plan(lake, ten, SETTINGS)
    with open_pool(PoolSettings(workers=2)) as pool:
        with pytest.raises(SettingsError, match="all workers were lost"):
            fill(lake, plan, pool, kill, scripted)
        over.set()
        killer.join()
    clear_attempts(lake, retry=True)
    filled(lake, ten)
    assert len(lake.runs()) == len(ten)


def test_a_scheduler_that_is_not_there_is_told() -> None:
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    with (
        pytest.raises(SettingsError, match="the scheduler cannot be reached"),
        open_pool(PoolSettings(scheduler="nonsense://here")),
    ):
        pass


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in ("a.mp4", "deep/b.avi", "deep/notes.txt", "frames-7/1.png", "mot/img1/1.jpg"):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("words", "found"),
    [
        (["a.mp4"], ["a.mp4"]),
        (["deep/notes.txt"], ["deep/notes.txt"]),  # named: whether it is a video is seen later
        (["."], ["a.mp4", "deep/b.avi", "frames-7", "mot"]),
        (["mot", "frames-7"], ["mot", "frames-7"]),
        (["*.mp4", "a.mp4"], ["a.mp4"]),
        (["**/*.avi"], ["deep/b.avi"]),
        (["deep/*"], ["deep/b.avi"]),
    ],
)
def test_sources_are_found(place: Path, words: list[str], found: list[str]) -> None:
    assert [str(Path(str(c.source)).relative_to(place)) for c in clips_of(words)] == found


def test_a_manifest_says_what_each_clip_is_watched_for(place: Path) -> None:
    (place / "m.csv").write_text(
        "source,task,actor,taken,gripper\n"
        "a.mp4,dock;undock,satellite=hubble;arm=rms,2026-03-01T12:00:00Z,new\n"
        "deep/b.avi,,,,\n"
    )
    first, second = clips_of(["m.csv"])
    assert first == Clip(
        place / "a.mp4",
        ("dock", "undock"),
        {"satellite": ("hubble",), "arm": ("rms",)},
        1772366400.0,
        {"gripper": "new"},
    )
    assert second == Clip(place / "deep/b.avi")


@pytest.mark.parametrize("words", [["m.csv", "."], [".", "m.csv"]])
def test_what_a_manifest_says_holds_wherever_else_its_clips_are_named(
    place: Path, words: list[str]
) -> None:
    (place / "m.csv").write_text("source,gripper\na.mp4,new\n")
    labels = {Path(str(c.source)).name: c.labels for c in clips_of(words)}
    assert labels.pop("a.mp4") == {"gripper": "new"}
    assert list(labels.values()) == [{}, {}, {}]


def test_the_manifest_of_the_page_is_one(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "archives.md").read_text(encoding="utf-8")
    (text,) = re.findall(r"```\n(source,task.*?)```", page, re.DOTALL)
    (tmp_path / "m.csv").write_text(text)
    (tmp_path / "m1.mp4").touch()
    (tmp_path / "m2.mp4").touch()
    first, second = clips_of([str(tmp_path / "m.csv")])
    assert (first.tasks, first.actors) == (("dock",), {"satellite": ("spartan",)})
    assert (second.tasks, second.labels) == (("dock", "undock"), {"gripper": "old"})


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("clip,task\na.mp4,dock\n", "no column `source`"),
        ("source\nz.mp4\n", "m.csv:2: there is no such clip"),
        ("source\n\n,\n", "more fields than the head"),
        ("source,taken\na.mp4,yesterday\n", "'yesterday' is no time"),
    ],
)
def test_a_manifest_with_a_fault_is_refused(place: Path, text: str, said: str) -> None:
    (place / "m.csv").write_text(text)
    with pytest.raises(SourceError) as told:
        clips_of(["m.csv"])
    assert said in str(told.value)


@pytest.mark.parametrize("word", ["nowhere.mp4", "*.webm", "deep/none"])
def test_a_word_that_names_nothing_is_refused(place: Path, word: str) -> None:
    with pytest.raises(SourceError, match="no clip is found here"):
        clips_of([word])


def test_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    visup: Call = caller(monkeypatch, capfd)
    (tmp_path / "clips").mkdir()
    write_clip(tmp_path / "clips" / "disc.avi", moving_disc(20))
    (tmp_path / "clips" / "no.mp4").write_bytes(b"this is no video at all")
    words = ("archive", "run", tmp_path / "clips", "--into", tmp_path / "lake", "--workers", 0)
    assert "2 to watch" in visup(*words, "--plan").out
    assert not (tmp_path / "lake").exists()
    told = visup(*words)
    assert told.code == 1, told.err
    assert "disc.avi: watched, 1 s of video" in told.out
    assert "no.mp4: failed: " in told.out
    assert "1 to watch" in visup(*words, "--plan").out
    assert visup(*words, "--task", "docc").code == 2
    (tmp_path / "clips" / "no.mp4").unlink()
    assert visup(*words).code == 0
