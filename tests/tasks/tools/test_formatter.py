from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tasks.checks.test_diagnostics import GOOD, text_of
from tests.tasks.trees import tasks
from visup.rules.language.diagnostics import Source
from visup.tasks.checks.files import read_text, shipped_tasks
from visup.tasks.diagnostics.normalise import normalise
from visup.tasks.grammar.nodes import Task
from visup.tasks.grammar.parser import read as read_clean
from visup.tasks.tools.formatter import WIDTH, formatted


def read(text: str) -> Task:
    return read_clean(normalise(text, Source(text, ""))[0])


LAW = settings(max_examples=60, deadline=None)


def scattered(text: str, seed: int) -> tuple[str, list[str]]:
    """The same task with blanks, line ends and comments thrown in between its words."""
    rng = random.Random(seed)
    comments: list[str] = []
    out: list[str] = []
    for line in text.split("\n"):
        words = line.split(" ") if '"' not in line else [line]
        for word in words:
            out.append(word)
            match rng.randrange(6):
                case 0:
                    comments.append(f"# note {len(comments)} | <x> ::= ")
                    out.append(f"  {comments[-1]}\n")
                case 1:
                    out.append("\n" * rng.randint(1, 3))
                case _:
                    out.append(" " * rng.randint(1, 3))
        out.append("\n")
    return "".join(out), [c.strip() for c in comments]


@LAW
@given(tasks, st.integers(0, 10**6))
def test_formatting_is_idempotent_and_keeps_meaning_and_comments(task: Task, seed: int) -> None:
    text, comments = scattered(str(task), seed)
    once = formatted(text)
    assert read(once) == read(text)
    assert formatted(once) == once
    assert [
        line[line.index("# note") :] for line in once.split("\n") if "# note" in line
    ] == comments


@pytest.mark.parametrize("name", shipped_tasks())
def test_shipped_tasks_are_formatted(name: str) -> None:
    assert formatted(read_text(name)) == read_text(name)


@pytest.mark.parametrize("path", GOOD, ids=lambda p: p.stem)
def test_good_files_keep_their_meaning(path: str) -> None:
    text = text_of(path)  # type: ignore[arg-type]
    assert read(formatted(text)) == read(text)


def test_long_lines_are_broken_and_comments_stay_with_their_lines() -> None:
    long = " | ".join(f"<stage_{i}>" for i in range(20))
    text = f"# about\n\n\n\n<t>::={long} # why\n   # before b\n<b>::= x(a , c) for 5s"
    out = formatted(text).split("\n")
    assert out[:2] == ["# about", ""]
    assert all(len(line) <= WIDTH + len("  # why") for line in out)
    assert "  # why" in out[3] or "  # why" in out[4]
    assert out[-3:] == ["# before b", "<b> ::= x(a, c) for 5 s", ""]
