"""Frames as time brings them: the newest that is due, and an honest word on the others."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.percepts.video.clips import write_video
from visup.agent import Frame, Severity
from visup.percepts.video import Ending, VideoSource, open_source
from visup.percepts.video import realtime as module
from visup.percepts.video.realtime import LatestFrames, PacedRecording, in_real_time
from visup.runs.runner import supervise
from visup.runs.settings import RunOptions, WatchSettings

IMAGE = np.zeros((4, 4, 3), np.uint8)


class Clock:
    """Stands still but when somebody waits or works."""

    def __init__(self) -> None:
        self.now = 50.0

    def __call__(self) -> float:
        return self.now

    def pass_by(self, seconds: float) -> None:
        self.now += seconds


def frames(times: list[float]) -> Iterator[Frame]:
    return (Frame(k, t, IMAGE) for k, t in enumerate(times))


def watched(
    times: list[float], costs: list[float]
) -> tuple[list[tuple[int, float]], PacedRecording]:
    """Numbers of the frames that were given and when, by a watcher who needs that long for each."""
    clock, given = Clock(), []
    played = PacedRecording(frames(times), "clip", clock=clock, wait=clock.pass_by)
    for k, frame in enumerate(played):
        given.append((frame.index, clock.now - 50.0 + times[0]))
        clock.pass_by(costs[k % len(costs)])
    return given, played


def expected(times: list[float], costs: list[float]) -> list[tuple[int, float]]:
    """The same by the letter: at each look the newest frame that is due, else the next one."""
    now, last, found = times[0], -1, []
    while last + 1 < len(times):
        due = [k for k in range(last + 1, len(times)) if times[k] <= now]
        last = max(due, default=last + 1)
        now = max(now, times[last])
        found.append((last, now))
        now += costs[(len(found) - 1) % len(costs)]
    return found


grown = st.lists(st.integers(1, 8), min_size=1, max_size=30)
costs = st.lists(st.integers(0, 40), min_size=1, max_size=5)


@given(grown, costs)
def test_the_newest_frame_that_is_due_is_given(steps: list[int], work: list[int]) -> None:
    times = [float(t) for t in np.cumsum(steps)]
    seen, played = watched(times, [float(c) for c in work])
    assert seen == expected(times, [float(c) for c in work])
    assert played.given + played.dropped == len(times)


def test_whoever_is_quick_misses_nothing_and_nothing_is_told() -> None:
    seen, played = watched([k / 25 for k in range(50)], [0.01])
    assert [k for k, _ in seen] == list(range(50))
    assert list(played.runtime_faults()) == []
    assert played.note() is None


@pytest.mark.parametrize(("cost", "severity"), [(0.1, Severity.INFO), (1.2, Severity.WARNING)])
def test_that_frames_are_dropped_is_told(cost: float, severity: Severity) -> None:
    _, played = watched([k / 25 for k in range(200)], [cost])
    (said,) = played.runtime_faults()
    assert (said.kind, said.severity) == ("frames_dropped", severity)
    assert "of the last" in said.cause
    assert played.note() == (
        f"To keep pace with the clock, {played.dropped} of 200 frames were dropped."
    )


def test_what_was_dropped_long_ago_is_told_no_more() -> None:
    times = [k / 25 for k in range(400)]
    _, played = watched(times, [0.1] * 50 + [0.0] * 400)
    assert played.dropped > 50
    assert list(played.runtime_faults()) == []


def test_one_gap_longer_than_what_is_remembered_is_told_with_its_length() -> None:
    played = PacedRecording(frames([k / 25 for k in range(400)]), "clip", clock=(clock := Clock()))
    next(played)
    clock.pass_by(8.0)
    next(played)
    (said,) = played.runtime_faults()
    assert said.severity == Severity.WARNING
    assert "for up to 8.0 s nobody looked" in said.cause


def test_a_share_near_the_limit_is_one_alert_and_not_many() -> None:
    clock, told = Clock(), []
    times = [k / 25 for k in range(1000)]
    played = PacedRecording(frames(times), "clip", clock=clock, wait=clock.pass_by)
    # About one frame in ten is dropped, now somewhat more, now somewhat less.
    for k in range(800):
        next(played)
        told.append(bool(list(played.runtime_faults())))
        clock.pass_by(0.085 if k % (8 if k // 100 % 2 else 12) == 0 else 0.0)
    assert sum(b and not a for a, b in pairwise(told)) == 1


class Steps(VideoSource):
    """A live source that delivers a frame each time that it is let."""

    live = True

    def __init__(self, count: int, fault: Exception | None = None) -> None:
        super().__init__("camera", fps=25.0, size=(4, 4), frame_count=None)
        self.count, self.fault, self.at = count, fault, 0
        self.let = threading.Semaphore(0)
        self.released = False

    def _next(self) -> Frame | None:
        self.let.acquire()
        if self.at == self.count:
            if self.fault:
                raise self.fault
            return None
        self.at += 1
        return Frame(self.at - 1, self.at / 25, IMAGE)

    def _release(self) -> None:
        self.released = True


def test_of_a_live_source_the_newest_frame_waits_to_be_taken() -> None:
    source = Steps(7)
    pace = in_real_time(source, source)
    assert isinstance(pace, LatestFrames)
    for _ in range(5):
        source.let.release()
    while source.at < 5 or pace._slot is None or pace._slot.index < 4:
        pass
    assert next(pace).index == 4
    assert pace.dropped == 4
    source.let.release()
    assert next(pace).index == 5
    source.let.release(3)
    assert [f.index for f in pace] == [6]
    pace.close()
    assert source.ended is Ending.COMPLETE


def test_a_fault_of_the_source_is_raised_where_frames_are_asked_for() -> None:
    source = Steps(0, ValueError("broken"))
    pace = LatestFrames(source, source)
    source.let.release()
    with pytest.raises(ValueError, match="broken"):
        next(pace)


def test_a_source_in_which_the_reader_is_stuck_is_left_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "PATIENCE_S", 0.05)
    source = Steps(1)
    LatestFrames(source, source).close()
    source.close()
    assert source.ended is Ending.STOPPED
    assert not source.released
    source.let.release(2)


SLOW = """
import time
from visup.agent import Contract
class Slow:
    contract = Contract("slow", gives=("slow",))
    def perceive(self, frame, observation, directives):
        time.sleep(0.2)
        return []
"""


def test_a_run_keeps_pace_and_says_what_it_dropped(tmp_path: Path) -> None:
    clip = write_video(tmp_path / "clip.avi", count=60, fps=30.0)
    slow = tmp_path / "slow.py"
    slow.write_text(SLOW)
    settings = WatchSettings(str(clip), behaviours=(slow,), realtime=True)
    folder = tmp_path / "run"
    folder.mkdir()
    result = supervise(settings, folder, options=RunOptions(video=False, report=False))
    assert result.steps < 40
    dropped = 60 - result.steps
    assert f"To keep pace with the clock, {dropped} of 60 frames were dropped." in result.notes
    assert '"frames_dropped"' in (folder / "events.jsonl").read_text()


def test_a_recording_is_watched_whole_unless_asked(tmp_path: Path) -> None:
    clip = write_video(tmp_path / "clip.avi", count=8)
    with open_source(str(clip)) as source:
        assert not source.live
    assert supervise(WatchSettings(str(clip)), None).steps == 8


@given(costs)
def test_lag_is_how_long_ago_a_frame_was(work: list[int]) -> None:
    clock = Clock()
    paced = PacedRecording(
        frames([k / 10 for k in range(400)]), "clip", clock=clock, wait=clock.pass_by
    )
    assert paced.lag(0.0) == 0.0
    for cost in work:
        frame = next(paced)
        clock.pass_by(cost / 10)
        assert paced.lag(frame.time) == pytest.approx(clock.now - 50.0 - frame.time)
