"""Rows of events laid side by side: what one run has more often than all others is noise."""

from __future__ import annotations

from collections import Counter
from itertools import combinations

from hypothesis import given
from hypothesis import strategies as st

from visup.tasks.learning.alignment import longest_common_subsequence, with_common_counts
from visup.tasks.learning.relevance import CourseEvent
from visup.tasks.learning.traces import ActionInterval

WORDS = st.lists(st.text("abcd", max_size=7), min_size=1, max_size=4)


def events_of(word: str) -> list[CourseEvent]:
    """Events named by letters, a second apart."""
    return [
        CourseEvent(ActionInterval((c, ("x", "y")), float(k), k + 1.0), float(k))
        for k, c in enumerate(word)
    ]


def actions_of(events: list[CourseEvent]) -> str:
    return "".join(e.symbol[0] for e in events)


@given(WORDS)
def test_common_items_are_reduced_to_their_least_count_and_others_retained(
    words: list[str],
) -> None:
    found = [actions_of(r) for r in with_common_counts([events_of(w) for w in words])]
    for word, reduced in zip(words, found, strict=True):
        at = iter(word)
        assert all(c in at for c in reduced)  # in its order
        for c in set(word):
            least = min(Counter(w)[c] for w in words)
            assert reduced.count(c) == (least or word.count(c))


@given(st.text("abc", max_size=6), st.text("abc", max_size=6))
def test_longest_common_subsequence_equals_brute_force(one: str, other: str) -> None:
    places = longest_common_subsequence(items_of(one), items_of(other))
    assert places == sorted(set(places))
    every = (
        len(p)
        for n in range(len(one) + 1)
        for p in combinations(one, n)
        if is_subsequence(p, other)
    )
    assert len(places) == max(every)
    assert is_subsequence(tuple(one[k] for k in places), other)


def items_of(word: str) -> list[tuple[str, tuple[str, ...]]]:
    return [(c, ("x", "y")) for c in word]


def is_subsequence(part: tuple[str, ...], word: str) -> bool:
    at = iter(word)
    return all(c in at for c in part)


def test_a_grasp_detected_twice_counts_once() -> None:
    """a approach, b grasp, c place, d let go: the one that comes before the placing is none."""
    plain, broken = events_of("abcd"), events_of("abdabcd")
    found = with_common_counts([plain, broken])[1]
    assert actions_of(found) == "abcd"
    assert found[-1].at == 6.0
