"""visup's own troubles are told as what they are, alike by a run, its replay and its resumption."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

import visup
from tests.clips import moving_disc, write_clip
from visup.agent import Frame, Verdict
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.runs.replay import replay, settings_for
from visup.runs.result import ExitCode, RunResult
from visup.runs.resume import interrupted_run
from visup.runs.runner import Audience, fresh_folder, supervise
from visup.runs.settings import RunOptions, WatchSettings
from visup.terminal.narrator import verdict_line

RULE = 'rule seen(a): {}\n    when in_view(a) > 0.2 s\n    say "{{a}} {{is}} seen."\n'
DULL = """
from visup.agent import Contract

class Dull:
    contract = Contract("dull", gives=("dull",))

    def perceive(self, frame, seen, directives):
        raise ValueError("no")
"""
CASES = {
    "nothing": (None, ExitCode.GOOD),
    "an alert is lost": (None, ExitCode.NOT_RECORDED),
    "a behaviour fails": (Verdict.UNKNOWN, ExitCode.BAD),
    "something grave": (Verdict.INTERRUPTED, ExitCode.BAD),
}


def begun(folder: Path, case: str) -> tuple[WatchSettings, RunOptions]:
    """What is watched in a case, and how it is recorded."""
    clip = write_clip(folder / "clip.avi", moving_disc(24), fps=10.0)
    rules, dull = folder / "own.rules", folder / "dull.py"
    rules.write_text(RULE.format("warning" if case == "something grave" else "info"))
    dull.write_text(DULL)
    own = (dull,) if case == "a behaviour fails" else ()
    sinks = ("file:/dev/full",) if case == "an alert is lost" else ()
    options = RunOptions(video=False, report=False, sinks=sinks)
    return WatchSettings(str(clip), rules=(rules,), behaviours=own), options


def wait_for_sinks(step: Step, frame: Frame) -> None:
    """Sinks have threads of their own: what they say of themselves is to be told in this run."""
    if step.frame_index == 12:
        time.sleep(0.2)


def killed(step: Step, frame: Frame) -> None:
    if step.frame_index == 16:
        raise InterruptedError


@pytest.mark.parametrize("case", CASES)
def test_system_alerts_do_not_affect_the_verdict(tmp_path: Path, case: str) -> None:
    if case == "an alert is lost" and not Path("/dev/full").exists():
        pytest.skip("no disk that is always full")
    settings, options = begun(tmp_path, case)
    verdict, code = CASES[case]
    run = fresh_folder(tmp_path / "run", "")
    watching = [wait_for_sinks] if options.sinks else []
    result = supervise(settings, run, audience=Audience(watching), options=options)
    assert (result.verdict, result.exit_code) == (verdict, code)
    assert any("could be delivered" in n for n in result.notes) == (not result.delivered)
    again = replay(Recording.open(run), settings_for(Recording.open(run)))
    assert (again.verdict, visup.open_run(run).verdict) == (verdict and verdict.value, verdict)
    kinds = {a.kind for a in visup.open_run(run).alerts}
    assert ("sink_failed" in kinds) == (case == "an alert is lost")

    folder = fresh_folder(tmp_path / "killed", "")
    with pytest.raises(InterruptedError):
        supervise(settings, folder, audience=Audience([*watching, killed]), options=options)
    past = interrupted_run(folder, settings.behaviours)
    assert past.verdict is verdict
    resumed = supervise(
        past.settings, folder, options=RunOptions(video=False, report=False), past=past
    )
    assert resumed.verdict is verdict


def test_a_run_from_python_has_the_same_result(tmp_path: Path) -> None:
    settings, _ = begun(tmp_path, "a behaviour fails")
    with visup.watch(settings.source, behaviours=settings.behaviours) as run:
        next(iter(run))
        assert run.verdict is Verdict.UNKNOWN
        assert "but the scene could not always be watched" in run._repr_html_()


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        (None, "nothing unsafe was seen"),
        (Verdict.UNKNOWN, "nothing unsafe was seen, but the scene could not always be watched"),
        (Verdict.INTERRUPTED, "something unsafe was seen"),
    ],
)
def test_the_last_line_names_the_run_folder(verdict: Verdict | None, words: str) -> None:
    from rich.text import Text

    line = Text.from_markup(verdict_line(verdict, has_task=False)).plain
    assert line == f"Verdict: {words} (no task was given)"
    assert RunResult(verdict, 1, has_task=False).exit_code == (ExitCode.BAD if verdict else 0)
