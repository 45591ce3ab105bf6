"""Whole files of newcomers, each with one mistake: hints mend them, mostly to what was meant.

`python -m tests.tasks.checks.mistakes.pairs` tells of all; here are some of each set.
"""

import pytest

from tests.tasks.checks.mistakes.counted import outcome_of
from tests.tasks.checks.mistakes.pairs import SETS, pairs, pointings
from tests.tasks.checks.test_mistakes_counted import fixes, task_messages

ONE_IN = 4


@pytest.mark.parametrize("name", SETS)
def test_hints_fix_nearly_all_mistakes_of_newcomers_mostly_as_intended(name: str) -> None:
    some = [(t, mutation) for t in (False, True) for mutation in [*pairs(name, t)][::ONE_IN]]
    found = [a for t, mutation in some if (a := outcome_of(mutation, t)) is not None]
    assert all(one.complete for one in found)
    assert sum(one.legal for one in found) >= 0.9 * len(found)
    assert sum(one.restored for one in found) >= 0.6 * len(found)


def test_carets_mark_the_cause_of_95_percent_of_newcomers_mistakes() -> None:
    found = [one for name in SETS for one in pointings(name)]
    beside = [one.mutation.text for one in found if not one.any]
    assert len(beside) <= 0.05 * len(found), beside
    assert sum(one.first for one in found) >= 0.95 * len(found)


HEAD = "<t> ::= <a> <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\n"


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        (f"{HEAD}never touching(x, z) during <a>, <b>\n",
         f"{HEAD}never touching(x, z) during <a> or <b>\n"),
        ("<t> ::= touching(gripper of arm of robot, y)\n",
         "<t> ::= touching(gripper of arm, y) actor arm is part of robot\n"),
        ("<t> ::= Sequence(<a>, <b>)\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)\n", HEAD),
        (f"{HEAD}on_failure(<b>): <a> <b>\n", f"{HEAD}on failure of <b>: <a> <b>\n"),
        (f"{HEAD}during <a>: never touching(x, z)\n", f"{HEAD}never touching(x, z) during <a>\n"),
        ("<t> ::= coupled(x, y) for 1 minute and 30 seconds\n", "<t> ::= coupled(x, y) for 90 s\n"),
        ("<t> ::= gap(x, y) in [20, 100] px\n", "<t> ::= gap(x, y) between 20 px and 100 px\n"),
        ("<t> ::= spin(x) < 1 rad/s\n", "<t> ::= spin(x) < 57.3 deg/s\n"),
        ("<t> ::= openness(x) > 0.3\n", "<t> ::= openness(x) > 30 %\n"),
        ("<t> ::= signal(battery) > 90 %\n", "<t> ::= signal(battery) > 90\n"),
        ("<t> ::= signal(level) < 5 px\n", "<t> ::= signal(level) < 5\n"),
        ("<t> ::= present(x) already already gone(x)\n", "<t> ::= present(x) already gone(x)\n"),
        ("<t> ::= present(x) ends when is_known(battery)\n",
         "<t> ::= present(x) ends when signal_known(battery)\n"),
        ("<t> ::= present(x)\nactor x is bright red\n", "<t> ::= present(x)\nactor x is red\n"),
        ("<t> ::= present(x)\nactor x is red cup\n", "<t> ::= present(x)\nactor x is red and cup\n"),
        ("<t> ::= speed(x) < 5 px / s\n", "<t> ::= speed(x) < 5 px/s\n"),
        (f"signal battery\n{HEAD}", f"# given as a signal: battery\n{HEAD}"),
        ("<t> ::= the hand touches the part for 1 s\n", "<t> ::= touching(hand, part) for 1 s\n"),
    ],
)  # fmt: skip
def test_hints_restore_the_intended_text(written: str, meant: str) -> None:
    told = task_messages(written)
    assert told
    assert next(fixes(written, told)).applied(written).split() == meant.split()


def test_a_stage_defined_twice_and_used_twice_becomes_two_stages() -> None:
    written = (
        "<t> ::= <move> <grasp> <move> <drop>\n<move> ::= converging(x, y)\n"
        "<grasp> ::= coupled(x, y)\n<move> ::= diverging(x, z)\n<drop> ::= decoupled(x, y)\n"
    )
    text = written
    while told := task_messages(text):
        text = next(fixes(text, told)).applied(text)
    assert text.replace("_2", "") == written
    assert text.count("<move_2>") == 2
