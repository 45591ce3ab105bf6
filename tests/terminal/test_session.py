from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from tests.agent.scripted import Scripted, alert_while, counting, frames
from tests.stepping.timelines import SETTINGS, STRANGER, suspicious_agent
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import SettingsError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL
from visup.agent.storage.jsonable import to_jsonable
from visup.cli import app
from visup.evaluation.runtime.scripted_observations import moving_ellipses
from visup.runs.wiring import reasoning_agent
from visup.stepping import ScriptedObservations
from visup.terminal.prompt import completions, toolbar
from visup.terminal.session import Session
from visup.terminal.session_commands import COMMANDS, HELP


def session(count: int = 30) -> tuple[Session, io.StringIO]:
    out = io.StringIO()
    reasoners = Reasoners(update=(counting,), cogitate=(alert_while(lambda t: t > 1.0),))
    agent = Agent([Scripted("eye", ("x",))], reasoners)
    return Session(agent, frames(count), Console(file=out, width=80)), out


@pytest.mark.parametrize(
    ("commands", "frame"),
    [
        (["step"], 0),
        (["step", "step 4"], 4),
        (["step 2", "", ""], 5),
        (["run until 0.7"], 7),
        (["run until alert"], 11),
        (["run"], 29),
        (["s 3"], 2),
        (["step 5", "quit", "step 5"], 4),
    ],
)
def test_commands_move_the_agent(commands: list[str], frame: int) -> None:
    it, _ = session()
    assert it.run(commands) == 0
    assert it.agent.mind.frame_index == frame


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("back x", "back [N]"),
        ("back -1", "back [N]"),
        ("back 9999", "there are no 9999 steps to go back\n  expected: at most 5"),
        ("go 99", "there is no step 99\n  expected: at most 30"),
        ("go 99s", "the source ends before 99 s\n  expected: at most 2.90 s"),
        ("go -5", "go PLACE"),
        ("events x", "events [N]"),
        ("relations x", "relations [ID]"),
    ],
)
def test_refused_commands_do_not_move_the_session(command: str, told: str) -> None:
    it, out = session()
    assert it.run(["step 5", command]) == 2
    assert told in out.getvalue()
    assert it.agent.mind.frame_index == 4


def test_every_command_answers_before_and_after_the_first_step() -> None:
    it, out = session()
    looks = [w for w in it.words() if w not in ("until", "quit", "run", "step")]
    it.run([*looks, "step 15", *looks, "relations 1", "candidates 7", "nonsense", "r"])
    said = out.getvalue()
    assert "This is a worry." in said
    assert "'nonsense' is not a command" in said
    assert "which object?" in said
    assert "(run, regions, relations?)" in said


def test_help_names_every_command_and_fits_80_columns() -> None:
    it, _ = session()
    assert all(word in HELP for word in it.words())
    assert all(len(line) <= 80 for line in HELP.splitlines())


def test_the_end_of_the_source_is_printed() -> None:
    it, out = session(3)
    it.run(["run", "step"])
    assert "the source has ended" in out.getvalue()


def reasoning_session(width: int = 80, *, terminal: bool = False) -> tuple[Session, io.StringIO]:
    out = io.StringIO()
    it = Session(
        suspicious_agent(),
        ScriptedObservations(moving_ellipses(60)),
        Console(file=out, width=width, force_terminal=terminal, color_system=None),
    )
    return it, out


SCRIPT = {
    "step 10": "is in view",
    "step until match": "inside the step, after match",
    "mind": "mind at frame",
    "step": "frame 10, ",
    "back 4": "step 7 of 11",
    "go end": "frame 10, ",
    "break rule unexpected_object": "1  rule unexpected_object",
    "break": "(0 hits)",
    "watch gap(1, 2)": "(1, 2) 88 px",
    "run": "stopped: breakpoint 1: unexpected_object(2) is true",
    "why alert 1": "region 2",
    "why not coupled 1 2": "short",
    "mark alert": "step 16 is 'alert'",
    "disable 1": "disabled",
    "step until event verdict": "stopped: verdict:",
    "diff 12 17": "+ alert 1",
    "diff": "from frame 15",
    "percepts": "looks like view",
    "go 0.5s": "step 14 of 17",
    "go alert": "step 16 of 17",
    "assert touching 1 3 true": "branch from step 16",
    "step 5": "watch 1",
    "compare": "verdict: ",
    "leave": "step 16 of 21",
    "use rules nowhere.rules": "the rule file cannot be read",
    "answer 2 arm": "branch from step 16",
    "run until 2.0": "stopped: 2.00 s",
    "events 3": "step 37",
    "run until 1.0": "already passed",
    "directives": "no requests",
    "forget object 2": "branch from step 51",
    "delete 1": "no breakpoints are set",
    "unwatch 1": "no watches are set",
    "go nowhere": "marks: alert",
    "delete 7": "there is no breakpoint 7",
    "assert nonsense": "there is no relation",
    "help break": "set a breakpoint",
    "back 99": "there are no 99 steps to go back",
    "diff 3 99": "there is no step",
    "run until aproach": "did you mean 'approach'",
}


def test_a_whole_session_can_be_scripted() -> None:
    it, out = reasoning_session(terminal=True)
    for command, said in SCRIPT.items():
        begin = out.tell()
        it.run([command])
        assert said in out.getvalue()[begin:], command
    assert all(len(line) <= 80 for line in out.getvalue().splitlines())


def test_help_of_each_command_fits_80_columns() -> None:
    for command in COMMANDS.values():
        assert all(len(line) <= 80 for line in command.text.splitlines())
        assert command.effect


def test_every_command_has_its_help_and_no_other() -> None:
    it, _ = reasoning_session()
    assert [*COMMANDS, "until", "quit"] == it.words()


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        ("st", {"step"}),
        ("ste", {"step"}),
        ("why cap", {"captured"}),
        ("why unex", {"unexpected_object"}),
        ("break rule coll", {"collision_course"}),
        ("step until cog", {"cogitate"}),
        ("run until stage_fail", {"stage_failing", "stage_failed"}),
        ("answer 1 sat", {"satellite"}),
        ("candidates ", {"1", "2", "3"}),
        ("assert touch", {"touching"}),
        ("watch! spee", {"speed"}),
        ("help uns", set()),
        ("go st", {"start"}),
    ],
)
def test_commands_are_completed(line: str, wanted: set[str]) -> None:
    it, _ = reasoning_session()
    it.stepper.step(28)
    found = set(completions(it, line))
    assert wanted <= found
    assert all(w.startswith(line.split(" ")[-1]) for w in found)


def test_the_toolbar_is_one_line() -> None:
    it, _ = reasoning_session()
    it.run(["step 12", "back 3", "branch", "step until match"])
    assert "step 9 of 9  after match  branch from 9" in toolbar(it)
    assert len(toolbar(it)) <= 80


def test_a_recorded_run_is_stepped_from_a_pipe(tmp_path: Path) -> None:
    rules = tmp_path / "strangers.rules"
    rules.write_text(STRANGER)
    settings = replace(SETTINGS, rules=(rules,))
    agent, journal = reasoning_agent(settings), Journal(tmp_path / JOURNAL)
    journal.note(settings=to_jsonable(settings))
    for seen in moving_ellipses(40):
        journal.record(agent.reason(seen))
    journal.close()
    done = CliRunner().invoke(
        app, ["step", str(tmp_path)], input="run until alert\nback 5\nstep 5\nwhy alert 1\n"
    )
    assert done.exit_code == 0, done.output
    assert done.output.count("no active task") >= 3
    refused = CliRunner().invoke(app, ["step", str(tmp_path), "--every", "2"])
    assert isinstance(refused.exception, SettingsError)
    assert "every cannot be changed" in str(refused.exception)
    other = CliRunner().invoke(
        app, ["step", str(tmp_path), "--task", "undock"], input="step 3\ntasks\n"
    )
    assert "undock" in other.output
