from __future__ import annotations

import random
import time
from importlib.resources import files
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.agent.errors import ManyErrors, Place, TaskError
from visup.tasks import load_task, parse_task, shipped_tasks
from visup.tasks.actions import Meaning
from visup.tasks.diagnostics import examine
from visup.tasks.faults import CODES, TaskFault, closest
from visup.tasks.load import read_text
from visup.tasks.structure import stage_names, task_actors

HERE = Path(__file__).parent
GOOD = sorted((HERE / "good").glob("*.task"))
BAD = sorted((HERE / "bad").glob("*.task"))


def text_of(path: Path) -> str:
    return path.read_bytes().decode("utf-8")


def expected_of(text: str, word: str) -> list[str]:
    line = next(x for x in text.splitlines() if x.startswith(f"# {word}:"))
    return line.split(":", 1)[1].split()


@pytest.mark.parametrize("path", GOOD, ids=lambda p: p.stem)
def test_good_files_have_the_stages_and_actors_that_they_say(path: Path) -> None:
    text = text_of(path)
    task = parse_task(text, path.name)
    assert list(stage_names(task)) == expected_of(text, "stages")
    assert sorted(task_actors(task)) == sorted(expected_of(text, "actors"))
    assert parse_task(str(task)) == task


@pytest.mark.parametrize("path", BAD, ids=lambda p: p.stem)
def test_bad_files_are_told_as_written_beside_them(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(path.parent)  # where they look for what they include
    _, faults = examine(text_of(path), path.name)
    assert "".join(f"{f}\n" for f in faults) == path.with_suffix(".txt").read_text("utf-8")


def test_bad_files_with_one_mistake_give_one_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(HERE / "bad")
    several = {"three_mistakes": 3, "everything": 6, "typographic": 2}
    for path in BAD:
        _, faults = examine(text_of(path), path.name)
        assert len(faults) == several.get(path.stem, 1), path.stem


def test_every_code_is_shown_by_a_bad_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(HERE / "bad")
    shown = {f.code for p in BAD for f in examine(text_of(p), p.name)[1]}
    assert shown | {"E231"} == set(CODES)


def test_an_action_that_needs_percepts_which_nothing_gives_is_told() -> None:
    text = "<dock> ::= depth_difference(arm, satellite) < 10 % coupled(arm, satellite)"
    assert examine(text)[1] == []
    _, faults = examine(text, percepts=frozenset({"region", "health"}))
    assert [f.code for f in faults] == ["E231"]
    assert "`depth` and `hypothesis`" in faults[0].message
    mine = {"gripped": Meaning("gripped", ("gripped",), arity=1, needs=frozenset({"gripper"}))}
    _, faults = examine("<t> ::= gripped(part)", actions=mine)
    assert [f.code for f in faults] == ["E231"]


def test_three_mistakes_are_raised_together() -> None:
    with pytest.raises(ManyErrors) as caught:
        load_task(HERE / "bad" / "three_mistakes.task")
    codes = [e.code for e in caught.value.errors if isinstance(e, TaskFault)]
    assert codes == ["E102", "E201", "E117"]
    for error in caught.value.errors:
        assert isinstance(error.where, Place)
        assert error.where.caret() in str(caught.value)


@pytest.mark.parametrize("name", shipped_tasks())
def test_shipped_tasks_are_free_of_mistakes_and_named_as_their_file(name: str) -> None:
    task = load_task(name)
    assert task.name == name
    assert read_text(name).startswith(f"# {name}.task: ")


def test_there_are_at_least_five_shipped_tasks() -> None:
    assert len(shipped_tasks()) >= 5
    assert "dock" in shipped_tasks()


def test_a_task_that_is_not_there_is_told_with_those_that_are(tmp_path: Path) -> None:
    with pytest.raises(TaskError, match=r"no such task file[\s\S]*dock[\s\S]*did you mean"):
        load_task("docks")
    with pytest.raises(TaskError, match="cannot be read"):
        load_task(tmp_path)
    (tmp_path / "x.task").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(TaskError, match="not UTF-8"):
        load_task(tmp_path / "x.task")


def test_a_bad_rule_hides_neither_the_others_nor_what_it_defines() -> None:
    text = (
        "<dock> ::= <a> <b> <c>\n"
        "<a> ::= converging(arm satellite)\n"
        "<b> ::= cupled(arm, satellite)\n"
        "<c> ::= coupled(arm)\n"
    )
    _, faults = examine(text)
    assert [(f.code, f.place.line) for f in faults] == [("E117", 2), ("E201", 3), ("E205", 4)]


def test_the_nearest_word_is_named_whatever_its_case() -> None:
    assert closest("Convergin", ["converging", "diverging"]) == "converging"
    assert closest("zzz", ["converging"]) is None


TOKENS = ["<", ">", "::=", "|", "(", ")", "&", "?", "for", "5", "s", ",", "“", "\t", "actor", "é"]


def mutated(text: str, rng: random.Random) -> str:
    """A text with bytes, words or lines taken out, put in, doubled or swapped."""
    for _ in range(rng.randint(1, 4)):
        i, j = sorted(rng.randrange(len(text) + 1) for _ in range(2))
        match rng.randrange(5):
            case 0:
                text = text[:i] + text[i + 1 :]
            case 1:
                text = text[:i] + rng.choice(TOKENS) + text[i:]
            case 2:
                text = text[:i] + text[min(j, i + 12) :]
            case 3:
                text = text[:i] + chr(rng.choice([0, 9, 34, 8220, 60, 62, 124, 955])) + text[i:]
            case 4:
                lines = text.split("\n")
                rng.shuffle(lines)
                text = "\n".join(lines)
        text = text or " "
    return text


@settings(max_examples=300, deadline=None)
@given(st.integers(0, 10**9))
def test_whatever_stands_in_a_file_is_read_or_told_with_its_place(seed: int) -> None:
    rng = random.Random(seed)
    text = mutated(read_text(rng.choice(shipped_tasks())), rng)
    task, faults = examine(text)
    for fault in faults:
        assert fault.code in CODES
        assert 1 <= fault.place.line <= text.count("\n") + 1
        assert 1 <= fault.place.column <= len(text.split("\n")[fault.place.line - 1]) + 1
    if not faults:
        assert parse_task(str(task)) == task


@settings(max_examples=200, deadline=None)
@given(st.text(max_size=60))
def test_any_text_at_all_is_read_or_told(text: str) -> None:
    _, faults = examine(text)
    assert all(isinstance(f, TaskFault) for f in faults)


def test_a_long_file_with_many_mistakes_is_told_in_good_time() -> None:
    rules = [f"<s{i}> ::= converging(arm satellite)" for i in range(1000)]
    text = "\n".join([f"<t> ::= {' '.join(f'<s{i}>' for i in range(1000))}", *rules])
    start = time.perf_counter()
    _, faults = examine(text)
    assert len(faults) == 1000
    assert time.perf_counter() - start < 20.0


def test_the_grammar_is_read_from_its_file() -> None:
    grammar = files("visup.tasks").joinpath("tasks.lark").read_text("utf-8")
    assert '"within"' in grammar
