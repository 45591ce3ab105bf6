"""A run is followed by the next: no frame is in both or in none, and what is believed goes on."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.clips import moving_disc, write_clip
from visup.agent.model.errors import OutputError
from visup.agent.storage.file_lock import lock_path
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.runs.inputs.audience import Audience
from visup.runs.recorder import Recorder
from visup.runs.resume import interrupted_run
from visup.runs.runner import fresh_folder, supervised
from visup.runs.settings import RunOptions, WatchSettings
from visup.runs.unattended.next_run import RETRY_S, RollOver
from visup.serving.run_store import RunStore, begin_run, resumable_run

RULE = 'rule seen(a): warning\n    when in_view(a) > 0.1 s\n    say "{a} {is} seen."\n'


@given(st.lists(st.floats(0.0, 10.0), max_size=50).map(sorted), st.floats(0.5, 5.0))
def test_the_next_run_begins_after_the_maximum_duration(times: list[float], long: float) -> None:
    roll = RollOver(RunOptions(run_s=long))
    begun = times[0] if times else 0.0
    for time in times:
        due = roll.due(time, size=0)
        assert due == (time - begun >= long)
        if due:
            roll.begun(time)
            begun = time


def test_the_next_run_begins_at_the_maximum_size_and_is_retried_later() -> None:
    roll = RollOver(RunOptions(run_bytes=100))
    assert not roll.due(0.0, 99)
    assert roll.due(1.0, 100)
    roll.failed(1.0)
    assert not roll.due(1.0 + RETRY_S / 2, 500)
    assert roll.due(1.0 + RETRY_S, 500)


class Camera:
    """A camera whose runs follow one another."""

    def __init__(self, folder: Path) -> None:
        clip = write_clip(folder / "disc.avi", moving_disc(40), fps=40.0)
        (folder / "own.rules").write_text(RULE)
        self.settings = WatchSettings(f"loop:{clip}", rules=(folder / "own.rules",))
        self.told = folder / "alerts.jsonl"
        self.store = RunStore(folder / "cell", "a")
        self.options = RunOptions(
            video=False, report=False, sinks=(f"file:{self.told}",), state_every_s=1000.0, run_s=0.4
        )
        self.seen: dict[int, tuple[int, ...]] = {}

    def watch(self, steps: int) -> None:
        """As a process that is killed after so many steps."""
        folder = resumable_run(self.store.folder, "a")
        past = interrupted_run(folder) if folder else None
        place = folder or fresh_folder(begin_run(self.store.folder, "a"), "")
        options = replace(self.options, run_s=self.options.run_s)
        run = supervised(
            past.settings if past else self.settings,
            place,
            Audience(folders=self.store),
            options,
            past,
        )
        for step in islice(run, steps):
            self.seen[step.frame_index] = tuple(sorted(step.mind.objects))
        run.close()

    def runs(self) -> Iterator[Recording]:
        for journal in sorted(self.store.folder.glob("*/journal.sqlite")):
            yield Recording.open(journal.parent)


@pytest.fixture(scope="module")
def camera(tmp_path_factory: pytest.TempPathFactory) -> Camera:
    made = Camera(tmp_path_factory.mktemp("rolled"))
    made.watch(40)
    made.watch(25)
    return made


def test_every_step_is_in_one_run_and_beliefs_continue(camera: Camera) -> None:
    runs = list(camera.runs())
    assert len(runs) >= 3
    frames = [[s["frame_index"] for s in run.summaries()] for run in runs]
    joined = [number for part in frames for number in part]
    assert joined == sorted(set(joined)) == sorted(camera.seen)
    for before, after in pairwise(runs):
        names = before.path.parent.name, after.path.parent.name
        assert before.facts()["ended"] == "rolled"
        assert (after.facts()["continues"], before.facts()["next_run"]) == names
        assert (before.path.parent / "events.jsonl").is_file()
    known: set[int] = set()
    for _, ids_now in sorted(camera.seen.items()):
        # Whoever began from nothing would number objects anew.
        assert all(new > max(known, default=0) for new in set(ids_now) - known)
        known.update(ids_now)
    assert known
    opened = [json.loads(line) for line in camera.told.read_text().splitlines()]
    ids = [o["id"] for o in opened if o["record"] == "alert" and o["state"] == "opened"]
    assert ids
    assert ids == sorted(set(ids))


def test_a_next_run_that_cannot_start_leaves_no_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a disk that is full for a while: the run goes on, and the next try succeeds."""
    camera = Camera(tmp_path)
    refused: list[Path] = []

    def begun(settings: Any, source: Any, folder: Path, *rest: Any, **more: Any) -> Recorder:
        if any(tmp_path.rglob(JOURNAL)) and not refused:
            refused.append(folder)
            (folder / JOURNAL).touch()
            lock_path(folder / JOURNAL).touch()
            raise OutputError("the journal cannot be written (database or disk is full)")
        return Recorder(settings, source, folder, *rest, **more)

    monkeypatch.setattr("visup.runs.runner.Recorder", begun)
    monkeypatch.setattr("visup.runs.unattended.next_run.RETRY_S", 0.0)
    camera.watch(60)
    assert refused
    folders = [f for f in camera.store.folder.iterdir() if f.is_dir()]
    assert len(folders) >= 2
    assert all((f / JOURNAL).stat().st_size for f in folders)
    frames = [s["frame_index"] for run in camera.runs() for s in run.summaries()]
    assert sorted(frames) == sorted(camera.seen)


def test_a_run_that_continues_in_another_is_not_resumed(camera: Camera) -> None:
    first = next(camera.runs()).path.parent
    with pytest.raises(OutputError, match="continues in another"):
        interrupted_run(first)
    assert resumable_run(camera.store.folder, "a") != first


def test_a_next_run_without_steps_can_be_resumed_from_its_state(tmp_path: Path) -> None:
    camera = Camera(tmp_path)
    camera.options = replace(camera.options, run_s=0.1)
    camera.watch(6)
    last = list(camera.runs())[-1]
    past = interrupted_run(last.path.parent)
    assert past.state is not None
    (last.path.parent / "state.bin").unlink()
    with pytest.raises(OutputError, match="neither the first steps"):
        interrupted_run(last.path.parent)
