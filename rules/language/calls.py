"""Check of calls: relations, facts and quantities with their arguments; every error with a fix."""

from __future__ import annotations

from collections.abc import Iterator

from visup.agent.model.did_you_mean import closest
from visup.rules.formula.nodes import Comparison, Predicate
from visup.rules.formula.terms import Measure
from visup.rules.language.diagnostics import listed, nearest
from visup.rules.language.dimensions import example_amount
from visup.rules.language.synonyms import meant_word, negated_synonym
from visup.rules.language.transform import Fault
from visup.rules.predicates.arguments import (
    EXAMPLES,
    allowed_words,
    fits,
    rearranged_call,
    with_distinct_words,
)
from visup.rules.predicates.definitions import Vocabulary

Call = Predicate | Measure
_KNOWN = ("known", "is_known", "available", "is_available", "has_value")
SHORT_NAME = 2
"""Most characters of what is taken for a misspelt variable of a rule."""


def check_call(call: Call, vocabulary: Vocabulary, scope: tuple[str, ...]) -> Iterator[Fault]:
    """Errors of a name and of its arguments.

    Args:
        call: A relation, fact or quantity with its arguments.
        vocabulary: What there is.
        scope: Variables of the rule that are known here.
    """
    table = vocabulary.predicates if isinstance(call, Predicate) else vocabulary.quantities
    if call.name not in table:
        yield _unknown(call, vocabulary, scope)
        return
    kinds = table[call.name].argument_kinds
    hint = f"write `{rearranged_call(call.name, call.arguments, kinds, scope)}`"
    if len(kinds) != len(call.arguments):
        what = f"'{call.name}' takes {len(kinds)} argument(s), not {len(call.arguments)}"
        yield call.span, what, f"{call.name}({', '.join(kinds)})", hint
        return
    for kind, word in zip(kinds, call.arguments, strict=True):
        for span, what, expected, own in _argument(call, kind, word, scope):
            sorted_out = any(fits(kind, w, scope) for w in call.arguments)
            yield span, what, expected, hint if sorted_out else own
    names = [w for w, t in zip(call.arguments, kinds, strict=True) if t == "object"]
    if len(set(names)) < len(names):
        hint = f"write `{call.name}({', '.join(with_distinct_words(call.arguments, scope))})`"
        what = f"'{call.name}' is given the same object twice"
        yield call.span, what, "two different objects", hint


def _unknown(call: Call, vocabulary: Vocabulary, scope: tuple[str, ...]) -> Fault:
    predicates, quantities = vocabulary.predicates, vocabulary.quantities
    fact = isinstance(call, Predicate)
    table = predicates if fact else quantities
    kind = "relation or fact" if fact else "quantity"
    meant = meant_word(call.name, table)
    hint = f"did you mean '{meant}'?" if meant else None
    if fact and call.name in _KNOWN and len(call.arguments) == 1:
        fact_known = "identified" if call.arguments[0] in scope else "signal_known"
        hint = f"write `{fact_known}({call.arguments[0]})`"
    elif fact and (other := negated_synonym(call.name, call.arguments, predicates)) is not None:
        hint = f"write `{other}`"
    elif call.name in (quantities if fact else predicates):
        hint = _comparison_hint(call, vocabulary) if fact else "it is true or false"
    elif not fact and meant == "objects" and len(call.arguments) == 1:
        hint = f"write `objects_named({call.arguments[0]})`"
    elif call.name in scope and not call.arguments:
        hint = f"write `seen({call.name})` in place of `{call.name}`"
    elif fact and hint is None and not call.arguments and len(call.name) > SHORT_NAME:
        hint = f"write `signal_on({call.name})` in place of `{call.name}`"
    return call.span, f"there is no {kind} '{call.name}'", nearest(call.name, table), hint


def _comparison_hint(call: Call, vocabulary: Vocabulary) -> str:
    """A suggestion for a quantity used as a condition."""
    quantity_text = f"{call.name}({', '.join(call.arguments)})"
    if call.name == "signal":
        return f"write `signal_on({', '.join(call.arguments)})` in place of `{quantity_text}`"
    measured = Measure(call.name, call.arguments, call.span)
    amount = example_amount(Comparison(measured, "<", measured), vocabulary)
    return f"compare it with a number; write `{quantity_text} < {amount}` in place of `{quantity_text}`"


def _argument(call: Call, kind: str, word: str, scope: tuple[str, ...]) -> Iterator[Fault]:
    known = allowed_words(kind, word, scope)
    if word not in known:
        what = f"'{word}' is not a {'variable of the rule' if kind == 'object' else kind}"
        near = closest(word, known) or next((k for k in known if k not in call.arguments), None)
        hint = None if near is None else f"write `{near}` in place of `{word}`"
        yield call.span, what, listed(known), hint
    elif kind != "object" and word in scope:
        what = f"'{word}' is a variable of the rule, but '{call.name}' takes a {kind}"
        other = EXAMPLES.get(kind)
        hint = None if other is None else f"write `{other}` in place of `{word}`"
        yield call.span, what, None, hint or "rename the variable"
