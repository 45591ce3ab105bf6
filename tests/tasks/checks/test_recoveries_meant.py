"""What is done on failure, said in other words, is still done on failure after the hint is taken up."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tasks.checks.test_mistakes_counted import fixes, task_messages
from visup.tasks.checks.load import parse_task
from visup.tasks.checks.usual_meanings import recoveries

TASK = "<t> ::= <a> <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\n"
RECOVERIES = [
    "on failure of a: <b>",
    "on failure <a>: <b>",
    "on failure of touching(x, y): <b>",
    "on failure coupled(x, y) -> <a>",
    "on failure: <b>",
    "on error of <a> do <b>",
    "if <a> fails: <b>",
    "whenever <a> has failed, <b>",
    "on_failure of stage a: <b>",
]


@pytest.mark.parametrize("line", RECOVERIES)
def test_applying_the_hint_gives_a_recovery(line: str) -> None:
    text = TASK + line + "\n"
    fix = next(fixes(text, task_messages(text)))
    task = parse_task(fix.applied(text))
    assert len(task.recovered) == 1


def test_a_recovery_inside_a_stage_belongs_to_that_stage() -> None:
    line = "<b> ::= coupled(x, y) on failure apart(x, y)"
    assert [new for _, new in recoveries(TASK, line)] == ["on failure of <b>: "]


def test_an_action_in_a_recovery_means_its_stage() -> None:
    line = "on failure coupled( x,y ): <a>"
    assert next(new for _, new in recoveries(TASK, line)) == "on failure of <b>: "


@given(st.text(alphabet="<>:=()xyabon failuresw&|", max_size=60))
def test_recoveries_name_only_stages_of_the_file(line: str) -> None:
    for match, new in recoveries(TASK, line):
        assert new in ("on failure of <a>: ", "on failure of <b>: ", "on failure of <t>: ")
        assert line[match.start() : match.end()] == match[0]
