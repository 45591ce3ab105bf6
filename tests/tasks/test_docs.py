from __future__ import annotations

import re

import pytest

from tests.paths import ROOT
from visup.rules.traits.colours import TERMS
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.checks.load import shipped_tasks
from visup.tasks.diagnostics.codes import CODES
from visup.tasks.grammar.parser import read

PAGE = (ROOT / "docs/task-language.md").read_text("utf-8")
BLOCKS = [
    b for b in re.findall(r"```\n(.*?)```", PAGE, re.S) if "^" not in b and not b.startswith("$")
]


@pytest.mark.parametrize("block", BLOCKS)
def test_every_example_of_the_page_can_be_parsed(block: str) -> None:
    task = read(block)
    assert str(task)
    assert read(str(task)) == task


def test_the_page_lists_every_code_action_and_shipped_task() -> None:
    assert dict(re.findall(r"^\| (E\d+) \| (.*) \|$", PAGE, re.M)) == CODES
    assert set(re.findall(r"^\| `(\w+)\(a(?:, \w+)?\)", PAGE, re.M)) == set(ACTIONS)
    assert all(f"`{name}`" in PAGE for name in shipped_tasks())


def test_the_documented_precedence_is_correct() -> None:
    task = read("<t> ::= a(x) & b(x) for 5 s c(x) | d(x)")
    assert task == read("<t> ::= ((a(x) & (b(x) for 5 s)) c(x)) | d(x)")


def test_the_page_lists_every_word_for_a_colour() -> None:
    (words,) = re.findall(r"The words for colours are (.*?), each also with", PAGE, re.S)
    assert set(re.split(r",\s+|\s+and\s+", words)) == set(TERMS)
