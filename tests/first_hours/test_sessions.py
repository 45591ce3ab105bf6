"""`visup step` from a pipe: what cannot be meant is refused, with what was probably meant, and a code."""

from __future__ import annotations

import io
import sys
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.cli import Call
from tests.percepts.video.test_realtime import Steps
from visup.commands.step import _live
from visup.runs.demo import demo_settings
from visup.runs.settings import WatchSettings

TASK = ("--task", "dock", "--models", demo_settings().models, "--actor", "satellite=spartan")


def piped(monkeypatch: pytest.MonkeyPatch, *commands: str) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("".join(f"{c}\n" for c in commands)))


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("break foobar", "'foobar' is not known"),
        ("break entri", "did you mean 'entry'?"),
        ("step until capturd", "did you mean 'captured'?"),
        ("rnu", "did you mean 'run'?"),
        ("back 9999", "there are no 9999 steps to go back\n  expected: at most 0"),
        ("break rule collision", "did you mean 'collision_course'?"),
    ],
)
def test_a_slip_is_refused_before_the_first_step_too(
    visup: Call, clip: Path, monkeypatch: pytest.MonkeyPatch, command: str, told: str
) -> None:
    piped(monkeypatch, command)
    done = visup("step", clip, *TASK)
    assert told in done.out
    assert done.code == 2


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("?", "step"),
        ("? break", "WHAT is one of"),
        ("break captured", "stage captured"),
        ("break event my_own", "event my_own"),
        ("break collision_course", "rule collision_course"),
    ],
)
def test_what_is_meant_is_understood_before_the_first_step(
    visup: Call, clip: Path, monkeypatch: pytest.MonkeyPatch, command: str, told: str
) -> None:
    piped(monkeypatch, command)
    done = visup("step", clip, *TASK)
    assert told in done.out
    assert done.code == 0


def test_what_is_read_from_a_pipe_is_whole(
    visup: Call, clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    piped(monkeypatch, "step 30", "why object 1", "percepts", "tasks")
    done = visup("step", clip, *TASK)
    reasons = [line for line in done.out.splitlines() if "motion reported" in line]
    assert reasons
    assert all(line.rstrip().endswith(" s]") and len(line) > 80 for line in reasons), reasons
    assert "motion ran, 1 percept\n" in done.out


def test_a_step_of_a_camera_is_of_what_it_sees_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """While one looks at a step the camera goes on; what nobody saw is not stepped through."""
    camera = Steps(9)
    monkeypatch.setattr("visup.runs.wiring.open_video", lambda settings: camera)
    with ExitStack() as stack:
        _, frames = _live(WatchSettings("0"), stack)
        camera.let.release()
        assert next(iter(frames)).index == 0
        camera.let.release(6)
        while camera.at < 7:
            time.sleep(0.01)
        time.sleep(0.05)
        assert next(iter(frames)).index >= 5
        camera.let.release(9)
