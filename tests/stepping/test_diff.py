"""Laws of differences between minds."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.stepping.timelines import reasoning_course
from visup.agent import Truth
from visup.stepping import MindDiff, mind_diff

STEPS = st.integers(0, 59)


def between(a: int, b: int) -> MindDiff:
    course = reasoning_course()
    return mind_diff(course[a].mind, course[b].mind)


@given(a=STEPS, b=STEPS)
@settings(max_examples=25, deadline=None)
def test_differences_are_antisymmetric_and_empty_for_equal_minds(a: int, b: int) -> None:
    assert not between(a, a).changes
    assert between(b, a) == -between(a, b)


@given(a=STEPS, b=STEPS, c=STEPS)
@settings(max_examples=25, deadline=None)
def test_consecutive_differences_compose(a: int, b: int, c: int) -> None:
    first, second, both = between(a, b), between(b, c), between(a, c)

    def after(diff: MindDiff, what: tuple[str, str]) -> list[str | None]:
        return [x.after for x in diff.changes if (x.about, x.what) == what]

    for change in both.changes:
        if change.about != "relation":  # of these only what is true at an end is told
            what = (change.about, change.what)
            last = after(second, what) or after(first, what)
            assert last == [change.after]


def test_added_changed_and_removed_beliefs_are_listed() -> None:
    diff = between(5, 59)
    text = str(diff)
    assert "~ object object 1: seen, unconfirmed -> seen" in text
    assert "~ stage dock.approach: pending -> active" in text
    assert "+ relation diverging(1, 3): true" in text
    assert "+ alert 1: unexpected_object (2), warning" in text
    assert "- alert 1: unexpected_object (2), warning" in str(-diff)
    assert {c.about for c in diff.about("alert", "stage")} == {"alert", "stage"}


def test_relations_true_in_either_mind_are_compared() -> None:
    course = reasoning_course()
    a, b = course[20].mind, course[59].mind
    told = {c.what for c in mind_diff(a, b).about("relation")}
    true = [{(r.name, r.objects) for r in m.relations if r.truth is Truth.TRUE} for m in (a, b)]
    expected = {f"{n}({', '.join(map(str, o))})" for n, o in true[0] ^ true[1]}
    assert told >= expected
