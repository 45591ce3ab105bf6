"""The exact oracle of recognition: every history of a small task, one by one.

Written from the definition of the model (`visup.tasks.automaton.stage_hmm`) and of the language alone, and as
dumbly as it goes: its own grammars, its own way through them, no states that are told to be the
same, no sums but the last. It shares with the recogniser only the numbers of the model.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeAlias

from visup.tasks.automaton.stage_hmm import StageHmm

Expr: TypeAlias = tuple[Any, ...]
"""('act', key), ('hold', key, seconds), ('ref', stage), ('seq' | 'alt' | 'any' | 'and', *parts),
('rep', mark, part), ('times', least, most, part)."""
Tree: TypeAlias = tuple[Any, ...]
"""('at', stage, key, seconds, phase), ('then', tree, what comes after, stage), ('par', *trees)."""
OPTIONAL = "e"
"""The key whose actor is optional: what is asked of it may be left out."""
WAIT, FAIL, LOST = "wait", "fail", "lost"
SEEN = ("holds", "neither", "contrary", "unknown")


@dataclass(frozen=True)
class Rules:
    """A grammar: stages by name; the task is `t`."""

    stages: Mapping[str, Expr]

    def starts(self, expr: Expr, stage: str) -> list[Tree | None]:
        """All ways to begin; None where it may be left out."""
        kind, parts = expr[0], expr[1:]
        if kind in ("act", "hold"):
            seconds = parts[1] if kind == "hold" else None
            leaf: Tree = ("at", stage, parts[0], seconds, WAIT)
            return [leaf, None] if parts[0] == OPTIONAL else [leaf]
        if kind == "ref":
            return self.starts(self.stages[parts[0]], parts[0])
        if kind == "alt":
            return [t for part in parts for t in self.starts(part, stage)]
        if kind == "seq":
            return self.following(parts, stage)
        if kind == "any":
            orders = ((p, ("any", *parts[:i], *parts[i + 1 :])) for i, p in enumerate(parts))
            return [t for order in orders for t in self.following(order, stage)] or [None]
        if kind == "and":
            together = product(*(self.starts(p, stage) for p in parts))
            return [_beside([t for t in way if t is not None]) for way in together]
        if kind == "rep":
            mark, part = parts
            rest = () if mark == "?" else (("rep", "*", part),)
            again = self.following((part, *rest), stage)
            return again if mark == "+" else [*again, None]
        least, most, part = parts
        if most == 0:
            return [None]
        left = ("times", max(0, least - 1), None if most is None else most - 1, part)
        again = self.following((part, left), stage)
        return [*again, None] if least == 0 else again

    def following(self, parts: tuple[Expr, ...], stage: str) -> list[Tree | None]:
        """All ways to begin with the first of some things that follow one another."""
        if not parts:
            return [None]
        found: list[Tree | None] = []
        for tree in self.starts(parts[0], stage):
            if tree is None:
                found += self.following(parts[1:], stage)
            else:
                found.append(("then", tree, parts[1:], stage))
        return found

    def ways(
        self, tree: Tree, path: tuple[int, ...] = ()
    ) -> list[tuple[Tree | None, frozenset[Any]]]:
        """All ways on: what is under way after each, and the paths of the leaves that are over."""
        if tree[0] == "at":
            return [(None, frozenset({path}))]
        if tree[0] == "then":
            found: list[tuple[Tree | None, frozenset[Any]]] = []
            for new, left in self.ways(tree[1], (*path, 0)):
                if new is not None:
                    found.append((("then", new, *tree[2:]), left))
                else:
                    found += [(after, left) for after in self.following(tree[2], tree[3])]
            return found
        parts, found, ends = tree[1:], [], []
        for i, part in enumerate(parts):
            here = self.ways(part, (*path, i))
            ends.append([left for new, left in here if new is None])
            moved = ((new, left) for new, left in here if new is not None)
            found += [(("par", *parts[:i], new, *parts[i + 1 :]), left) for new, left in moved]
        # Things at the same time end at the same time.
        return [*found, *((None, frozenset().union(*way)) for way in product(*ends))]


def _beside(trees: list[Tree]) -> Tree | None:
    return None if not trees else trees[0] if len(trees) == 1 else ("par", *trees)


def leaves(tree: Tree, path: tuple[int, ...] = ()) -> dict[tuple[int, ...], Tree]:
    """The steps under way, by their path."""
    if tree[0] == "at":
        return {path: tree}
    inner = [tree[1]] if tree[0] == "then" else tree[1:]
    return {p: x for i, t in enumerate(inner) for p, x in leaves(t, (*path, i)).items()}


def _phased(tree: Tree, phases: Mapping[tuple[int, ...], Any], path: tuple[int, ...] = ()) -> Tree:
    if tree[0] == "at":
        return (*tree[:4], phases[path])
    if tree[0] == "then":
        return ("then", _phased(tree[1], phases, (*path, 0)), *tree[2:])
    return ("par", *(_phased(t, phases, (*path, i)) for i, t in enumerate(tree[1:])))


@dataclass(frozen=True)
class Oracle:
    """Every history of a task.

    Attributes:
        rules: The grammar.
        model: The numbers of the model.
    """

    rules: Rules
    model: StageHmm

    def begin(self) -> list[tuple[Tree | None, float]]:
        """Each way to begin, with its probability."""
        trees = self.rules.starts(("ref", "t"), "t")
        return [(t, 1.0 / len(trees)) for t in trees]

    def exits(self, leaf: Tree) -> list[tuple[Any, float]]:
        """Phases that may come next, with their rates; a number counts how far a step has gone."""
        m, seconds, phase = self.model, leaf[3], leaf[4]
        if phase == WAIT:
            return [(1, m.begin)]
        if phase == FAIL:
            return [(1, m.recover), (LOST, m.lose)]
        if phase == LOST:
            return []
        onward = [(phase + 1, m.phases / seconds)] if seconds and phase < m.phases else []
        return [*onward, (FAIL, m.fail)]

    def leaving(self, leaf: Tree) -> float:
        """Rate at which the course goes on from a step."""
        seconds, phase = leaf[3], leaf[4]
        if phase == LOST:
            return 0.0
        whole = phase == (self.model.phases if seconds else 1)
        return self.model.leave if whole else self.model.skip

    def after(self, tree: Tree | None, dt: float) -> Iterator[tuple[Tree | None, float]]:
        """All that may have become of a history `dt` seconds later; nothing is summed."""
        if tree is None:
            yield None, 1.0
            return
        now = leaves(tree)
        changes = [_race(x[4], self.exits(x), dt) for x in now.values()]
        for way in product(*changes):
            chance = math.prod(p for _, p in way)
            phases = dict(zip(now, (phase for phase, _ in way), strict=True))
            changed = _phased(tree, phases)
            for new, p in _race(changed, self.rated(changed), dt):
                yield new, chance * p

    def rated(self, tree: Tree) -> list[tuple[Tree | None, float]]:
        """The ways on with their rates."""
        ways, now = self.rules.ways(tree), leaves(tree)
        lefts = [left for _, left in ways]
        slowest = [min(self.leaving(now[p]) for p in left) for left in lefts]
        rates = (s / lefts.count(left) for s, left in zip(slowest, lefts, strict=True))
        return [(new, rate) for (new, _), rate in zip(ways, rates, strict=True)]

    def likelihood(self, tree: Tree | None, seen: Mapping[str, tuple[str, float]]) -> float:
        """Probability of all that is seen; of what is not mentioned nothing is."""
        now = list(leaves(tree).values()) if tree else []
        whole = 1.0
        for key, (what, sure) in seen.items():
            if what != "unknown":
                phases = [x[4] for x in now if x[2] == key]
                whole *= sure * self._chance(phases, what) + (1.0 - sure) / 3
        return whole

    def _chance(self, phases: list[Any], what: str) -> float:
        m = self.model
        table = {"holds": m.spurious, "neither": 1 - 2 * m.spurious, "contrary": m.spurious}
        if any(isinstance(p, int) for p in phases):
            table = {
                "holds": 1 - m.missing - m.spurious,
                "neither": m.missing,
                "contrary": m.spurious,
            }
        elif FAIL in phases or LOST in phases:
            table = {
                "holds": m.spurious,
                "neither": m.missing,
                "contrary": 1 - m.missing - m.spurious,
            }
        return table[what]

    def told(
        self, stream: list[tuple[float, Mapping[str, tuple[str, float]]]], most: int
    ) -> list[dict[tuple[str, str], float]]:
        """For each step the probability of each stage and status, given all that was seen.

        Args:
            stream: (seconds since the step before, what is seen) of each step.
            most: When there are more histories than this it stops; fewer steps are told.
        """
        histories: list[tuple[Tree | None, float]] = self.begin()
        found: list[dict[tuple[str, str], float]] = []
        for dt, seen in stream:
            if dt > 0:
                grown: list[tuple[Tree | None, float]] = []
                for tree, weight in histories:
                    grown += [(new, weight * p) for new, p in self.after(tree, dt) if p > 0]
                    if len(grown) > most:
                        return found
                histories = grown
            histories = [(t, w * self.likelihood(t, seen)) for t, w in histories]
            found.append(_summed(histories))
        return found

    def hopes(self, least: float = 1e-9, most: int = 300) -> tuple[float, float]:
        """Probability that the task ends well, counted along all courses; and what is left open.

        Args:
            least: So little may be left open.
            most: With more courses than this under way at once it stops too.
        """
        open_ends: dict[Tree, float] = {}
        fate = {seconds: self.fate(seconds) for seconds in (None, *_spans(self.rules))}
        good = 0.0
        for tree, share in self.begin():
            if tree is None:
                good += share
            else:
                open_ends[tree] = open_ends.get(tree, 0.0) + share
        while len(open_ends) <= most:
            grown: dict[Tree, float] = {}
            for tree, mass in open_ends.items():
                ways, now = self.rules.ways(tree), leaves(tree)
                lefts = [left for _, left in ways]
                groups = len(set(lefts))
                for new, left in ways:
                    fates = math.prod(fate[now[p][3]] for p in left)
                    part = mass * fates / lefts.count(left) / groups
                    if new is None:
                        good += part
                    else:
                        grown[new] = grown.get(new, 0.0) + part
            open_ends = grown
            if sum(grown.values()) < least:
                break
        return good, sum(open_ends.values())

    def fate(self, seconds: float | None) -> float:
        """Probability that a step is left and not lost, summed over how often it fails and recovers."""
        gone = 0.0
        mass: dict[Any, float] = {WAIT: 1.0}
        for _ in range(5_000):
            grown: dict[Any, float] = {}
            for phase, p in mass.items():
                leaf = ("at", "", "", seconds, phase)
                leaving, exits = self.leaving(leaf), self.exits(leaf)
                total = leaving + sum(rate for _, rate in exits)
                gone += p * leaving / total if total else 0.0
                for to, rate in exits:
                    grown[to] = grown.get(to, 0.0) + p * rate / total
            mass = {k: v for k, v in grown.items() if k != LOST and v > 1e-16}
            if not mass:
                break
        return gone


def _spans(rules: Rules) -> set[float]:
    """The seconds of every `for`."""
    todo, found = list(rules.stages.values()), set()
    while todo:
        expr = todo.pop()
        todo += [part for part in expr[1:] if isinstance(part, tuple)]
        found |= {expr[2]} if expr[0] == "hold" else set()
    return found


def _race(stays: Any, exits: list[tuple[Any, float]], dt: float) -> list[tuple[Any, float]]:
    total = sum(rate for _, rate in exits)
    stay = math.exp(-total * dt)
    return [(stays, stay), *((to, (1 - stay) * rate / total) for to, rate in exits if total > 0)]


def _summed(histories: list[tuple[Tree | None, float]]) -> dict[tuple[str, str], float]:
    whole = sum(w for _, w in histories)
    found: dict[tuple[str, str], float] = {}
    for tree, weight in histories:
        for told in {_named(x) for x in leaves(tree).values()} if tree else {("", "done")}:
            found[told] = found.get(told, 0.0) + weight / whole
    return found


def _named(leaf: Tree) -> tuple[str, str]:
    names = {WAIT: "active", FAIL: "failing", LOST: "failed"}
    return leaf[1], names.get(leaf[4], "progressing")
