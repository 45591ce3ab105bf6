"""Induction of a plan from symbol strings: loops from repeats, sequences from the common partial order.

A loop is introduced where it shortens the total description of all runs. Two items are unordered when
either comes first in some run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from statistics import mean

from visup.tasks.learning.traces import Symbol

STAYING_NEAR = "keeping"
"""Action of the symbol of `Proximity`; no action of the task language."""
LONGEST_LOOP = 6
MAX_UNORDERED = 6


@dataclass(frozen=True, slots=True)
class Loop:
    """A repeated block: the symbols of one iteration."""

    body: tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class Conjunction:
    """Symbols that begin at about the same time and overlap: a conjunction."""

    parts: tuple[Symbol, ...]


@dataclass(frozen=True, slots=True)
class CarryingStage(Conjunction):
    """One actor carries another: they move together, and what the carried one does meanwhile."""


@dataclass(frozen=True, slots=True)
class Disjunction:
    """Symbols of which any is evidence of one event."""

    parts: tuple[Symbol, ...]


@dataclass(frozen=True, slots=True)
class Proximity:
    """Two actors that never meet stay near each other.

    Attributes:
        pair: The two.
        below_px: Upper limit of the gap between their outlines, pixels.
        least_s: For how long at least, seconds.
    """

    pair: tuple[str, ...]
    below_px: int
    least_s: float


Item = Symbol | Loop | Conjunction | Disjunction | Proximity
Word = tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class Series:
    """Parts in sequence."""

    parts: tuple[Plan, ...]


@dataclass(frozen=True, slots=True)
class Unordered:
    """Parts that occur once each, in any order."""

    parts: tuple[Plan, ...]


Occurrence = tuple[Item, int]
"""The n-th occurrence of a symbol or loop in a run, from 0."""
Plan = Occurrence | Series | Unordered


def with_loops(words: Sequence[Word]) -> tuple[list[Word], dict[Loop, tuple[int, int]]]:
    """Fold tandem repeats into loops, greedily, while the total description length decreases.

    Returns:
        The words, and the least and greatest number of iterations of each loop.
    """
    found, times = list(words), dict[Loop, tuple[int, int]]()
    while True:
        best = max(
            _candidates(found), key=lambda c: (_symbols_saved(found, c), -len(c)), default=None
        )
        if best is None or _symbols_saved(found, best) <= 0:
            return found, times
        loop = Loop(best)
        counts = [n for w in found for n in _repeats(w, best)]
        times[loop] = min(counts), max(counts)
        found = [_with_loop(w, best, loop) for w in found]


def _candidates(words: Sequence[Word]) -> set[Word]:
    found: set[Word] = set()
    for word in words:
        for size in range(1, LONGEST_LOOP + 1):
            for at in range(len(word) - 2 * size + 1):
                if word[at : at + size] == word[at + size : at + 2 * size]:
                    found.add(word[at : at + size])
    return found


def _symbols_saved(words: Sequence[Word], block: Word) -> int:
    """Symbols saved by writing all words with the loop, less the loop itself."""
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


def _with_loop(word: Word, block: Word, loop: Loop) -> Word:
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
    """Each symbol with the number of its earlier occurrences in the word."""
    counts: dict[Item, int] = {}
    found = []
    for item in word:
        found.append((item, counts.get(item, 0)))
        counts[item] = counts.get(item, 0) + 1
    return found


def frequent_occurrences(words: Sequence[Word], share: float) -> list[Occurrence]:
    """Occurrences in at least this share of the words, by mean relative position."""
    places: dict[Occurrence, list[float]] = {}
    for word in words:
        for place, occurrence in enumerate(numbered(word)):
            places.setdefault(occurrence, []).append(place / max(1, len(word)))
    frequent = [o for o, p in places.items() if len(p) >= share * len(words)]
    return sorted(frequent, key=lambda o: (mean(places[o]), repr(o)))


def with_approaches(core: Sequence[Occurrence], frequent: Sequence[Occurrence]) -> list[Occurrence]:
    """The core with those of the frequent occurrences that are approaches to a meeting of the core.

    Actors converge before they meet, but not in every view: one that is lifted over the other and let down
    on it may seem to diverge.

    Args:
        core: Occurrences of nearly all words.
        frequent: Occurrences of fewer words, in order; all of the core are among them.
    """
    met_pairs = {s[1] for o in core for s in symbols_of(o[0]) if s[0] in ("touching", "coupled")}
    approaches = {
        o for o in frequent if o[0] in {("converging", pair) for pair in met_pairs} and o[1] == 0
    }
    return [o for o in frequent if o in approaches or o in core]


def plan_of(
    words: Sequence[Word],
    core: Sequence[Occurrence],
    may_be_random: Callable[[Occurrence, Occurrence], bool] = lambda a, b: False,
) -> Plan:
    """The plan common to all words: in sequence where all agree on the order, else free.

    Args:
        words: The runs.
        core: The occurrences of the plan.
        may_be_random: Whether two occurrences are so close in time that their order may be random.
    """
    ranks = [{o: k for k, o in enumerate(numbered(w))} for w in words]

    def before(a: Occurrence, b: Occurrence) -> bool:
        common = [r for r in ranks if a in r and b in r]
        return bool(common) and all(r[a] < r[b] for r in common) and not may_be_random(a, b)

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
        return Unordered(tuple(_plan(g, before) for g in groups[:MAX_UNORDERED]))
    # A partial order that does not decompose: fall back to the mean order, which most runs follow.
    return Series(tuple(items))


def _components(
    items: list[Occurrence], before: Callable[[Occurrence, Occurrence], bool]
) -> list[list[Occurrence]]:
    """Connected components of the order relation: no item is ordered with one of another group."""
    group: dict[Occurrence, int] = {o: k for k, o in enumerate(items)}
    for a, b in combinations(items, 2):
        if before(a, b) or before(b, a):
            merged, kept = group[b], group[a]
            group = {o: kept if g == merged else g for o, g in group.items()}
    return [[o for o in items if group[o] == g] for g in dict.fromkeys(group.values())]


def leaves_of(plan: Plan) -> list[Occurrence]:
    """The occurrences of a plan, in order."""
    if isinstance(plan, Series | Unordered):
        return [o for p in plan.parts for o in leaves_of(p)]
    return [plan]


def final_of(plan: Plan) -> Occurrence | None:
    """The occurrence with which a plan ends, or None where any of several may be the last."""
    while isinstance(plan, Series):
        plan = plan.parts[-1]
    return None if isinstance(plan, Unordered) else plan


def without(plan: Plan, dropped: Occurrence) -> Plan | None:
    """The plan without one of its occurrences; None if that leaves it empty."""
    if not isinstance(plan, Series | Unordered):
        return None if plan == dropped else plan
    parts = tuple(p for part in plan.parts if (p := without(part, dropped)) is not None)
    if len(parts) <= 1:
        return parts[0] if parts else None
    return type(plan)(parts)


LoopCounts = Mapping[Loop, tuple[int, int]]


def symbols_of(item: Item) -> list[Symbol]:
    """The symbols of an item, in order."""
    if isinstance(item, Conjunction | Disjunction):
        return list(item.parts)
    if isinstance(item, Proximity):
        return [(STAYING_NEAR, item.pair)]
    return [s for i in item.body for s in symbols_of(i)] if isinstance(item, Loop) else [item]


def action_text(symbol: Item) -> str:
    """An item as a course of a task file."""
    if isinstance(symbol, Loop):
        return " ".join(map(action_text, symbol.body))
    if isinstance(symbol, Conjunction):
        return " & ".join(map(action_text, symbol.parts))
    if isinstance(symbol, Disjunction):
        return " | ".join(map(action_text, symbol.parts))
    if isinstance(symbol, Proximity):
        return f"gap({', '.join(symbol.pair)}) < {symbol.below_px} px"
    action, actors = symbol
    return f"{action}({', '.join(actors)})"
