"""From strings of symbols to a course: what repeats is a loop, what all runs order is a sequence.

A loop is made where it shortens the description of all runs together. Two things of which either
comes first in some run are free in their order.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from statistics import mean

from visup.tasks.learning.traces import Symbol

LONGEST_LOOP = 6
MOST_FREE = 6


@dataclass(frozen=True, slots=True)
class Loop:
    """What is done several times in a row: the symbols of one time."""

    body: tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class Joint:
    """What begins about the same time and then goes on together: each asked for beside the others."""

    parts: tuple[Symbol, ...]


Item = Symbol | Loop | Joint
Word = tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class Series:
    """One after the other."""

    parts: tuple[Plan, ...]


@dataclass(frozen=True, slots=True)
class Free:
    """Each once, in any order."""

    parts: tuple[Plan, ...]


Occurrence = tuple[Item, int]
"""The n-th time of a symbol or loop in a run, from 0."""
Plan = Occurrence | Series | Free


def with_loops(words: Sequence[Word]) -> tuple[list[Word], dict[Loop, tuple[int, int]]]:
    """The words with tandem repeats as loops, while that shortens them all together.

    Returns:
        The words, and how often at least and at most each loop was gone through.
    """
    found, times = list(words), dict[Loop, tuple[int, int]]()
    while True:
        best = max(_candidates(found), key=lambda c: (_gain(found, c), -len(c)), default=None)
        if best is None or _gain(found, best) <= 0:
            return found, times
        loop = Loop(best)
        counts = [n for w in found for n in _repeats(w, best)]
        times[loop] = min(counts), max(counts)
        found = [_folded(w, best, loop) for w in found]


def _candidates(words: Sequence[Word]) -> set[Word]:
    found: set[Word] = set()
    for word in words:
        for size in range(1, LONGEST_LOOP + 1):
            for at in range(len(word) - 2 * size + 1):
                if word[at : at + size] == word[at + size : at + 2 * size]:
                    found.add(word[at : at + size])
    return found


def _gain(words: Sequence[Word], block: Word) -> int:
    """How many symbols fewer it takes to write all words and the loop."""
    saved = sum(n * len(block) - 1 for w in words for n in _repeats(w, block))
    return saved - (len(block) + 1)


def _repeats(word: Word, block: Word) -> list[int]:
    found, at, size = [], 0, len(block)
    while at + size <= len(word):
        n = 0
        while word[at + n * size : at + (n + 1) * size] == block:
            n += 1
        if n:
            found.append(n)
        at += max(1, n * size)
    return found


def _folded(word: Word, block: Word, loop: Loop) -> Word:
    found: list[Item] = []
    at, size = 0, len(block)
    while at < len(word):
        if word[at : at + size] == block:
            while word[at : at + size] == block:
                at += size
            found.append(loop)
        else:
            found.append(word[at])
            at += 1
    return tuple(found)


def numbered(word: Word) -> list[Occurrence]:
    """Each symbol with how often it stood in the word before."""
    seen: dict[Item, int] = {}
    found = []
    for item in word:
        found.append((item, seen.get(item, 0)))
        seen[item] = seen.get(item, 0) + 1
    return found


def shared(words: Sequence[Word], share: float) -> list[Occurrence]:
    """What stands in so many of the words at least, in the order of its mean place."""
    places: dict[Occurrence, list[float]] = {}
    for word in words:
        for place, occurrence in enumerate(numbered(word)):
            places.setdefault(occurrence, []).append(place / max(1, len(word)))
    core = [o for o, p in places.items() if len(p) >= share * len(words)]
    return sorted(core, key=lambda o: (mean(places[o]), repr(o)))


def plan_of(
    words: Sequence[Word],
    core: Sequence[Occurrence],
    at_once: Callable[[Occurrence, Occurrence], bool] = lambda a, b: False,
) -> Plan:
    """The course that all words share: in sequence what all order alike, else free.

    Args:
        words: The runs.
        core: What is in them all.
        at_once: Whether two things come so close that their order may be chance.
    """
    ranks = [{o: k for k, o in enumerate(numbered(w))} for w in words]

    def before(a: Occurrence, b: Occurrence) -> bool:
        both = [r for r in ranks if a in r and b in r]
        return bool(both) and all(r[a] < r[b] for r in both) and not at_once(a, b)

    return _plan(list(core), before)


def _plan(items: list[Occurrence], before: Callable[[Occurrence, Occurrence], bool]) -> Plan:
    if len(items) == 1:
        return items[0]
    cuts = [
        k for k in range(1, len(items)) if all(before(a, b) for a in items[:k] for b in items[k:])
    ]
    if cuts:
        edges = [0, *cuts, len(items)]
        blocks = [items[i:j] for i, j in pairwise(edges)]
        return Series(tuple(_plan(b, before) for b in blocks))
    groups = _components(items, before)
    if len(groups) > 1:
        return Free(tuple(_plan(g, before) for g in groups[:MOST_FREE]))
    # Ordered in part only: as on average, which is what most runs do.
    return Series(tuple(items))


def _components(
    items: list[Occurrence], before: Callable[[Occurrence, Occurrence], bool]
) -> list[list[Occurrence]]:
    """Groups such that nothing of one is ordered with anything of another."""
    group: dict[Occurrence, int] = {o: k for k, o in enumerate(items)}
    for a, b in combinations(items, 2):
        if before(a, b) or before(b, a):
            old, new = group[b], group[a]
            group = {o: new if g == old else g for o, g in group.items()}
    return [[o for o in items if group[o] == g] for g in dict.fromkeys(group.values())]


def leaves_of(plan: Plan) -> list[Occurrence]:
    """The occurrences of a plan, in its order."""
    if isinstance(plan, Series | Free):
        return [o for p in plan.parts for o in leaves_of(p)]
    return [plan]


def without(plan: Plan, dropped: Occurrence) -> Plan | None:
    """The plan without one of its occurrences; None when nothing is left."""
    if not isinstance(plan, Series | Free):
        return None if plan == dropped else plan
    parts = tuple(p for part in plan.parts if (p := without(part, dropped)) is not None)
    if len(parts) <= 1:
        return parts[0] if parts else None
    return type(plan)(parts)


Times = Mapping[Loop, tuple[int, int]]
