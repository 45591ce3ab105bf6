"""Deliberate mistakes in task files: taking up the hints, one after the other, makes the file legal."""

import pytest

from visup.rules.language.diagnostics import Diagnostic
from visup.rules.language.fixes import fix_of
from visup.tasks.checks.diagnose import diagnose
from visup.tasks.checks.repairs import with_tested_hints

STAGES = [
    "<a> ::= not touching(x, y)",
    "<a> ::= converging(x, y), touching(x, y)",
    "<a> ::= converging(x, y) ends when touching(x, y) for 2 s and seen(x)",
    "<a> ::= upon(x, y)",
    "<a> ::= rising(gap(x, y) > 3 px)",
    "<a> ::= converging(x, y) FOR 5 s",
    "<pick>(ball_1) ::= touching(x, y)",
    "<a> ::= gap(x, y) between 3 px, 5 px",
    "on failure <a>: <b>\n<a> ::= touching(x, y)",
    "<a> ::= exists z: touching(x, z)",
    "<a> ::= convergng(x, y)",
    "<a> ::= converging(x)",
    "<a> ::= converging x, y",
    "<a> = converging(x, y)",
    "<a> -> converging(x, y)",
    "a ::= converging(x, y)",
    "<a> ::= converging(x, y) within 5",
    "<a> ::= converging(x, y) for 5 seconds",
    "<a> ::= converging(x, y) and touching(x, y)",
    "<a> ::= converging(x, y) or touching(x, y)",
    "<a> ::= converging(x, y) then touching(x, y)",
    "<a> ::= (converging(x, y)",
    "<a> ::= converging(x, y",
    "<a> ::= converging(x, y) | ",
    "<a> ::= gap(x, y) < 3",
    "<a> ::= gap(x, y) < 3 s",
    "<a> ::= gap(x, y) = 3 px",
    "<a> ::= gap(x, y)",
    "<a> ::= converging(x, x)",
    "<a> ::= converging(x, y) fails if touching(x, y)",
    "<a> ::= converging(x, y) until touching(x, y)",
    "<a> ::= converging(x, y) at least 5",
    "<a> ::= [converging(x, y)]",
    "<a> ::= {converging(x, y)}",
    "<a> ::= converging(x, y);",
    "// c\n<a> ::= converging(x, y)",
    "<a> ::= converging(x, y) && touching(x, y)",
    "<a> ::= converging(x, y) never touching x",
    "actor x red\n<a> ::= converging(x, y)",
    "actor x is\n<a> ::= converging(x, y)",
    "include dock\n<a> ::= converging(x, y)",
    "zone z is (1, 2) (3, 4)\n<a> ::= inside(x, z)",
    "<a> ::= inside(x, bay)",
    "<a> ::= converging(x, y) for -5 s",
    "<a b> ::= converging(x, y)",
    "<a> ::= converging(x, y) twice",
    "<a> ::= alredy touching(x, y)",
    "<a> ::= for each of (x, z) touching(x, y)",
    "<a> ::= for all leg of (x, z) touching(leg, y)",
    "<a> ::= historically touching(x, y)",
    "<a> ::= converging(x, y) within 5 s for",
    "<a> ::= repeat touching(x, y)",
    "parameter p = 5 s\n<a> ::= touching(x, y) for p",
    "<a> ::= touching(x, y) for q",
    "<a> ::= any 2 of <c> <d>\n<c> ::= present(x)\n<d> ::= present(y)",
    "<a> ::= in any order (<c>, <d>)\n<c> ::= present(x)\n<d> ::= present(y)",
]
TEXTS = [
    *(f"<t> ::= <a> <b>\n{s}\n<b> ::= coupled(x, y)" for s in STAGES),
    "<t> ::= <a> <c>\n<a> ::= converging(x, y)\n<b> ::= coupled(x, y)",
    "<t> ::= <a>\n<a> ::= <a> touching(x, y)",
]


@pytest.mark.parametrize("text", TEXTS)
def test_applying_all_hints_makes_a_file_valid(text: str) -> None:
    _, faults = diagnose(text, "my.task")
    assert faults
    assert all("^" in str(f) and f.place.line for f in faults)
    for _ in range(6):
        if not faults:
            break
        fixes = (fix_of(text, f.place, f.hint) for f in faults)
        fix = next((f for f in fixes if f is not None), None)
        assert fix is not None, [str(f) for f in faults]
        text = fix.applied(text)
        _, faults = diagnose(text, "my.task")
    assert faults == [], text


def test_a_hint_is_offered_only_if_it_helps() -> None:
    _, (fault,) = diagnose("<t> ::= converging(a, b) within 5", "my.task")
    assert fault.hint == "write `within 5 s` in place of `within 5`"
    _, (alone,) = diagnose("<t> ::= <t>", "my.task")
    fix = fix_of("<t> ::= <t>", alone.place, alone.hint)
    assert fix is not None
    assert diagnose(fix.applied("<t> ::= <t>"), "my.task")[1] == []


def test_hints_are_tested_for_the_first_mistakes_only() -> None:
    # Each try reads the file anew and explains all its mistakes: a damaged file took 10 s in an editor.
    text = "<t> ::= seen(a)\n" + "p\n" * 300
    faults = diagnose(text)[1]
    tried = 0

    def check(changed: str) -> list[Diagnostic]:
        nonlocal tried
        tried += 1
        return faults

    with_tested_hints(text, faults, check)
    assert 0 < tried <= 20
