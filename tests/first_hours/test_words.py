"""Small things that a newcomer stumbles over: what is typed wrongly, what is shown raw."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.cli import Call
from tests.first_hours.test_sessions import piped
from visup import watch
from visup.agent.cycle.answers import resolve_model
from visup.agent.model.errors import BehaviourError, OutputError, SettingsError
from visup.agent.model.mind import Mind
from visup.agent.plugins.registry import discover_behaviours
from visup.agent.storage.journal_reader import _unreadable
from visup.runs.settings import complete_task
from visup.terminal.display import html_of
from visup.terminal.narrator import event_line
from visup.terminal.tables import table


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--every", "abc"], "'abc' is not a whole number"),
        (["--every", "1.5"], "'1.5' is not a whole number"),
        (["--fps", "fast"], "'fast' is not a number"),
        (["--keep-gb", "-1"], "-1 is too small; expected a number, 0 or more"),
        (["--keep-gb", "nan"], "nan is too small"),
    ],
)
def test_numbers_that_are_none_are_refused_in_words(
    visup: Call, clip: Path, words: list[str], told: str
) -> None:
    done = visup("watch", clip, *words)
    assert done.code == 2
    assert told in " ".join(done.err.split())
    assert "Input should be" not in done.err


def test_names_are_suggested_as_they_are_written() -> None:
    with pytest.raises(SettingsError) as refused:
        resolve_model(Mind(), "rms ram", ["rms_arm", "spartan"])
    assert "did you mean 'rms_arm'?" in str(refused.value)
    assert "one of: rms_arm, spartan, unknown" in str(refused.value)


def test_a_run_or_behaviour_of_nearly_that_name_is_suggested(visup: Call, tmp_path: Path) -> None:
    (tmp_path / "runs" / "road").mkdir(parents=True)
    (tmp_path / "runs" / "road" / "journal.sqlite").touch()
    (tmp_path / "runs" / "rod2.mp4").touch()  # near, and no run
    for words in (("export", "runs/rod", "mot"), ("replay", "runs/rod")):
        assert "did you mean runs/road?" in " ".join(visup(*words).err.split())
    assert "did you mean" not in visup("replay", "runs/bottles").err
    assert "did you mean" not in visup("replay", "nowhere/road").err
    with pytest.raises(BehaviourError) as refused:
        discover_behaviours().where("peple")
    assert refused.value.hint == "did you mean 'people'?"


def test_what_is_perceived_is_told_in_words(
    visup: Call, clip: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    piped(monkeypatch, "step 3", "percepts")
    done = visup("step", clip)
    assert "camera ok" in done.out
    assert "Health(" not in done.out


def test_rules_are_explained_of_recorded_runs_too(visup: Call, clip: Path, tmp_path: Path) -> None:
    assert visup("watch", clip, "--out", tmp_path / "run", "--no-video", "--quiet").code == 0
    live = visup("rules", "explain", clip, "--at", 1.2, "--rule", "stale_perception")
    told = visup("rules", "explain", tmp_path / "run", "--at", 1.2, "--rule", "stale_perception")
    assert told.code == 0
    assert told.out == live.out
    assert "stale_perception" in told.out


def test_a_journal_that_may_not_be_read_is_not_called_damaged(tmp_path: Path) -> None:
    missing = _unreadable(tmp_path / "journal.sqlite", ValueError("x"))
    assert isinstance(missing, OutputError)
    assert "damaged" not in str(missing)
    assert "No such file" in str(missing)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read anything")
def test_permission_is_told_as_such(visup: Call, clip: Path, tmp_path: Path) -> None:
    assert visup("watch", clip, "--out", tmp_path / "run", "--no-video", "--quiet").code == 0
    (tmp_path / "run" / "journal.sqlite").chmod(0)
    done = visup("replay", tmp_path / "run")
    assert done.code == 2
    assert "Permission denied" in done.err


def test_notebooks_show_no_frames_made_of_characters() -> None:
    shown = table("relation", "objects", title="what holds")
    shown.add_row("touching", "1 2")
    made = html_of(shown)
    assert "touching" in made
    assert not set("┏┓┗┛┡┩┳┻╇━│┃└┘┴┬") & set(made)


def test_shells_complete_task_names_and_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dot.task").touch()
    assert complete_task("do") == ["dock", "dock_with_retry", "dot.task"]
    assert complete_task("nothing") == []


def test_a_program_is_told_what_the_terminal_is_and_nothing_twice(
    visup: Call, clip: Path, tmp_path: Path
) -> None:
    task = tmp_path / "never.task"
    task.write_text("actor disc is what moves first\n<t> ::= moving(disc)\nnever present(disc)\n")
    run = watch(clip, task=task)
    lines = [event_line(event) for event in run.narrate()]
    assert any("Task 't' has succeeded, but 'never present(disc)' has not held" in x for x in lines)
    assert len({line[10:] for line in lines}) == len(lines) < len(run.events)
    done = visup("watch", clip, "--task", task, "--no-video")
    assert done.out.splitlines()[: len(lines)] == lines
