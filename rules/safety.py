"""Rules at work: every choice of objects for which a rule is true gives a concern."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import permutations
from math import isnan
from types import MappingProxyType

from visup.agent import Concern, Mind, Observation, Outcome, Relation, Truth
from visup.rules.facts import (
    QUANTITIES,
    RELATION_NAMES,
    WORDS,
    Facts,
    all_true,
    any_true,
    negated,
    truth,
)
from visup.rules.formula import (
    And,
    Comparison,
    For,
    Formula,
    Measure,
    Not,
    Number,
    Predicate,
    Rule,
    atoms,
    children,
)
from visup.rules.sentences import sentence, short, with_names

SAFETY = "rules.safety"


@dataclass(frozen=True, slots=True)
class Run:
    """Since when something has been true, and since when it has at least not been false; seconds."""

    true_since: float | None = None
    not_false_since: float | None = None


@dataclass(frozen=True, slots=True)
class Held:
    """A concern that stays for a while after its rule was last true; `until` in seconds."""

    concern: Concern
    until: float


Key = tuple[str, tuple[int, ...], int]
"""Rule, objects, and the number of the `for` within the rule."""


@dataclass(frozen=True, slots=True)
class Kept:
    """What rules remember: one run for each `for` and choice of objects, and held concerns."""

    runs: Mapping[Key, Run] = field(default_factory=lambda: MappingProxyType({}))
    held: Mapping[tuple[str, frozenset[int]], Held] = field(
        default_factory=lambda: MappingProxyType({})
    )


@dataclass(frozen=True, slots=True)
class RuleThinker:
    """Thinker of the cogitate phase, after relations and couplings.

    It sees the tasks as they stood after the step before, since tasks are matched later.
    """

    rules: tuple[Rule, ...]

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Thinker`."""
        old: Kept = mind.memory.get(SAFETY, Kept())
        facts = Facts(mind)
        runs: dict[Key, Run] = {}
        held: dict[tuple[str, frozenset[int]], Held] = {}
        for rule in self.rules:
            for ids in permutations(sorted(facts.objects), len(rule.variables)):
                judge = Judge(facts, rule, ids, old.runs, runs)
                if judge.verdict() is Truth.TRUE:
                    self._raise(rule, ids, judge, old, held, mind)
        for key, kept in old.held.items():
            if key not in held and kept.until > mind.time:
                held[key] = kept
        mind = mind.remember(SAFETY, Kept(MappingProxyType(runs), MappingProxyType(held)))
        return Outcome(mind, concerns=tuple(h.concern for h in held.values()))

    def _raise(
        self,
        rule: Rule,
        ids: tuple[int, ...],
        judge: Judge,
        old: Kept,
        held: dict[tuple[str, frozenset[int]], Held],
        mind: Mind,
    ) -> None:
        """One concern for each set of objects; its order stays as it was when it was raised."""
        key = (rule.name, frozenset(ids))
        if key in held:
            return
        lasts = rule.hold.base if rule.hold is not None else 0.0
        objects = old.held[key].concern.objects if key in old.held else ids
        cause = sentence(
            mind, with_names(rule.say, rule.variables), *objects, confidence=judge.confidence()
        )
        concern = Concern(rule.name, objects, rule.severity, cause, judge.evidence())
        held[key] = Held(concern, mind.time + lasts)


@dataclass(slots=True)
class Judge:
    """One rule looked at for one choice of objects.

    Attributes:
        facts: The mind as rules see it.
        rule: The rule.
        ids: The objects, in the order of its variables.
        before: Runs of the step before.
        after: Where the runs of this step are put.
    """

    facts: Facts
    rule: Rule
    ids: tuple[int, ...]
    before: Mapping[Key, Run]
    after: dict[Key, Run]
    _fors: int = 0

    def verdict(self) -> Truth:
        """Three-valued truth of the rule: `when`, and not surely `unless`."""
        when = self.truth(self.rule.when)
        if self.rule.unless is None:
            return when
        suspended = self.truth(self.rule.unless) is Truth.TRUE
        return Truth.FALSE if suspended else when

    def truth(self, formula: Formula) -> Truth:
        """Truth of a formula (Kleene); every `for` in it takes note of this step, true or not."""
        if isinstance(formula, Predicate):
            return self._predicate(formula)
        if isinstance(formula, Comparison):
            return self._comparison(formula)
        if isinstance(formula, Not):
            return negated(self.truth(formula.part))
        if isinstance(formula, For):
            return self._for(formula)
        join, decided = (
            (all_true, Truth.FALSE) if isinstance(formula, And) else (any_true, Truth.TRUE)
        )
        result = negated(decided)
        for part in children(formula):
            if result is not decided or _remembers(part):
                result = join((result, self.truth(part)))
        return result

    def _predicate(self, atom: Predicate) -> Truth:
        word = WORDS[atom.name]
        return word.look(self.facts, *self._arguments(word.takes, atom.words))

    def value(self, side: Measure | Number) -> float:
        """A quantity in its base unit; NaN when unknown."""
        if isinstance(side, Number):
            return side.base
        quantity = QUANTITIES[side.name]
        return quantity.look(self.facts, *self._arguments(quantity.takes, side.words))

    def _comparison(self, atom: Comparison) -> Truth:
        left, right = self.value(atom.left), self.value(atom.right)
        if isnan(left) or isnan(right):
            return Truth.UNKNOWN
        return truth(
            {
                "<": left < right,
                "<=": left <= right,
                ">": left > right,
                ">=": left >= right,
            }[atom.operator]
        )

    def _for(self, formula: For) -> Truth:
        """True when the part was true all that time, unknown when it only was never false."""
        key = (self.rule.name, self.ids, self._fors)
        self._fors += 1
        now, part = self.facts.mind.time, self.truth(formula.part)
        old = self.before.get(key, Run())
        run = Run(
            (now if old.true_since is None else old.true_since) if part is Truth.TRUE else None,
            (now if old.not_false_since is None else old.not_false_since)
            if part is not Truth.FALSE
            else None,
        )
        if run != Run():
            self.after[key] = run
        least = now - formula.duration.base + 1e-6
        if run.true_since is not None and run.true_since <= least:
            return Truth.TRUE
        if run.not_false_since is not None and run.not_false_since <= least:
            return Truth.UNKNOWN
        return Truth.FALSE

    def _arguments(self, takes: tuple[str, ...], words: tuple[str, ...]) -> tuple[int | str, ...]:
        return tuple(
            self.ids[self.rule.variables.index(word)] if kind == "object" else word
            for kind, word in zip(takes, words, strict=True)
        )

    def confidence(self) -> float:
        """The least confidence of the relations that `when` names and that are true now."""
        return min((r.confidence for r in self._true_relations()), default=1.0)

    def _true_relations(self) -> list[Relation]:
        found = []
        for atom in atoms(self.rule.when):
            if isinstance(atom, Predicate) and atom.name in RELATION_NAMES:
                a, b = self._arguments(("object", "object"), atom.words)
                relation = self.facts.relation(atom.name, int(a), int(b))
                if relation is not None and relation.truth is Truth.TRUE:
                    found.append(relation)
        return found

    def evidence(self) -> tuple[str, ...]:
        """One sentence for each part of `when`: what it says of these objects, and its truth."""
        return tuple(self._told(atom) for atom in atoms(self.rule.when))

    def _told(self, atom: Predicate | Comparison) -> str:
        if isinstance(atom, Predicate):
            return f"{self._named(atom)} is {self._predicate(atom).value}."
        sides = [
            f"{self._named(s)} = {self.value(s):.3g}" if isinstance(s, Measure) else str(s)
            for s in (atom.left, atom.right)
        ]
        return f"{sides[0]} {atom.operator} {sides[1]} is {self._comparison(atom).value}."

    def _named(self, call: Predicate | Measure) -> str:
        objects = dict(zip(self.rule.variables, self.ids, strict=True))
        words = [short(self.facts.mind, objects[w]) if w in objects else w for w in call.words]
        return f"{call.name}({', '.join(words)})"


def _remembers(formula: Formula) -> bool:
    return isinstance(formula, For) or any(_remembers(part) for part in children(formula))
