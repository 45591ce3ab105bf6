"""Type checker: names, arguments and units of rules; every error with its location."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Set as AnySet
from itertools import count

from visup.agent.cycle.system_alerts import SYSTEM_ALERTS
from visup.agent.model.did_you_mean import did_you_mean
from visup.rules.correction.everyday_phrases import NUMBERS
from visup.rules.formula.nodes import (
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Let,
    MOfN,
    Node,
    Or,
    PastOperator,
    Predicate,
    Quantified,
    Rule,
    Since,
    TimeWindow,
    Until,
    children,
    walk,
)
from visup.rules.formula.rebuilding import cut_off
from visup.rules.formula.terms import Arithmetic, Measure, Variable, WindowFunction
from visup.rules.formula.units import Number, Span, Unit
from visup.rules.language.calls import SHORT_NAME, check_call
from visup.rules.language.diagnostics import Diagnostic, Source, listed
from visup.rules.language.dimensions import (
    check_constant,
    check_dimensions,
    check_often,
    check_time,
    check_value,
    check_window,
    example_amount,
)
from visup.rules.language.keywords import KEYWORDS
from visup.rules.language.transform import Fault
from visup.rules.monitoring.cost import MAX_STATE, MAX_VARIABLES, cost_of, variables_of
from visup.rules.predicates.definitions import Vocabulary
from visup.rules.predicates.vocabulary import RULES
from visup.rules.wording.sentences import mentions


class TypeChecker:
    """Finds the semantic errors of one text.

    Args:
        text: The source text, for the lines in messages.
        file: Its name.
        vocabulary: The names that formulas may use.
    """

    def __init__(self, text: str, file: str, vocabulary: Vocabulary = RULES) -> None:
        self.source = Source(text, file)
        self.vocabulary = vocabulary

    def fault(self, span: Span, what: str, expected: str | None, hint: str | None) -> Diagnostic:
        """A diagnostic at the location of a node."""
        return self.source.fault("", what, span, expected, hint)

    def twice(self, rules: Iterable[Rule]) -> Iterator[Diagnostic]:
        """Errors for duplicate rule names."""
        names: set[str] = set()
        for rule in rules:
            if rule.name in names:
                what = f"there are two rules '{rule.name}'"
                other = next(n for i in count(2) if (n := f"{rule.name}_{i}") not in names)
                hint = f"write `{other}` in place of `{rule.name}`"
                yield self.fault(rule.span, what, "another name for each rule", hint)
            names.add(rule.name)

    def formula(self, formula: Formula) -> Iterator[Diagnostic]:
        """The errors of a formula."""
        for fault in _FormulaChecker(self.vocabulary, None).node(formula):
            yield self.fault(*fault)

    def rule(self, rule: Rule) -> Iterator[Diagnostic]:
        """The errors of one rule."""
        if not rule.variables and (missing := _objects_in(rule, self.vocabulary)):
            what = f"'{rule.name}' has no variables, but names {', '.join(missing)}"
            hint = f"write `{rule.name}({', '.join(missing)})` in place of `{rule.name}()`"
            if any(len(name) > SHORT_NAME for name in missing):
                certain = f"`named(a, {missing[0]})`"
                hint = f"these stand for any objects; {certain} says that a certain one is meant; {hint}"
            yield self.fault(rule.span, what, "the names of its objects", hint)
            return
        reader = _FormulaChecker(self.vocabulary, rule.variables)
        found = [f for formula in rule.formulas for f in reader.node(formula)]
        found += [f for w in ("hold", "cooldown") for f in check_time(getattr(rule, w), w)]
        found += self._head(rule)
        # A variable missing because of a faulty call is no second error.
        for name in sorted(set(rule.variables) - reader.used) if not found else ():
            what = f"the variable '{name}' of '{rule.name}' is not used"
            hint = f"leave `{name}` out, or the rule is true for every object"
            found.append((rule.span, what, None, hint))
        # The cost of a rule can only be computed if it is otherwise correct.
        for fault in found or self._bounds(rule):
            yield self.fault(*fault)

    def _head(self, rule: Rule) -> Iterator[Fault]:
        if len(set(rule.variables)) < len(rule.variables):
            what = f"a variable of '{rule.name}' is named twice"
            given, apart = ", ".join(rule.variables), ", ".join(dict.fromkeys(rule.variables))
            change = f"write `{rule.name}({apart})` in place of `{rule.name}({given})`"
            yield rule.span, what, "distinct names", change
        for word in (rule.name, *rule.variables):
            if word in KEYWORDS:
                yield rule.span, f"'{word}' is a reserved word", "another name", None
        if rule.name in SYSTEM_ALERTS:
            what = f"'{rule.name}' is an alert of visup about itself"
            own = f"write `my_{rule.name}` in place of `{rule.name}`"
            yield rule.span, what, "another name", own
        for word in mentions(rule.say):
            if word != "is" and word not in rule.variables:
                what = f"the sentence of '{rule.name}' mentions '{word}', which is not one of its variables"
                hint = self._mended_head(rule, word)
                yield rule.span, what, listed((*rule.variables, "is")), hint

    def _mended_head(self, rule: Rule, word: str) -> str | None:
        """The head with a name that the formulas use, too; else another name in the sentence."""
        given = ", ".join(rule.variables)
        if word in _objects_in(rule, self.vocabulary) and len(rule.variables) < MAX_VARIABLES:
            more = f"{given}, {word}" if given else word
            return f"write `{rule.name}({more})` in place of `{rule.name}({given})`"
        # A long word is no misspelt variable: the sentence keeps it as a word.
        unsaid = [v for v in rule.variables if v not in mentions(rule.say)] or [*rule.variables]
        other = f"{{{unsaid[0]}}}" if unsaid and len(word) <= SHORT_NAME else word
        return f"write `{other}` in place of `{{{word}}}`"

    def _bounds(self, rule: Rule) -> Iterator[Fault]:
        together = variables_of(rule)
        if together > MAX_VARIABLES:
            what = f"'{rule.name}' looks at {together} objects together"
            yield rule.span, what, f"at most {MAX_VARIABLES}", "make it two rules"
            return
        kept = cost_of(rule).kept
        if kept > MAX_STATE:
            what = f"'{rule.name}' would keep {kept:,} values for each choice of objects"
            hint = "shorten its windows; `for` and `within` of facts keep one moment only"
            yield rule.span, what, f"at most {MAX_STATE:,}", hint


class _FormulaChecker:
    """Walks formulas; records which variables they use."""

    def __init__(self, vocabulary: Vocabulary, variables: tuple[str, ...] | None) -> None:
        self.vocabulary = vocabulary
        self.of_rule = variables is not None
        self.scope = variables or ()
        self.values: tuple[str, ...] = ()
        self.amount = "0"
        self.used: set[str] = set()

    def node(self, node: Node) -> Iterator[Fault]:
        match node:
            case Predicate() | Measure():
                yield from self.called(node)
            case Quantified():
                yield from self.quantified(node)
                return
            case Let():
                yield from self.let(node)
                return
            case And() | Or() if (loose := cut_off(node, self.unbound)) is not None:
                yield from self.widened(*loose)
                return
            case Variable():
                yield from self.variable(node)
            case Arithmetic(operator="/", left=left, right=Variable(name=Unit.S) as unit):
                what = "'s' is a unit and must directly follow its number"
                yield unit.span, what, "such as 3 px/s", "write `px/s` in place of `px / s`"
                yield from self.node(left)
                return
            case Comparison() if (misread := self.misread(node)) is not None:
                yield misread
                return
            case Comparison():
                yield from check_dimensions(node, self.vocabulary)
                self.amount = example_amount(node, self.vocabulary)
                if self.of_rule:
                    yield from check_constant(node)
            case PastOperator(window=TimeWindow() as window):
                yield from check_window(window, "for" if node.kind == "always" else "within")
            case FutureOperator(window=window, span=span) | Until(window=window, span=span):
                yield from _ahead(node, window, span)
            case Since(window=TimeWindow() as window):
                yield from check_window(window, "since")
            case MOfN():
                yield from check_often(node)
            case Last(duration=duration) | WindowFunction(duration=duration):
                yield from check_time(duration, getattr(node, "name", "last"))
        for part in children(node):
            yield from self.node(part)

    def misread(self, node: Comparison) -> Fault | None:
        """The error of an object or a signal that is compared with a name; None of other comparisons."""
        no = "not " if node.operator == "!=" else ""
        match node.left, node.right:
            case (Variable(name=one), Variable(name=name)) if one in self.scope:
                self.used.add(one)
                what, said = f"'{one}' is an object, and is not compared", f"named({one}, {name})"
            case (Measure() as measure, Number() as number) if measure.name in self.facts:
                return self.fact_compared(measure, number)
            case (Measure(name="signal", arguments=(one,)), Variable(name=name)):
                what, said = "a signal is compared with a word", f"signal_is({one}, {name})"
            case _:
                return None
        if node.operator not in ("==", "!=") or name in (*self.values, *self.scope):
            return None
        return node.span, what, f"`{said}`", f"write `{no}{said}`"

    @property
    def facts(self) -> AnySet[str]:
        """Words that are true or false, and no quantities."""
        return self.vocabulary.predicates.keys() - self.vocabulary.quantities.keys()

    def fact_compared(self, fact: Measure, number: Number) -> Fault:
        """The error of what is true or false and is compared; with a quantity of such numbers, if any."""
        alike = (
            name
            for name, known in self.vocabulary.quantities.items()
            if len(known.argument_kinds) == len(fact.arguments)
            and known.dimension == number.dimension
        )
        words = ", ".join(fact.arguments)
        meant = next(alike, None)
        hint = meant and f"write `{meant}({words})` in place of `{fact.name}({words})`"
        what = f"'{fact.name}' is true or false, and is not compared"
        return fact.span, what, "a quantity", hint

    def widened(self, short: Quantified, rest: Formula, whole: Quantified) -> Iterator[Fault]:
        """A quantifier that ends too early, and the errors within all that it is about."""
        name = short.variable
        what = f"'{short.kind} {name}:' ends before '{name}' is used again"
        hint = f"write `{whole}` in place of `{rest}`"
        yield short.span, what, "parentheses around all that it is about", hint
        self.scope = (*self.scope, name)
        yield from self.node(whole.part)
        self.scope = self.scope[:-1]

    def unbound(self, node: Node) -> set[str]:
        """The objects that a formula names and neither it nor anything around it binds."""
        found = {name for part in children(node) for name in self.unbound(part)}
        if isinstance(node, Predicate | Measure):
            table = (
                self.vocabulary.predicates
                if isinstance(node, Predicate)
                else self.vocabulary.quantities
            )
            kinds = table[node.name].argument_kinds if node.name in table else ()
            found |= {w for w, t in zip(node.arguments, kinds, strict=False) if t == "object"}
        bound = {node.variable} if isinstance(node, Quantified) else set()
        return found - bound - set(self.scope)

    def quantified(self, node: Quantified) -> Iterator[Fault]:
        name, outer = node.variable, self.scope
        if name in outer:
            what, hint = (
                f"'{name}' is already the name of an object",
                f"leave `{node.kind} {name}:` out",
            )
            yield node.span, what, "another name", hint
        if name in KEYWORDS:
            yield node.span, f"'{name}' is a reserved word", "another name", None
        self.scope = (*outer, name)
        found = list(self.node(node.part))
        yield from found
        if name not in self.used and not found:
            what = f"the variable '{name}' of '{node.kind}' is not used"
            yield node.span, what, None, f"leave `{node.kind} {name}:` out"
        self.used.discard(name)
        self.scope = outer

    def let(self, node: Let) -> Iterator[Fault]:
        """Check a `let`: its value, its condition, and its body."""
        name, outer = node.variable, self.values
        if name in (*self.scope, *outer):
            what = f"'{name}' is already the name of {'a value' if name in outer else 'an object'}"
            yield node.span, what, "another name", f"write `value` in place of `{name}`"
        found = [*check_value(node.value, self.vocabulary), *self.node(node.value)]
        found += [*self._noted(node), *self.node(node.at)]
        self.values = (*outer, name)
        found += self.node(node.part)
        yield from found
        self.values = outer
        if name not in self.used and not found:
            what = f"the value '{name}' of 'let' is not used"
            hint = f"leave `let {name} be {node.value} at {node.at}:` out"
            yield node.span, what, None, hint
        self.used.discard(name)

    def _noted(self, node: Let) -> Iterator[Fault]:
        ahead = next((n for n in walk(node.at) if isinstance(n, FutureOperator | Until)), None)
        if ahead is not None:
            what = f"'{node.variable}' cannot be noted before it is known whether it is to be"
            hint = (
                f"write `{ahead.part}` in place of `{ahead}`"
                if isinstance(ahead, FutureOperator)
                else None
            )
            yield ahead.span, what, "what is true now or was", hint

    def variable(self, node: Variable) -> Iterator[Fault]:
        """A bare name among quantities: bound by `let`, or a call without arguments."""
        self.used.add(node.name)
        if node.name in self.values:
            return
        if node.name in self.vocabulary.quantities:
            yield from self.called(Measure(node.name, (), node.span))
            if not self.vocabulary.quantities[node.name].argument_kinds:
                what = f"'{node.name}' is a quantity, and is written with parentheses"
                yield node.span, what, f"{node.name}()", f"write `{node.name}()`"
            return
        what = f"'{node.name}' is a name, not a quantity"
        near = did_you_mean(node.name, (*self.values, *self.vocabulary.quantities))
        if node.name.casefold() in NUMBERS:
            near = f"write `{NUMBERS[node.name.casefold()]}` in place of `{node.name}`"
        elif near is None and not self.values and len(node.name) > SHORT_NAME:
            near = f"write `signal({node.name})` in place of `{node.name}`"
        if near is None:
            meant = self.values[-1] if self.values else self.amount
            near = f"write `{meant}` in place of `{node.name}`"
        expected = "a quantity or a number, or what `let` names"
        yield node.span, what, expected, near

    def called(self, call: Predicate | Measure) -> Iterator[Fault]:
        self.used |= set(call.arguments) & set(self.scope)
        yield from check_call(call, self.vocabulary, self.scope)


def _ahead(node: FutureOperator | Until, window: TimeWindow | None, span: Span) -> Iterator[Fault]:
    """Errors of a window into the future."""
    word = node.kind if isinstance(node, FutureOperator) else "until"
    if window is None:
        what = f"'{word}' without a window would wait forever"
        yield span, what, f"such as {word}[5 s]", f"write `{word}[5 s]` in place of `{word}`"
    else:
        yield from check_window(window, word)


def _objects_in(rule: Rule, vocabulary: Vocabulary) -> list[str]:
    """The names used for objects in a rule, in order."""
    found: list[str] = []
    for node in (n for formula in rule.formulas for n in walk(formula)):
        table = vocabulary.predicates if isinstance(node, Predicate) else vocabulary.quantities
        if isinstance(node, Predicate | Measure) and node.name in table:
            kinds = table[node.name].argument_kinds
            found += [w for w, t in zip(node.arguments, kinds, strict=False) if t == "object"]
    bound = {n.variable for f in rule.formulas for n in walk(f) if isinstance(n, Quantified)}
    return [w for w in dict.fromkeys(found) if w not in bound]
