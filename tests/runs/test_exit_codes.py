"""What a run says to whoever started it: nothing that went wrong ends with 0."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.clips import moving_disc, write_clip
from visup.agent import Verdict
from visup.agent.model.errors import OutputError
from visup.agent.storage.journal import Journal
from visup.runs.result import ExitCode, RunResult
from visup.runs.runner import fresh_folder, supervise
from visup.runs.settings import RunOptions, WatchSettings

WELL = RunResult(Verdict.SUCCEEDED, 10)
WRONG = {
    "verdict": Verdict.FAILED,
    "problem": "it is cut off",
    "recorded": False,
    "delivered": False,
    "stopped": True,
}


@pytest.mark.parametrize(
    ("what", "code"),
    [
        (("verdict", "problem", "recorded", "stopped"), ExitCode.BAD),
        (("problem", "recorded"), ExitCode.SOURCE_BROKE_OFF),
        (("recorded", "stopped"), ExitCode.NOT_RECORDED),
        (("recorded",), ExitCode.NOT_RECORDED),
        (("delivered", "stopped"), ExitCode.NOT_RECORDED),
        (("problem", "stopped"), ExitCode.STOPPED),
        ((), ExitCode.GOOD),
    ],
)
def test_the_exit_code_is_that_of_the_most_severe_problem(
    what: tuple[str, ...], code: ExitCode
) -> None:
    assert replace(WELL, **{name: WRONG[name] for name in what}).exit_code is code  # type: ignore[arg-type]


def test_a_truncated_source_does_not_exit_with_0(tmp_path: Path) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(30), fps=10.0)
    data = clip.read_bytes()
    clip.write_bytes(data[: len(data) // 2])
    result = supervise(WatchSettings(str(clip)), None)
    assert 0 < result.steps < 30
    assert result.exit_code is ExitCode.SOURCE_BROKE_OFF


@pytest.mark.parametrize("fault", [OutputError("no space left"), RuntimeError("no fonts")])
def test_a_run_without_its_report_does_not_exit_with_0(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(4), fps=10.0)

    def fails(*_: object) -> None:
        raise fault

    monkeypatch.setattr("visup.report.page.html.write_report", fails)
    options = RunOptions(video=False)
    result = supervise(
        WatchSettings(str(clip)), fresh_folder(tmp_path / "run", ""), options=options
    )
    assert result.report is None
    assert result.exit_code is ExitCode.NOT_RECORDED
    assert any(str(fault) in note for note in result.notes)


def test_an_unrecorded_run_does_not_exit_with_0(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = write_clip(tmp_path / "clip.avi", moving_disc(4), fps=10.0)

    def full(*_: object) -> None:
        raise OutputError("database or disk is full")

    monkeypatch.setattr(Journal, "record", full)
    options = RunOptions(video=False, report=False)
    result = supervise(
        WatchSettings(str(clip)), fresh_folder(tmp_path / "run", ""), options=options
    )
    assert result.exit_code is not ExitCode.GOOD
    assert any("could not be recorded" in note for note in result.notes)
