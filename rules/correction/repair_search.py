"""Search for least-cost repairs of a text: words inserted, dropped or replaced.

Least-cost repair of LR parse errors (Corchuelo et al. 2002, Diekmann and Tratt 2020): stacks of states are
advanced through the words of the text from where it last parses, cheapest edits first.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count, islice, product
from typing import NamedTuple

from visup.rules.correction.automaton import END, LrAutomaton, Stack
from visup.rules.correction.local_edits import Repair
from visup.rules.correction.tokens import Terminals, Word, tokens_of

MAX_INSERTIONS_IN_A_ROW = 4
SPELLINGS_TRIED = 8
"""Most spellings tried of one correction, where an inserted unit or name may be one of several."""
MAX_EQUIVALENT = 8
"""Most parses followed with the same continuation: a bracket may be missing in several places.
"""
NEAR_TERMINAL_COST = 0.1
"""Cost of reading a word as the terminal it would be if other words followed."""
_NO_BLANK_BEFORE = (",", ")", "]", ":", "?", "*", "+", "..")
_NO_BLANK_AFTER = ("(", "[")


@dataclass(frozen=True, slots=True)
class Replacement:
    """A possible meaning of words that the language does not allow there.

    Attributes:
        words: Number of words it replaces.
        terminals: Their meaning as terminals.
        text: The replacement text.
        cost: Its cost.
    """

    words: int
    terminals: tuple[str, ...]
    text: str
    cost: float


@dataclass(frozen=True)
class EditCosts:
    """Edit costs of a language.

    Attributes:
        automaton: Automaton of its grammar.
        terminals: Terminals of its grammar.
        insertions: Terminal -> cost of inserting it, and its spellings; no others are inserted.
        drop_cost: Cost of dropping a word.
        replacements: Possible meanings of the words from an index on.
        general: Terminals so general that they do not split words.
    """

    automaton: LrAutomaton
    terminals: Terminals
    insertions: Mapping[str, tuple[float, tuple[str, ...]]]
    drop_cost: Callable[[Word], float]
    replacements: Callable[[Sequence[Word], int], Sequence[Replacement]]
    general: Container[str] = ()


class _Change(NamedTuple):
    """A word replaced, inserted (`words` is 0) or dropped (no `texts`), linked to earlier changes.

    A tuple, since a search makes thousands.
    """

    at: int
    words: int
    texts: tuple[str, ...]
    before: _Change | None


def least_cost_repairs(
    text: str, since: int, costs: EditCosts, may_go_on: Callable[[], bool]
) -> Iterator[Repair]:
    """Corrections of a text, cheapest first; none if the search takes too long.

    Args:
        text: A text with a syntax error.
        since: Offset from which it may be edited.
        costs: Edit costs of its language.
        may_go_on: Called before each explored configuration; stops the search when false.
    """
    words = list(tokens_of(text, costs.terminals, costs.general))
    for last in _Search(words, since, costs, may_go_on).found():
        changes = list(_in_order(last))
        choices = product(*(c.texts or ("",) for c in changes))
        for texts in islice(choices, SPELLINGS_TRIED) if changes else ():
            yield _as_one_repair(text, words, changes, texts)


class _Search:
    """Best-first search over parses of some words, by the cost of their edits."""

    def __init__(
        self, words: list[Word], since: int, costs: EditCosts, may_go_on: Callable[[], bool]
    ) -> None:
        self.words, self.edit_costs, self.may_go_on = words, costs, may_go_on
        self.since = sum(w.begin < since for w in words)
        self.heap: list[tuple[float, int, int, Stack, _Change | None, int]] = []
        self.costs: dict[tuple[int, Stack, int], list[float]] = {}
        self.meanings: dict[int, Sequence[Replacement]] = {}
        self.drop_costs: dict[int, float] = {}
        self.acceptable: dict[Stack, list[tuple[float, tuple[str, ...], Stack]]] = {}
        self.order = count()

    def found(self) -> Iterator[_Change | None]:
        """The edits of each complete parse, linked from the last."""
        self.push(0.0, 0, self.edit_costs.automaton.initial, None, 0)
        while self.heap and self.may_go_on():
            cost, behind, _, stack, change, put = heappop(self.heap)
            at = -behind
            if at == len(self.words) and self.edit_costs.automaton.step(stack, END) is not None:
                yield change
            self.read_on(cost, at, stack, change)
            if at >= self.since:
                self.put_in(cost, at, stack, change, put)
                self.leave_out(cost, at, stack, change)

    def push(self, cost: float, at: int, stack: Stack, change: _Change | None, put: int) -> None:
        """Queue a configuration, unless enough equivalent ones at no higher cost are queued."""
        costs = self.costs.setdefault((at, stack, put), [])
        if len(costs) < MAX_EQUIVALENT or cost < costs[-1]:
            insort(costs, cost)
            del costs[MAX_EQUIVALENT:]
            heappush(self.heap, (cost, -at, next(self.order), stack, change, put))

    def read_on(self, cost: float, at: int, stack: Stack, change: _Change | None) -> None:
        """Consume the next word, as written or as possibly meant."""
        if at == len(self.words):
            return
        step = self.edit_costs.automaton.step
        for terminal in self.words[at].terminals:
            after = step(stack, terminal)
            if after is not None:
                self.push(cost, at + 1, after, change, 0)
                break
        for terminal in self.words[at].nearly:
            after = step(stack, terminal)
            if after is not None:
                self.push(cost + NEAR_TERMINAL_COST, at + 1, after, change, 0)
        for meant in self.meant_at(at) if at >= self.since else ():
            after = self.steps(stack, meant.terminals)
            if after is not None:
                new = _Change(at, meant.words, (meant.text,), change)
                self.push(cost + meant.cost, at + meant.words, after, new, 0)

    def meant_at(self, at: int) -> Sequence[Replacement]:
        """Possible meanings of the words from an index on."""
        if at not in self.meanings:
            self.meanings[at] = self.edit_costs.replacements(self.words, at)
        return self.meanings[at]

    def steps(self, stack: Stack, terminals: Iterable[str]) -> Stack | None:
        """The stack after several terminals; None if one is not accepted."""
        after: Stack | None = stack
        for terminal in terminals:
            after = None if after is None else self.edit_costs.automaton.step(after, terminal)
        return after

    def put_in(self, cost: float, at: int, stack: Stack, change: _Change | None, put: int) -> None:
        """Insert each word that may precede the next one."""
        if put >= MAX_INSERTIONS_IN_A_ROW:
            return
        offered = self.acceptable.get(stack)
        if offered is None:
            offered = self.acceptable[stack] = list(self.offers(stack))
        for price, texts, after in offered:
            self.push(cost + price, at, after, _Change(at, 0, texts, change), put + 1)

    def offers(self, stack: Stack) -> Iterator[tuple[float, tuple[str, ...], Stack]]:
        """Possible insertions: cost, spellings, and the resulting stack."""
        for terminal in self.edit_costs.automaton.acceptable(stack):
            price, texts = self.edit_costs.insertions.get(terminal, (0.0, ()))
            after = self.edit_costs.automaton.step(stack, terminal) if texts else None
            if after is not None:
                yield price, texts, after

    def leave_out(self, cost: float, at: int, stack: Stack, change: _Change | None) -> None:
        """Drop the next word; earlier insertions commute with it."""
        if at < len(self.words):
            price = self.drop_costs.get(at)
            if price is None:
                price = self.drop_costs[at] = self.edit_costs.drop_cost(self.words[at])
            self.push(cost + price, at + 1, stack, _Change(at, 1, (), change), 0)


def _in_order(last: _Change | None) -> Iterator[_Change]:
    if last is not None:
        yield from _in_order(last.before)
        yield last


def _as_one_repair(
    text: str, words: list[Word], changes: list[_Change], texts: tuple[str, ...]
) -> Repair:
    """All edits combined into one, over the part of the text that contains them."""
    first, last = changes[0].at, changes[-1].at + changes[-1].words
    parts: list[str] = []
    at = first
    for change, new in zip(changes, texts, strict=True):
        parts += [w.text for w in words[at : change.at]] + ([new] if new else [])
        at = change.at + change.words
    if first == last:  # an insertion
        begin = end = words[first - 1].end if first else 0
        new = spaced(parts)
        if first and new not in _NO_BLANK_BEFORE and not (new == "(" or text[begin - 1] in "(["):
            new = f" {new}"
        if end < len(text) and not text[end].isspace() and new.strip() not in _NO_BLANK_AFTER:
            new = new if text[end] in ",)]:" else f"{new} "
        return Repair(begin, end, new)
    return Repair(words[first].begin, words[last - 1].end, spaced(parts))


def spaced(parts: Sequence[str]) -> str:
    """Words joined with blanks where appropriate.

    >>> spaced(["touching", "(", "a", ",", "b", ")", "for", "2", "s"])
    'touching(a, b) for 2 s'
    """
    said = ""
    for before, part in zip(["", *parts], parts, strict=False):
        called = part in ("(", "[") and before[-1:].isidentifier()
        glued = part in _NO_BLANK_BEFORE or before in _NO_BLANK_AFTER or called
        said += part if glued or not said else f" {part}"
    return said
