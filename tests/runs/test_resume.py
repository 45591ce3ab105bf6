"""Runs that go on after a kill, that are replayed, and that survive what happens round them."""

from __future__ import annotations

import itertools
import os
import shutil
import sqlite3
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.clips import moving_disc, write_clip
from tests.paths import ROOT
from tests.percepts.video.test_live_source import FakeCapture
from visup.agent import Frame
from visup.agent.model.errors import OutputError, SourceError
from visup.agent.model.step import Step
from visup.agent.storage.codec import pack_observation
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.evaluation.runtime import resume
from visup.evaluation.runtime.resume import evaluate_resume
from visup.percepts.video.live_source import LiveSource, Reconnection
from visup.runs.checkpoints import CHECKPOINT
from visup.runs.monotonic_clock import MonotonicFrames
from visup.runs.operator import HumanOperator
from visup.runs.replay import recorded_transcript, replay, settings_for, transcript_diff
from visup.runs.result import ExitCode
from visup.runs.resume import interrupted_run
from visup.runs.runner import Audience, fresh_folder, supervise
from visup.runs.settings import RunOptions, WatchSettings
from visup.version import __version__

BARE = RunOptions(video=False, report=False, state_every_s=0.2)


class Pulled(Exception):
    """The plug was pulled."""


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> WatchSettings:
    path = tmp_path_factory.mktemp("clip") / "disc.avi"
    return WatchSettings(source=str(write_clip(path, moving_disc(40), fps=20.0)))


def broken_run(settings: WatchSettings, folder: Path, at: int, options: RunOptions) -> None:
    def pull(step: Step, frame: Frame) -> None:
        if step.frame_index == at:
            raise Pulled

    folder.mkdir()
    with pytest.raises(Pulled):
        supervise(settings, folder, audience=Audience([pull]), options=options)


@pytest.fixture(scope="module")
def unbroken(clip: WatchSettings, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that nothing interrupted; only read."""
    folder = fresh_folder(tmp_path_factory.mktemp("unbroken") / "run", "")
    supervise(clip, folder, options=BARE)
    return folder


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> tuple[WatchSettings, Path]:
    """Settings with models, and an unbroken run in which the operator said who object 1 is."""
    place = tmp_path_factory.mktemp("answered")
    short = write_clip(place / "disc.avi", moving_disc(28), fps=20.0)
    settings = WatchSettings(source=str(short), models=ROOT / "visup" / "data" / "demo.models")
    folder = fresh_folder(place / "run", "")
    told = HumanOperator({1: "spartan"})
    supervise(settings, folder, audience=Audience(operator=told), options=BARE)
    return settings, folder


@pytest.fixture(scope="module")
def broken(clip: WatchSettings, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that was interrupted at frame 27; only copied."""
    folder = tmp_path_factory.mktemp("broken") / "run"
    broken_run(clip, folder, 27, BARE)
    return folder


def copy_of(run: Path, folder: Path) -> Path:
    """A run without what was still being written when it was interrupted."""
    return shutil.copytree(run, folder, ignore=shutil.ignore_patterns("*.part"))


def outcome(folder: Path) -> object:
    run = Recording.open(folder)
    facts = run.facts()
    told = (folder / "events.jsonl").read_bytes(), facts["verdict"], facts["steps"]
    return told, list(run.summaries()), [pack_observation(o) for o in run.observations()]


def test_killed_runs_that_are_resumed_equal_an_unbroken_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(resume, "FRAMES", 32)  # the squares have crossed by then
    figures = evaluate_resume(kills=2, seed=5)
    assert figures["failures"] == []
    assert figures["total"]["equal"] == 2
    assert figures["total"]["lost"] == 0


def test_a_kill_after_the_end_is_evaluated_like_any_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(resume, "FRAMES", 32)
    monkeypatch.setattr(resume, "_kill", lambda child, after_s: os.waitpid(child, 0))
    figures = evaluate_resume(kills=1, seed=5)
    assert figures["failures"] == []
    assert figures["total"]["early"] == 0
    assert figures["total"]["equal"] == 1


@pytest.mark.parametrize("state", ["kept", "none", "damaged"])
def test_a_resumed_run_has_the_same_outcome(
    clip: WatchSettings, unbroken: Path, broken: Path, tmp_path: Path, state: str
) -> None:
    parts = tmp_path / "parts"
    options = BARE if state != "none" else replace(BARE, state_every_s=0.0)
    if state == "none":
        broken_run(clip, parts, 27, options)
    else:
        copy_of(broken, parts)
    if state == "damaged":
        data = bytearray((parts / CHECKPOINT).read_bytes())
        data[len(data) // 2] ^= 1
        (parts / CHECKPOINT).write_bytes(data)
    past = interrupted_run(parts)
    assert (past.state is not None) == (state == "kept")
    result = supervise(past.settings, parts, options=options, past=past)
    assert outcome(parts) == outcome(unbroken)
    assert any("perceived again" in n for n in result.notes) == (state != "kept")
    assert any("it was changed" in n for n in result.notes) == (state == "damaged")
    with pytest.raises(OutputError, match="is complete"):
        interrupted_run(parts)


@pytest.mark.parametrize("part", ["agent", "kept", "behaviours"])
def test_an_incompatible_checkpoint_is_reported_and_all_frames_perceived_again(
    unbroken: Path, broken: Path, tmp_path: Path, part: str
) -> None:
    parts = copy_of(broken, tmp_path / "parts")
    past = interrupted_run(parts)
    assert past.state is not None
    earlier = {
        "agent": replace(past.state, agent={"thoughts": 1}),
        "kept": replace(past.state, recorder={"pages": ()}),
        "behaviours": replace(past.state, agent={**past.state.agent, "behaviours": {"eyes": {}}}),
    }
    past = replace(past, state=earlier[part])
    result = supervise(past.settings, parts, options=BARE, past=past)
    assert outcome(parts) == outcome(unbroken)
    (note,) = (n for n in result.notes if "perceived again" in n)
    assert f"another form than visup {__version__} has" in note


def test_the_report_of_a_resumed_run_covers_the_whole_run(
    clip: WatchSettings, tmp_path: Path
) -> None:
    pytest.importorskip("plotly", reason="the extra visup[report] is not installed")
    options = RunOptions(video=False, state_every_s=0.2)
    broken_run(clip, tmp_path / "run", 30, options)
    past = interrupted_run(tmp_path / "run")
    result = supervise(past.settings, tmp_path / "run", options=options, past=past)
    assert result.report is not None
    assert "40" in result.report.read_text()
    assert result.steps == 40


def test_a_run_is_resumed_only_with_its_own_video(clip: WatchSettings, tmp_path: Path) -> None:
    broken_run(clip, tmp_path / "run", 20, RunOptions(video=False, report=False, state_every_s=0))
    past = interrupted_run(tmp_path / "run")
    other = write_clip(tmp_path / "short.avi", moving_disc(9))
    with pytest.raises(SourceError, match="not what was recorded"):
        supervise(WatchSettings(source=str(other)), tmp_path / "run", options=BARE, past=past)


def test_an_answer_is_replayed(answered: tuple[WatchSettings, Path]) -> None:
    run = Recording.open(answered[1])
    (frame,) = run.answers()
    assert run.answers()[frame] == {1: "spartan"}
    assert not transcript_diff(recorded_transcript(run), replay(run, settings_for(run)))


@pytest.mark.parametrize("at", [12, 14, 15, 16, 17, 25])
def test_answers_of_the_operator_are_remembered_on_resume(
    answered: tuple[WatchSettings, Path], tmp_path: Path, at: int
) -> None:
    """An answer is taken up one step after its object is confirmed, whenever the run is killed."""
    (settings, whole), parts = answered, tmp_path / "parts"

    def pull(step: Step, frame: Frame) -> None:
        if step.frame_index == at:
            raise Pulled

    parts.mkdir()
    told = HumanOperator({1: "spartan"})
    with pytest.raises(Pulled):
        supervise(settings, parts, audience=Audience([pull], operator=told), options=BARE)
    past = interrupted_run(parts)
    supervise(
        past.settings, parts, audience=Audience(operator=HumanOperator()), options=BARE, past=past
    )
    assert outcome(parts) == outcome(whole)


def test_a_folder_without_a_run_cannot_be_resumed(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="no recorded run"):
        interrupted_run(tmp_path)
    Journal(tmp_path / JOURNAL).close()
    with pytest.raises(OutputError, match="nothing was recorded"):
        interrupted_run(tmp_path)


def test_a_replay_has_the_same_events_and_applies_other_rules(
    unbroken: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = Recording.open(unbroken)
    again = replay(run, settings_for(run), fresh_folder(tmp_path / "again", ""))
    assert not transcript_diff(recorded_transcript(run), again)
    events = [(f / "events.jsonl").read_bytes() for f in (unbroken, tmp_path / "again")]
    assert events[0] == events[1] != b""
    rules = tmp_path / "own.rules"
    rules.write_text(
        'rule seen(a): warning\n    when in_view(a) > 0.2 s\n    say "{a} {is} seen."\n'
    )
    warned = transcript_diff(
        recorded_transcript(run), replay(run, settings_for(run, rules=(rules,)))
    )
    assert warned.counts()["alerts"][1] > 0
    assert [e["data"]["alert_kind"] for e in warned.new if e["kind"] == "alert"] == ["seen"]
    strict = tmp_path / "strict.task"
    strict.write_text("<go> ::= <near>\n<near> ::= converging(arm, satellite)\n")
    changed = transcript_diff(
        recorded_transcript(run), replay(run, settings_for(run, tasks=(str(strict),)))
    )
    assert changed.verdicts[0] != changed.verdicts[1]
    bound = replace(settings_for(run), actors={"arm": ("a",), "crane": ("b",)})
    with monkeypatch.context() as patched:
        patched.setattr("visup.runs.replay.recorded_settings", lambda facts, where: bound)
        assert settings_for(run, tasks=(str(strict),)).actors == {"arm": ("a",)}


class Shaky:
    """A journal on a disk that is full for a while."""

    def __init__(self, journal: Journal, bad: range) -> None:
        self._journal, self._bad = journal, bad
        self.asked = 0

    def record(self, step: Step, frame: Frame | None = None) -> None:
        self.asked += 1
        if step.frame_index in self._bad and self.asked < len(self._bad):
            raise OutputError("the journal cannot be written (database or disk is full)")
        self._journal.record(step, frame)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._journal, name)


def test_a_temporarily_full_disk_is_reported_and_nothing_is_lost(
    clip: WatchSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Shaky] = []

    def shaky(*args: Any, **more: Any) -> Shaky:
        made.append(Shaky(Journal(*args, **more), range(8, 11)))
        made[0].asked = -8  # only the attempts at bad steps count
        return made[0]

    monkeypatch.setattr("visup.runs.recorder.Journal", shaky)
    monkeypatch.setattr("visup.runs.recorder.RETRY_STEPS", 4)
    result = supervise(clip, fresh_folder(tmp_path / "run", ""), options=BARE)
    run = Recording.open(tmp_path / "run")
    assert run.count() == result.steps == 40
    told = [e for e in run.events() if e["kind"] == "alert"]
    assert any("not being recorded" in e["text"] for e in told)
    again = replay(run, settings_for(run))
    assert not transcript_diff(recorded_transcript(run), again)


def test_a_disk_that_stays_full_changes_the_exit_code_but_not_the_verdict(
    clip: WatchSettings, tmp_path: Path
) -> None:
    def fill(step: Step, frame: Frame) -> None:
        if step.frame_index == 10:
            db = sqlite3.connect(tmp_path / "run" / JOURNAL)
            db.execute("DROP TABLE events")  # as good as a disk that fills up
            db.commit()
            db.close()

    result = supervise(
        clip, fresh_folder(tmp_path / "run", ""), audience=Audience([fill]), options=BARE
    )
    assert result.steps == 40
    assert (result.verdict, result.exit_code) == (None, ExitCode.NOT_RECORDED)
    assert any("could not be recorded" in n for n in result.notes)
    assert any("no such table" in n for n in result.notes)


def test_a_camera_that_dropped_is_reconnected() -> None:
    images = moving_disc(6)
    later = [FakeCapture([]), FakeCapture(images[3:])]
    said: list[str] = []
    waited: list[float] = []
    clock = itertools.count(100.0, 0.25)
    source = LiveSource(
        "camera 0",
        FakeCapture(images[:3]),
        clock=lambda: next(clock),
        reconnection=Reconnection(
            lambda: later.pop(0) if later else FakeCapture([]), 3.0, waited.append
        ),
    )
    source.notify = said.append
    frames: list[Frame] = []
    troubles = []
    for frame in source:
        frames.append(frame)
        troubles.append([c.kind for c in source.runtime_faults()])
    assert [f.index for f in frames] == list(range(6))
    assert all(a.time < b.time for a, b in itertools.pairwise(frames))
    assert troubles == [[], [], [], ["source_dropped"], [], []]
    assert said[0] == "camera 0 delivers no frames; trying again."
    assert waited[:2] == [0.5, 1.0]
    assert source.problem is not None
    assert "stopped delivering" in source.problem


def test_a_resumed_camera_run_continues_numbers_and_times(
    clip: WatchSettings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    images = moving_disc(40)
    stateless = RunOptions(video=False, report=False, state_every_s=0.0)

    def camera(settings: WatchSettings, span: object) -> LiveSource:
        clock = itertools.count(0.0, 0.05)
        return LiveSource("camera 0", FakeCapture(images, fps=20.0), clock=lambda: next(clock))

    monkeypatch.setattr("visup.runs.runner.open_video", camera)
    # This camera delivers all its frames at once; each is to be seen.
    broken_run(WatchSettings("0", realtime=False), tmp_path / "run", 27, stateless)
    before = {s["frame_index"]: s for s in Recording.open(tmp_path / "run").summaries()}
    past = interrupted_run(tmp_path / "run")
    result = supervise(past.settings, tmp_path / "run", options=stateless, past=past)
    run = Recording.open(tmp_path / "run")
    steps = list(run.summaries())
    assert [s["frame_index"] for s in steps] == list(range(28 + 40))
    assert all(a["time"] < b["time"] for a, b in itertools.pairwise(steps))
    assert steps[:28] == [before[i] for i in range(28)]
    seen = [[r.id for r in o.of("region")] for o in run.observations()]
    before_ids, after_ids = ({i for ids in part for i in ids} for part in (seen[:28], seen[28:]))
    # What is seen anew by a segmenter without a state is never called as something else was.
    assert before_ids
    assert after_ids
    assert min(after_ids) > max(before_ids)
    assert any("Nothing was seen in between" in n for n in result.notes)


def times(*given: float) -> Iterator[Frame]:
    return (Frame(i, t, np.zeros((2, 2, 3), np.uint8)) for i, t in enumerate(given))


@pytest.mark.parametrize(
    ("given", "expected", "jumps"),
    [
        ((0.0, 0.1, 0.2), (0.0, 0.1, 0.2), 0),
        ((0.0, 0.1, -50.0, -49.9), (0.0, 0.1, 0.2, 0.3), 1),
        ((0.0, 0.1, 0.1, 0.2), (0.0, 0.1, 0.2, 0.3), 1),
        ((0.0, float("nan"), 0.2), (0.0, 0.1, 0.2), 1),
        ((5.0, 1e6, 1e6 + 0.1), (5.0, 1e6, 1e6 + 0.1), 0),
    ],
)
def test_time_is_monotonic(
    given: tuple[float, ...], expected: tuple[float, ...], jumps: int
) -> None:
    steady = MonotonicFrames(times(*given), fps=10.0)
    told: list[float] = []
    kinds: list[str] = []
    for frame in steady:
        told.append(frame.time)
        kinds += [c.kind for c in steady.runtime_faults()]
    assert told == pytest.approx(expected)
    assert kinds == ["clock_jumped"] * jumps
