"""How a run ends: each ending has words and an exit code of its own."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import cv2
import pytest

from tests.cli import Call
from tests.clips import moving_disc, write_clip
from tests.paths import ROOT
from visup.agent import Frame, Step, Verdict
from visup.runs.result import ExitCode, RunResult
from visup.runs.runner import Audience, supervise
from visup.runs.settings import WatchSettings

BOTTLES = str(ROOT / "examples" / "data" / "bottles.mp4")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Thirty images."""
    made = tmp_path / "images"
    made.mkdir()
    for number, frame in enumerate(moving_disc()[:30]):
        cv2.imwrite(str(made / f"{number:05d}.png"), frame)
    return made


def damaged_picture(folder: Path) -> None:
    data = (folder / "00020.png").read_bytes()
    (folder / "00020.png").write_bytes(data[: len(data) // 2])


def odd_picture(folder: Path) -> None:
    cv2.imwrite(str(folder / "00020.png"), moving_disc()[0][:-7])


@pytest.mark.parametrize("harm", [damaged_picture, odd_picture], ids=lambda f: f.__name__)
def test_a_source_that_breaks_off_is_told_and_has_its_code(
    visup: Call, folder: Path, harm: object
) -> None:
    assert callable(harm)
    harm(folder)
    done = visup("watch", folder, "--no-video")
    assert done.code == ExitCode.SOURCE_BROKE_OFF
    assert "00020.png" in done.out
    last = done.out.splitlines()[-1]
    assert last == (
        "Verdict: nothing unsafe was seen in the 20 frames (0.8 s) before the source broke off "
        "(no task was given)"
    )


def test_a_file_cut_short_is_told_and_has_its_code(visup: Call, clip: Path, tmp_path: Path) -> None:
    short = tmp_path / "short.avi"
    short.write_bytes(clip.read_bytes()[: clip.stat().st_size // 2])
    done = visup("watch", short, "--no-video")
    assert done.code == ExitCode.SOURCE_BROKE_OFF
    assert "before the source broke off" in done.out.splitlines()[-1]


def test_a_task_in_progress_has_its_code(visup: Call, clip: Path, tmp_path: Path) -> None:
    task = tmp_path / "wait.task"
    task.write_text(
        "actor disc is what moves first\n<t> ::= <go> <end>\n"
        "<go> ::= present(disc) for 0.2 s\n<end> ::= gone(disc)\n"
    )
    done = visup("watch", clip, "--task", task, "--no-video")
    assert "in_progress" in done.out, done.out + done.err
    assert done.code == ExitCode.UNFINISHED


@pytest.mark.parametrize(
    ("result", "code"),
    [
        (RunResult(None, 9), 0),
        (RunResult(Verdict.SUCCEEDED, 9), 0),
        (RunResult(Verdict.IN_PROGRESS, 9), 3),
        (RunResult(Verdict.SUCCEEDED, 9, "cut off"), 4),
        (RunResult(Verdict.IN_PROGRESS, 9, "cut off"), 4),
        (RunResult(None, 9, "stopped by the user", stopped=True), 130),
        (RunResult(Verdict.IN_PROGRESS, 9, "stopped by the user", stopped=True), 130),
        (RunResult(Verdict.FAILED, 9, "cut off"), 1),
        (RunResult(Verdict.UNKNOWN, 9), 1),
        (RunResult(Verdict.INTERRUPTED, 9, "stopped by the user", stopped=True), 1),
    ],
)
def test_the_gravest_ending_is_the_exit_code(result: RunResult, code: int) -> None:
    assert result.exit_code == code


def test_every_exit_code_is_documented() -> None:
    page = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    assert all(f"| {int(code)} | " in page for code in ExitCode)


def test_a_reader_that_goes_away_does_not_end_the_run(clip: Path, tmp_path: Path) -> None:
    """As in `visup watch ... --json | head -1`."""
    run = tmp_path / "run"
    words = ["watch", str(clip), "--json", "--no-video", "--out", str(run)]
    process = subprocess.Popen(
        [sys.executable, "-m", "visup.cli", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert process.stdout
    assert process.stderr
    process.stdout.close()  # before the first word
    assert process.wait(timeout=120) == ExitCode.GOOD, process.stderr.read()
    process.stderr.close()
    assert (run / "report.html").is_file()


def hear_ctrl_c() -> None:
    """Tests that run in the background are deaf to it, and so would be what they start."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_stop_signal_ends_a_run_with_its_own_code_and_a_report(
    tmp_path: Path, how: signal.Signals
) -> None:
    run = tmp_path / "run"
    endless = write_clip(tmp_path / "clip.avi", moving_disc() * 50)
    words = ["watch", str(endless), "--no-video", "--json", "--out", str(run)]
    process = subprocess.Popen(
        [sys.executable, "-m", "visup.cli", *words],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=hear_ctrl_c,
    )
    assert process.stdout
    process.stdout.readline()  # the first event: it is under way
    process.send_signal(how)
    last = process.stdout.read().splitlines()[-1]
    assert process.wait(timeout=60) == ExitCode.STOPPED
    process.stdout.close()
    assert '"problem": "stopped by the user"' in last
    assert (run / "report.html").is_file()


def test_a_stop_signal_that_is_swallowed_still_ends_the_run() -> None:
    """As an interrupt inside compiled code is: printed, and dropped."""

    def swallow(step: Step, frame: Frame) -> None:
        if step.frame_index == 3:
            with suppress(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        result = supervise(WatchSettings(BOTTLES), None, audience=Audience((swallow,)))
        assert result.stopped
        assert result.steps == 4
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_run_in_the_background_stays_deaf_to_ctrl_c() -> None:
    """As the shell that started it wants: Ctrl-C is meant for what runs in the foreground."""
    heard = []

    def ask(step: Step, frame: Frame) -> None:
        heard.append(signal.getsignal(signal.SIGINT))
        if step.frame_index == 3:
            signal.raise_signal(signal.SIGTERM)

    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        assert supervise(WatchSettings(BOTTLES), None, audience=Audience((ask,))).stopped
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == [signal.SIG_IGN] * 4
