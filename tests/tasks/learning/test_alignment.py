"""Rows of events laid side by side: what one run has more often than all others is noise."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from visup.tasks.learning.alignment import aligned, longest_common
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import Happening

WORDS = st.lists(st.text("abcd", max_size=7), min_size=1, max_size=4)


def row(word: str) -> list[CourseEvent]:
    """Events named by letters, a second apart."""
    return [
        CourseEvent(Happening((c, ("x", "y")), float(k), k + 1.0), float(k))
        for k, c in enumerate(word)
    ]


def letters(events: list[CourseEvent]) -> str:
    return "".join(e.symbol[0] for e in events)


@given(WORDS)
def test_what_all_have_is_there_as_often_in_all_and_nothing_else_is_lost(words: list[str]) -> None:
    found = [letters(r) for r in aligned([row(w) for w in words])]
    for word, left in zip(words, found, strict=True):
        at = iter(word)
        assert all(c in at for c in left)  # in its order
        for c in set(word):
            least = min(Counter(w)[c] for w in words)
            assert left.count(c) == (least or word.count(c))


@given(st.text("abc", max_size=6), st.text("abc", max_size=6))
def test_the_longest_common_course_is_that_of_trying_all(one: str, other: str) -> None:
    places = longest_common(row_items(one), row_items(other))
    assert places == sorted(set(places))
    every = (len(p) for n in range(len(one) + 1) for p in combinations(one, n) if within(p, other))
    assert len(places) == max(every)
    assert within(tuple(one[k] for k in places), other)


def row_items(word: str) -> list[tuple[str, tuple[str, ...]]]:
    return [(c, ("x", "y")) for c in word]


def within(part: tuple[str, ...], word: str) -> bool:
    at = iter(word)
    return all(c in at for c in part)


def test_a_grasp_that_is_lost_from_sight_for_a_moment_is_the_grasp_that_all_have() -> None:
    """a approach, b grasp, c place, d let go: the one that comes before the placing is none."""
    plain, broken = row("abcd"), row("abdabcd")
    found = aligned([plain, broken])[1]
    assert letters(found) == "abcd"
    assert found[-1].at == 6.0
