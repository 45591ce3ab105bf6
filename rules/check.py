"""Whether the names, arguments and units of rules make sense: every fault, with its place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from difflib import get_close_matches

from visup.agent.errors import Place, RuleError
from visup.rules.facts import KINDS, QUANTITIES, RELATION_NAMES, WORDS
from visup.rules.formula import (
    DIMENSION,
    Comparison,
    For,
    Formula,
    Measure,
    Number,
    Predicate,
    Rule,
    Span,
    atoms,
    children,
)
from visup.rules.sentences import mentions


def faults(rules: tuple[Rule, ...], text: str, file: str) -> list[RuleError]:
    """All faults of meaning of the rules of one file.

    Args:
        rules: The rules as they were read.
        text: The text they were read from, for the lines in messages.
        file: Its name.

    Returns:
        The faults, in the order of the rules; empty when all is well.
    """
    checker = _Checker(text.splitlines() or [""], file)
    found = list(checker.twice(rules))
    for rule in rules:
        found += checker.rule(rule)
    return found


class _Checker:
    def __init__(self, lines: list[str], file: str) -> None:
        self.lines = lines
        self.file = file

    def fault(self, span: Span, what: str, expected: str | None, hint: str | None) -> RuleError:
        line = self.lines[span.line - 1] if span.line <= len(self.lines) else ""
        where = Place(self.file, span.line, span.column, line, span.length)
        return RuleError(what, where=where, expected=expected, hint=hint)

    def twice(self, rules: Iterable[Rule]) -> Iterator[RuleError]:
        names: set[str] = set()
        for rule in rules:
            if rule.name in names:
                yield self.fault(
                    rule.span, f"there are two rules '{rule.name}'", None, "rename one of them"
                )
            names.add(rule.name)

    def rule(self, rule: Rule) -> Iterator[RuleError]:
        if len(set(rule.variables)) < len(rule.variables):
            what = f"a variable of '{rule.name}' is named twice"
            yield self.fault(rule.span, what, "distinct names", None)
        yield from self.sentence(rule)
        used: set[str] = set()
        found = [
            fault
            for formula in (rule.when, rule.unless)
            for atom in atoms(formula)
            for fault in self.atom(atom, rule, used)
        ]
        yield from found
        for formula in (rule.when, rule.unless):
            yield from self.durations(formula)
        if rule.hold is not None:
            yield from self.time(rule.hold, "hold")
        # A variable that is missing from a faulty call is no second fault.
        for name in sorted(set(rule.variables) - used) if not found else ():
            what = f"the variable '{name}' of '{rule.name}' is not used"
            hint = "leave it out, or the rule is true for every object"
            yield self.fault(rule.span, what, None, hint)

    def sentence(self, rule: Rule) -> Iterator[RuleError]:
        for word in mentions(rule.say):
            if word != "is" and word not in rule.variables:
                what = (
                    f"the sentence of '{rule.name}' mentions '{word}', which is no variable of it"
                )
                yield self.fault(rule.span, what, _listed((*rule.variables, "is")), None)

    def atom(self, atom: Predicate | Comparison, rule: Rule, used: set[str]) -> Iterator[RuleError]:
        if isinstance(atom, Predicate):
            yield from self.call(atom, rule, used)
            return
        sides = (atom.left, atom.right)
        for side in sides:
            if isinstance(side, Measure):
                yield from self.call(side, rule, used)
        if all(isinstance(side, Number) for side in sides):
            yield self.fault(atom.span, "two numbers are compared", "a quantity on one side", None)
        kinds = [_dimension(side) for side in sides]
        if None not in kinds and kinds[0] != kinds[1]:
            what = f"a {kinds[0]} is compared with a {kinds[1]}"
            expected = _units(next(k for k, s in zip(kinds, sides, strict=True) if _measured(s)))
            yield self.fault(atom.span, what, expected, None)

    def call(self, call: Predicate | Measure, rule: Rule, used: set[str]) -> Iterator[RuleError]:
        used |= set(call.words) & set(rule.variables)
        table = WORDS if isinstance(call, Predicate) else QUANTITIES
        kind = "relation or fact" if isinstance(call, Predicate) else "quantity"
        if call.name not in table:
            other = QUANTITIES if table is WORDS else WORDS
            hint = _close(call.name, table)
            if call.name in other:
                hint = "compare it with a number" if table is WORDS else "it is true or false"
            yield self.fault(call.span, f"there is no {kind} '{call.name}'", _listed(table), hint)
            return
        takes = table[call.name].takes
        if len(takes) != len(call.words):
            what = f"'{call.name}' takes {len(takes)} argument(s), not {len(call.words)}"
            yield self.fault(call.span, what, f"{call.name}({', '.join(takes)})", None)
            return
        for wanted, word in zip(takes, call.words, strict=True):
            yield from self.argument(call, wanted, word, rule)
        names = [w for w, t in zip(call.words, takes, strict=True) if t == "object"]
        if len(set(names)) < len(names):
            yield self.fault(call.span, f"'{call.name}' is asked of one object twice", None, None)

    def argument(
        self, call: Predicate | Measure, wanted: str, word: str, rule: Rule
    ) -> Iterator[RuleError]:
        known: Iterable[str] = {
            "object": rule.variables,
            "relation": RELATION_NAMES,
            "kind": (*KINDS, word),
            "name": (word,),
        }[wanted]
        if word not in known:
            what = f"'{word}' is no {'variable of the rule' if wanted == 'object' else wanted}"
            yield self.fault(call.span, what, _listed(known), _close(word, known))

    def durations(self, formula: Formula | None) -> Iterator[RuleError]:
        if formula is None:
            return
        if isinstance(formula, For):
            yield from self.time(formula.duration, "for")
        for part in children(formula):
            yield from self.durations(part)

    def time(self, number: Number, word: str) -> Iterator[RuleError]:
        if DIMENSION[number.unit][0] != "time":
            yield self.fault(number.span, f"'{word}' wants a time", "such as 2 s", None)
        elif number.value <= 0:
            yield self.fault(number.span, f"'{word}' wants a time above 0", None, None)


def _dimension(side: Measure | Number) -> str | None:
    if isinstance(side, Number):
        return DIMENSION[side.unit][0]
    return QUANTITIES[side.name].dimension if side.name in QUANTITIES else None


def _measured(side: Measure | Number) -> bool:
    return isinstance(side, Measure)


def _units(dimension: str | None) -> str:
    units = [str(u) or "no unit" for u, (d, _) in DIMENSION.items() if d == dimension]
    return f"a {dimension}: {', '.join(units)}"


def _close(word: str, known: Iterable[str]) -> str | None:
    close = get_close_matches(word, list(known), 1, 0.6)
    return f"did you mean '{close[0]}'?" if close else None


def _listed(words: Iterable[str]) -> str:
    names = list(words)
    return "one of " + ", ".join(names) if len(names) > 1 else "".join(names) or "nothing"
