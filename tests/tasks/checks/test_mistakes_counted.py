"""Deliberate mistakes in both languages, counted: nearly all are told with a change that mends them.

They were written down in three sittings, each after what the one before had shown was mended; of the last,
which nothing was mended for, 56 of 60 were. Those mended without exception stand in `test_repairs.py`
and `tests/rules/language/test_mistakes.py`.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from tests.rules.language.test_mistakes import CONDITIONS as MENDED_CONDITIONS
from tests.rules.language.test_mistakes import RULES as MENDED_RULES
from tests.rules.language.test_mistakes import errors_of, rule
from tests.tasks.checks.test_repairs import TEXTS as MENDED_TASKS
from visup.agent.model.errors import SourceLocation
from visup.rules.language.fixes import TextFix, fix_of
from visup.tasks.checks.diagnose import diagnose

CONDITIONS = [
    "touching(a, b) or not",
    "gap(a, b) is less than 3 px",
    "gap(a,b) <= 3 meters",
    "seen(a) AND seen(b)",
    "always[5 s to 2 s] seen(a)",
    "eventually seen(a) and seen(b)",
    "henceforth[5] seen(a) and seen(b)",
    "touching(a, b) since[3 px] seen(a)",
    "signal(battery) and seen(a) and seen(b)",
    "signal_on(door, open) and touching(a, b)",
    "signal_is(mode) and touching(a, b)",
    "signal(battery) < 20 px and touching(a, b)",
    "speed(a) > speed(b) px/s",
    "heading(a) > 90 degrees and seen(b)",
    "objects > 3 and touching(a, b)",
    "confidence(a) > 0.9 percent and seen(b)",
    "last(touching(a, b)) ",
    "rate(gap(a, b)) < 3 px/s",
    "min(gap(a, b)) < 3 px",
    "within 5 s touching(a, b)",
    "for 2 s touching(a, b)",
    "if touching(a, b) then seen(a)",
    "touching(a, b) and (seen(a) or seen(b)",
    "touching(a, b)) and seen(a)",
    "moving a and seen b",
    "tuoching(a, b) for 2s",
    "touching(a, b) lasting 2 s",
    "gap(a, b) < 3 px leave 5",
    "converging(a b)",
    "expected(convergng, a, b)",
    "gap(a, b) under 3 px",
    "touching(a,, b)",
    "(touching(a, b) and seen(a)))",
    "touching(a, b) for two seconds",
    "touching(a, b) for 1,5 s",
    "speed(a) > 10 km/h and seen(b)",
    "not(touching(a, b)) for",
    "seen(a) nor seen(b)",
    "exists c seen(c) and touching(a, b)",
    "forall c: touching(a, d) and seen(b)",
    "gap(a; b) < 3 px",
    "gap(a, b) < -3 px px",
    "gap(a, b) * 2 px < 3 px",
    "touching(a, b) since [5 s] seen(a) and",
    "once[5 s touching(a, b)",
    "seen(a) & seen(b) | hidden(a)",
    "position_x(a, b) < 3 px",
    "inside(a) and seen(b)",
    "named(a, b) and seen(b)",
    "highest(gap(a, b), 2) < 3 px",
    "previous previous and touching(a, b)",
    "true and",
    "touching(a, b) leave 3 px",
    "gap(a, b) < 3 px leave",
    "time_to_contact < 3 s and touching(a, b)",
    "distance(a, b) < 3 px",
    "velocity(a) > 3 px/s and seen(b)",
    "a touches b",
    "touching(a, b) for 2s 3s",
    "gap(a, b) < 3px/",
    "seen(a)) or seen(b)",
    "hiden(a) and seen(b)",
    "gap(a, b < 3 px",
    "touching a, b",
    "always touching(a, b) for",
    "not seen(a) not seen(b)",
    "seen(a) and or seen(b)",
    "gap(a, b) <> 3 px",
    "gap(a, b) => 3 px",
    "closing_speed(a, b) > 3 px",
    "spin(a) > 3 px/s and seen(b)",
    "touching(a, b) within 5 s to 2 s ago",
    "eventually[2 s .. 1 s] touching(a, b)",
    "since touching(a, b)",
    "rate(gap(a, b), 2 px) < 3 px/s",
    "touching(A, B)",
    "Touching(a, b)",
    "seen(a), hidden(b)",
    "gap(a, b) < 3 px, touching(a, b)",
    "exists c: touching(a, c)",
    "power(gap(a, b)) < 3 px",
    "expected(touching, a)",
    'signal_is(mode, "auto") and touching(a, b)',
    'signal("battery") < 20 and touching(a, b)',
    "touching(a, b) in 3 of samples",
    "touching(a, b) in 60 of 5 s",
    "objects() > and touching(a, b)",
    "inside(a, b) and seen(b)",
    "seen(a) whenever touching(a, b)",
    "touching(a, b) for 2 s or more",
    "speed(a) > 2 * speed b",
    "is touching(a, b)",
    "eventually touching(a, b) within 5 s",
    "let x be speed(a) at seen(b) and speed(a) > x",
    "remember speed(a) when seen(b): speed(a) > 3 px/s",
    "exists c in view: touching(a, c) and seen(b)",
]
STAGES = [
    "<a> ::= converging(x, y) <b",
    "<a> ::= signal(battery)",
    "<a> ::= signal(battery, low) > 3",
    "<a> ::= signal_on(door) > 3 px",
    "<a> ::= singal(battery) > 3",
    "<a> ::= converging(x, y) ends if touching(x, y)",
    "<a> ::= converging(x, y) stops when touching(x, y)",
    "<a> ::= converging(x, y) for at least 5 s",
    "<a> ::= converging(x, y) within 2 minutes and 5 s",
    "<a> ::= touching(x, y) at most 3",
    "<a> ::= touching(x, y) 3 times",
    "<a> ::= touching(x, y) while seen(x)",
    "<a> ::= touching(x, y) & & seen(x)",
    "<a> ::= touching(x y)",
    "<a> ::= gap(x, y) > 3 px and < 5 px",
    "<a> ::= optional touching(x, y)",
    "<a> ::= touching(x, y)??",
    "<a> ::= touching(x, y) begin when seen(x)",
    "never touching(x, z) during a\n<a> ::= converging(x, y) actor z",
    "<a> ::= touching[x, y]",
    "actor x is teh largest red\n<a> ::= touching(x, y)",
    "actor x is enters from the left\n<a> ::= touching(x, y)",
    "bystanders ignore\n<a> ::= touching(x, y)",
    "zone z is (1,2),(3,4),(5,6)\n<a> ::= inside(x, z)",
    "parameter p is 5\n<a> ::= touching(x, y) for p",
    "<a> := touching(x, y)",
    "<a>:: = touching(x, y)",
    "task a ::= touching(x, y)",
    "<a> ::= touching(x, y) # ok\n<a> ::= coupled(x, y)",
    "<a> ::= Touching(x, y)",
    "<a> ::= converging (x, y",
    "<a> ::= converging(x, y)) ",
    "<a> ::= converging(x, y) <c>",
    "<a> ::= 5 s converging(x, y)",
    "<a> ::= converging(x, y) or",
    "<a> ::= converging(x; y)",
    "<a> ::= converging(x, y, z)",
    "<a> ::= touching(x, y) for 3 s within 1 s",
    "<a> ::= touching(x, y) at least 5 times at most 2 times",
    "<a> ::= any order <c>",
    "<a> ::= any order (touching(x, y))",
    "<a> ::= already",
    "<a> ::= gap(x, y) between 9 px and 3 px",
    "<a> ::= gap(x, y) between 3 px and 5 s",
    "<a> ::= speed(x) > 5 m/s",
    "<a> ::= inside(x, y) & moving(z",
    "<a> ::= outside(x)",
    "on failure of <zz>: <b>\n<a> ::= touching(x, y)",
    "never\n<a> ::= touching(x, y)",
    "always touching(x, y) during <zz>\n<a> ::= touching(x, y)",
    "actor x is spartan size 5 px\n<a> ::= touching(x, y)",
    "actor x at 3, 4\n<a> ::= touching(x, y)",
    "actor x is larger 40 px\n<a> ::= touching(x, y)",
    "optional x is red\n<a> ::= touching(x, y)",
    "include 'dock'\n<a> ::= touching(x, y)",
    '<a> ::= "text touching(x, y)',
    "<a> ::= <c>touching(x, y)</c>",
    "<a> ::= touching(x, y) fails when",
    "<a> ::= touching(x, y) fails when not",
    "<a> ::= touchng(x, y) for 3 s",
    "<a> ::= touching(x, y) for 3",
    "<a> ::= touching(x, y) fro 3 s",
    "<a> ::= touching(x, y) withn 3 s",
    "<a> ::= touching(x, y) | | coupled(x, y)",
    "<a> ::= | touching(x, y)",
    "<a> ::= touching(x, y) *2",
    "<a> ::= touching(x, y)+ 2",
    "<a> ::= <c> touching(x, y)",
    "<a> ::= touching(x, y) <a",
    "<a> ::= touching(x y) coupled(x, y)",
    "<a> ::= not(touching(x, y))",
    "<a> ::= touching(x, y) ends when touching(x y)",
    "<a> ::= touching(x, y) ends when coupled(x, y) end when seen(x)",
    "<a> ::= gap(x, y) < 5 px/s",
    "<a> ::= gap(x, y) below 5 px",
    "<a> ::= gap(x, y) < 5 px 3 px",
    "<a> ::= 5 px < gap(x, y)",
    "<a> ::= gap(x, y) in 3 px .. 5 px",
    "<a> ::= present(x, y)",
    "nevr touching(x, z)\n<a> ::= touching(x, y)",
    "never touching(x, z\n<a> ::= touching(x, y)",
    "actor is red\n<a> ::= touching(x, y)",
    "actor x = red\n<a> ::= touching(x, y)",
    "actor x is at (3 4)\n<a> ::= touching(x, y)",
    "actor x is the biggest red\n<a> ::= touching(x, y)",
    "parameter p is five s\n<a> ::= touching(x, y) for p",
    "zone z (1, 2) (3, 4) (5, 6)\n<a> ::= inside(x, z)",
    "on failure of <a> <b>\n<a> ::= touching(x, y)",
    "<a> := <c>\n<c> := touching(x, y)",
    "<a> ::= repeat 3 touching(x, y)",
    "<a> ::= touching(x, y) repeat 3 times",
    "<a> ::= each of (touching(x, y))",
    "<a> ::= touching x with y",
    "<a> ::= touching(x, y) as long as seen(x)",
    "<a> ::= touching(x, y) ends when gap(x, y) > 3 s",
]


@dataclass(frozen=True)
class Told:
    """What is said of a mistake."""

    text: str
    place: SourceLocation
    expected: str | None
    hint: str | None


def of_rules(text: str) -> list[Told]:
    found = []
    for e in errors_of(text):
        assert isinstance(e.where, SourceLocation)
        found.append(Told(str(e), e.where, e.expected, e.hint))
    return found


def of_tasks(text: str) -> list[Told]:
    return [Told(str(f), f.place, f.expected, f.hint) for f in diagnose(text, "my.task")[1]]


def fixes(text: str, told: Sequence[Told]) -> Iterator[TextFix]:
    for one in told:
        fix = fix_of(text, one.place, one.hint)
        if fix is not None:
            yield fix


def mended(text: str, read: Callable[[str], list[Told]]) -> bool:
    """Whether taking up hints, one after the other, makes a text legal."""
    told = read(text)
    if not told or not all("^" in t.text and (t.expected or t.hint) for t in told):
        return False
    for _ in range(6):
        fix = next(fixes(text, told), None)
        if fix is None:
            return not told
        text = fix.applied(text)
        told = read(text)
    return not told


def test_of_a_hundred_mistakes_95_are_told_with_a_change_that_mends_them() -> None:
    rules = {c: mended(rule(c), of_rules) for c in CONDITIONS}
    stages = {s: mended(f"<t> ::= <a> <b>\n{s}\n<b> ::= coupled(x, y)", of_tasks) for s in STAGES}
    missed = [text for text, well in {**rules, **stages}.items() if not well]
    alone = len(rules) + len(stages)
    assert len(missed) <= 0.08 * alone, missed
    count = alone + len(MENDED_CONDITIONS) + len(MENDED_RULES) + len(MENDED_TASKS)
    assert len(missed) <= 0.05 * count, missed
