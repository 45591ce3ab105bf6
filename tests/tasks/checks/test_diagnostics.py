from __future__ import annotations

import time
from contextlib import chdir
from functools import cache
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.reasoning.task_files import fuzz, long_files, seconds
from tests.paths import ROOT
from visup.agent.model.did_you_mean import closest
from visup.agent.model.errors import ErrorGroup, SourceLocation, TaskError
from visup.rules.language.diagnostics import Diagnostic
from visup.tasks import load_task, parse_task, shipped_tasks
from visup.tasks.actions.actions import ActionDefinition
from visup.tasks.checks.bounds import MAX_FAULTS
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.checks.load import read_text
from visup.tasks.diagnostics.codes import CODES
from visup.tasks.grammar.structure import stage_names, task_actors

HERE = ROOT / "tests/tasks"
GOOD = sorted((HERE / "good").glob("*.task"))
BAD = sorted((HERE / "bad").glob("*.task"))


def text_of(path: Path) -> str:
    return path.read_bytes().decode("utf-8")


@cache  # several tests tell of the same files
def faults_of(path: Path) -> tuple[Diagnostic, ...]:
    with chdir(path.parent):  # where they look for what they include
        return tuple(diagnose(text_of(path), path.name)[1])


def expected_of(text: str, word: str) -> list[str]:
    line = next(x for x in text.splitlines() if x.startswith(f"# {word}:"))
    return line.split(":", 1)[1].split()


@pytest.mark.parametrize("path", GOOD, ids=lambda p: p.stem)
def test_good_files_have_the_stages_and_actors_in_their_comments(path: Path) -> None:
    text = text_of(path)
    task = parse_task(text, path.name)
    assert list(stage_names(task)) == expected_of(text, "stages")
    assert sorted(task_actors(task)) == sorted(expected_of(text, "actors"))
    assert parse_task(str(task)) == task


@pytest.mark.parametrize("path", BAD, ids=lambda p: p.stem)
def test_bad_files_give_the_expected_messages(path: Path) -> None:
    assert "".join(f"{f}\n" for f in faults_of(path)) == path.with_suffix(".txt").read_text("utf-8")


def test_bad_files_with_one_mistake_give_one_message() -> None:
    several = {"three_mistakes": 3, "everything": 6, "typographic": 2}
    for path in BAD:
        assert len(faults_of(path)) == several.get(path.stem, 1), path.stem


def test_every_error_code_has_a_bad_file() -> None:
    shown = {f.code for p in BAD for f in faults_of(p)}
    assert shown | {"E231"} == set(CODES)


def test_an_action_whose_percepts_nothing_provides_is_reported() -> None:
    text = "<dock> ::= depth_difference(arm, satellite) < 10 % coupled(arm, satellite)"
    assert diagnose(text)[1] == []
    _, faults = diagnose(text, percepts=frozenset({"region", "health"}))
    assert [f.code for f in faults] == ["E231"]
    assert "`depth` and `hypothesis`" in faults[0].message
    mine = {
        "gripped": ActionDefinition("gripped", ("gripped",), arity=1, needs=frozenset({"gripper"}))
    }
    _, faults = diagnose("<t> ::= gripped(part)", actions=mine)
    assert [f.code for f in faults] == ["E231"]


def test_three_mistakes_are_raised_together() -> None:
    with pytest.raises(ErrorGroup) as caught:
        load_task(HERE / "bad" / "three_mistakes.task")
    codes = [e.code for e in caught.value.errors]
    assert codes == ["E102", "E201", "E117"]
    for error in caught.value.errors:
        assert isinstance(error.where, SourceLocation)
        assert error.where.caret() in str(caught.value)


@pytest.mark.parametrize("name", shipped_tasks())
def test_shipped_tasks_are_free_of_mistakes_and_named_as_their_file(name: str) -> None:
    task = load_task(name)
    assert task.name == name
    assert read_text(name).startswith(f"# {name}.task: ")


def test_there_are_at_least_five_shipped_tasks() -> None:
    assert len(shipped_tasks()) >= 5
    assert "dock" in shipped_tasks()


def test_a_missing_task_is_reported_with_the_existing_ones(tmp_path: Path) -> None:
    with pytest.raises(TaskError, match=r"no such task file[\s\S]*dock[\s\S]*did you mean"):
        load_task("docks")
    with pytest.raises(TaskError, match="cannot be read"):
        load_task(tmp_path)
    (tmp_path / "x.task").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TaskError, match="not UTF-8"):
        load_task(tmp_path / "x.task")


def test_a_faulty_rule_hides_neither_other_faults_nor_its_definition() -> None:
    text = (
        "<dock> ::= <a> <b> <c>\n"
        "<a> ::= converging(arm satellite)\n"
        "<b> ::= cupled(arm, satellite)\n"
        "<c> ::= coupled(arm)\n"
    )
    _, faults = diagnose(text)
    assert [(f.code, f.place.line) for f in faults] == [("E117", 2), ("E201", 3), ("E205", 4)]


def test_the_closest_word_is_suggested_regardless_of_case() -> None:
    assert closest("Convergin", ["converging", "diverging"]) == "converging"
    assert closest("zzz", ["converging"]) is None


def test_any_file_is_parsed_or_reported_with_positions() -> None:
    found = fuzz(150, seed=7)
    assert (found.raised, found.placeless, found.unstable, found.slow) == ([], [], [], [])
    assert found.good > 0
    assert len(found.codes) > 30


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60))
def test_any_text_is_parsed_or_reported(text: str) -> None:
    _, faults = diagnose(text)
    assert all(isinstance(f, Diagnostic) for f in faults)


@pytest.mark.parametrize(("name", "text"), list(long_files(2000)))
def test_long_files_are_parsed_quickly(name: str, text: str) -> None:
    start = time.process_time()
    _, faults = diagnose(text)
    assert time.process_time() - start < 2.5  # the bar for 10,000
    assert len(faults) == {"mistaken": MAX_FAULTS, "chain": 1}.get(name, 0)  # too deep a chain


def test_a_typical_file_is_parsed_immediately() -> None:
    assert seconds(read_text("inspect"), 20) < 0.05  # the bar is 10 ms


def test_exponentially_nested_stages_are_checked_quickly() -> None:
    doubled = [f"<s{i}> ::= (<s{i + 1}> | gone(x)) <s{i + 1}>" for i in range(60)]
    start = time.process_time()
    assert diagnose("\n".join([*doubled, "<s60> ::= seen(a)"]))[1] == []
    assert time.process_time() - start < 1.0


def test_the_grammar_is_read_from_its_file() -> None:
    grammar = files("visup.tasks.grammar").joinpath("tasks.lark").read_text("utf-8")
    assert '"within"' in grammar
