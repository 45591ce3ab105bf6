"""The rule language: laws on random rules, good and bad sentences as tables."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.oracles.rule_formulas import random_formula
from visup.agent import Severity
from visup.agent.model.errors import ErrorGroup, RuleError, SourceLocation
from visup.rules.formula.nodes import (
    ZERO,
    And,
    Comparison,
    Formula,
    FutureOperator,
    Last,
    Literal,
    MOfN,
    Not,
    Or,
    PastOperator,
    Predicate,
    Previous,
    Quantified,
    Rule,
    Since,
    TimeWindow,
    Until,
)
from visup.rules.formula.terms import Arithmetic, Measure, PointwiseFunction, Term, WindowFunction
from visup.rules.formula.units import SHARE, UNITS, Number, Unit
from visup.rules.language import rule_builder as build
from visup.rules.language.parser import load_rules, parse_formula, parse_rules, shipped_rules
from visup.rules.language.rule_builder import (
    always,
    exists,
    fact,
    number,
    percent,
    px,
    px_s,
    quantity,
)
from visup.rules.language.rule_builder import s as seconds
from visup.rules.monitoring.cost import cost_of
from visup.rules.predicates.snapshot import RELATION_NAMES
from visup.rules.predicates.vocabulary import PREDICATES, QUANTITIES, signals

durations = st.builds(
    Number,
    st.integers(1, 500).map(lambda n: n / 10),
    st.sampled_from([Unit.S, Unit.MS]),
)
windows = st.builds(lambda d: TimeWindow(ZERO, d), durations) | st.builds(
    lambda n, m: TimeWindow(Number(n / 4, Unit.S), Number((n + m) / 4, Unit.S)),
    st.integers(1, 20),
    st.integers(0, 20),  # 0: a window of one moment
)


def arguments(kinds: tuple[str, ...]) -> tuple[str, ...]:
    objects = iter("ab")
    other = {"relation": "converging", "kind": "region", "name": "probe", "zone": "bay"}
    other |= {"signal": "battery", "word": "auto", "allen": "before", "tpcc": "csf"}
    return tuple(next(objects) if t == "object" else other[t] for t in kinds)


of_two = sorted(n for n, word in PREDICATES.items() if word.argument_kinds.count("object") <= 2)
predicates = st.sampled_from(of_two).map(
    lambda name: Predicate(name, arguments(PREDICATES[name].argument_kinds))
)


@st.composite
def comparisons(draw: st.DrawFn) -> Comparison:
    name = draw(st.sampled_from(sorted(QUANTITIES)))
    dimension = QUANTITIES[name].dimension
    units = [u for u, (d, _) in UNITS.items() if d == dimension]
    if dimension == SHARE:  # a plain number is never compared in per cent, a share always is here
        units = [Unit.NONE if QUANTITIES[name].plain else Unit.PERCENT]
    unit = draw(st.sampled_from(units))
    bound = Number(draw(st.integers(-300, 300)) / 4, unit)
    operator = draw(st.sampled_from(["<", "<=", ">", ">=", "==", "!="]))
    slack = draw(st.integers(0, 20)) / 2 * (-1 if ">" in operator else 1)
    leave = (
        Number(bound.value + slack, unit) if draw(st.booleans()) and operator[0] in "<>" else None
    )
    left = Measure(name, arguments(QUANTITIES[name].argument_kinds))
    terms: list[Term] = [
        left,
        Arithmetic(left, "-", Number(2.0, unit)),
        Arithmetic(Number(3.0), "*", Arithmetic(left, "+", left)),
        Arithmetic(Arithmetic(left, "/", Number(2.0)), "-", Arithmetic(left, "-", left)),
        PointwiseFunction("max", (left, Number(1.0, unit))),
        PointwiseFunction("abs", (left,)),
        PointwiseFunction("sqrt", (PointwiseFunction("power", (left, Number(2.0))),)),
        WindowFunction("lowest", left, Number(2.0, Unit.S)),
    ]
    return Comparison(draw(st.sampled_from(terms)), operator, bound, leave)


def joined(inner: st.SearchStrategy[Formula]) -> st.SearchStrategy[Formula]:
    several = st.lists(inner, min_size=2, max_size=3).map(tuple)
    kinds = st.sampled_from(["always", "once"])
    ahead = st.sampled_from(["eventually", "henceforth"])
    near = Predicate("touching", ("a", "c"))
    return st.one_of(
        st.builds(Not, inner),
        st.builds(And, several),
        st.builds(Or, several),
        st.builds(PastOperator, kinds, inner, st.none() | windows),
        st.builds(FutureOperator, ahead, inner, windows),
        st.builds(Since, inner, inner, st.none() | windows),
        st.builds(Until, inner, inner, windows),
        st.builds(Previous, inner),
        st.builds(lambda f, value: And((f, Literal(value))), inner, st.booleans()),
        st.builds(MOfN, inner, st.just(Number(60.0, Unit.PERCENT)), durations),
        st.builds(MOfN, inner, st.just(Number(3.0)), st.just(Number(5.0))),
        st.builds(Last, inner, durations),
        st.builds(
            lambda kind, f, again: Quantified(kind, "c", And((near, f)), again),
            st.sampled_from(["exists", "forall"]),
            predicates,
            st.booleans(),
        ),
    )


formulas: st.SearchStrategy[Formula] = st.recursive(
    predicates | comparisons(), joined, max_leaves=6
)

BOTH = Predicate("converging", ("a", "b"))
rules = st.builds(
    lambda when, unless, hold, cooldown, severity, again: Rule(
        "some_rule",
        ("a", "b"),
        severity,
        And((BOTH, when)),
        "{a} {is} near {b}.",
        unless,
        hold,
        cooldown,
        again,
    ),
    formulas,
    st.none() | formulas,
    st.none() | durations,
    st.none() | durations,
    st.sampled_from(list(Severity)),
    st.sampled_from([(), ("b",)]),
)


@settings(max_examples=120, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(rules)
def test_a_rule_printed_is_the_rule_read(rule: Rule) -> None:
    assert parse_rules(str(rule)) == (rule,)


def test_shipped_rules_print_back_too() -> None:
    shipped = shipped_rules()
    assert parse_rules("\n".join(map(str, shipped))) == shipped
    assert {"collision_course", "unexpected_object"} <= {r.name for r in shipped}


def test_random_formulas_of_signals_print_back() -> None:
    from random import Random

    for seed in range(300):
        formula = random_formula(Random(seed), 3)
        plain = parse_formula(str(formula), signals("x", "y")) if _sound(formula) else formula
        assert plain == formula


def _sound(formula: Formula) -> bool:
    """Whether its units fit: rates do not compare with plain numbers."""
    try:
        parse_formula(str(formula), signals("x", "y"))
    except (RuleError, ErrorGroup):
        return False
    return True


def wrap(when: str, head: str = "rule r(a, b): info", say: str = '"{a} {b}"') -> str:
    return f"{head}\n    when {when}\n    say {say}\n"


BAD = [
    (wrap("convergin(a, b)"), "no relation or fact 'convergin'", "mean 'converging'", 2, 10),
    (wrap("converging(a)"), "takes 2 argument(s), not 1", "converging(object, object)", 2, 21),
    (wrap("converging(a, a) and seen(b)"), "given the same object twice", "", 2, 24),
    (wrap("converging(a, c) and seen(b)"), "'c' is not a variable", "one of a, b", 2, 24),
    (wrap("gap(a, b) < 3 s"), "a length is compared with a time", "a length: px", 2, 10),
    (wrap("gap(a, b) < 3"), "a length is compared with a number", "a length: px", 2, 10),
    (wrap("gapp(a, b) < 3 px"), "no quantity 'gapp'", "did you mean 'gap'?", 2, 10),
    (wrap("gap(a, b)"), "no relation or fact 'gap'", "compare it with a number", 2, 10),
    (wrap("touching(a, b) for 2 px"), "'for' needs a time", "such as 2 s", 2, 29),
    (wrap("touching(a, b) for 0 s"), "'for' needs a time above 0", "", 2, 29),
    (wrap("seen(a)"), "the variable 'b' of 'r' is not used", "leave `b` out", 1, 9),
    (wrap("touching(a, b)", say='"{c}"'), "mentions 'c'", "one of a, b, is", 3, 11),
    (wrap("expected(near, a, b)"), "'near' is not a relation", "one of converging", 2, 19),
    (wrap("touching(a, b) and"), "'say' does not belong here", "leave `and` out", 2, 25),
    (wrap("touching(a b)"), "',' is missing", "')' or ','", 2, 20),
    (wrap("touching(a, b)", "rule r(a, b): warnin"), "'warnin'", "write `warning` in place", 1, 15),
    (wrap("touching(a, b)", "rule r(a, b) info"), "':' is missing", "':'", 1, 13),
    (wrap("touching(a, b)", "rul r(a, b): info"), "'rul' does not belong", "'rule'", 1, 1),
    (wrap("touching(a, b)", say="near"), "'near' does not belong", "double quotes", 3, 5),
    (wrap("5 px > 3 px and touching(a, b)"), "two numbers are compared", "a quantity on one side", 2, 10),
    (wrap("sqrt(gap(a, b)) < 3 px"), "has no square root", "square of something", 2, 10),
    (wrap("exp(gap(a, b)) < 3"), "an exponent is a length", "divide it", 2, 10),
    (wrap("gap(a, b) == 3 px leave 2 px"), "makes no sense after '=='", "<, <=, > or >=", 2, 34),
    (wrap("rising(touching(a, b), 3)"), "'rising' takes one formula", "rising(touching", 2, 31),
    ("rule r(a): info\n    when seen(a)\n", "ends too early", "'say'", 2, 17),
    (wrap("gap(a, b) + 3 s < 3 px"), "a length is added to a time", "a length: px", 2, 20),
    (
        wrap("gap(a, b) / closing_speed(a, b) < 3 px"),
        "a time is compared with a length",
        "s, min, h",
        2,
        46,
    ),
    (wrap("gap(a, b) + 3 px"), "is a quantity, neither true nor false", "compare it", 2, 10),
    (wrap("touching(a, b) + 3 px < 5 px"), "no quantity 'touching'", "true or false", 2, 10),
    (wrap("(seen(a) and seen(b)) < 5 px"), "is true or false, not a quantity", "a quantity", 2, 11),
    (wrap("rate(gap(a, b), 2 s) < 5 px"), "a speed is compared with a length", "a speed: px/s", 2, 35),
    (wrap("rate(gap(a, b)) < 5 px/s"), "'rate' takes something and a time", "such as rate", 2, 23),
    (wrap("abs(gap(a, b), 1 px) < 5 px"), "'abs' does not take 2", "abs(gap(a, b))", 2, 23),
    (wrap("gap(a, b) < 5 px leave 3 px"), "ends it where it does not yet begin", "at least 5 px", 2, 33),
    (wrap("gap(a, b) < 5 px leave 9 s"), "'leave' wants a length", "", 2, 33),
    (wrap("eventually touching(a, b)"), "would wait forever", "eventually[5 s]", 2, 10),
    (wrap("seen(a) until seen(b)"), "would wait forever", "until[5 s]", 2, 18),
    (wrap("touching(a, b) for 5 s to 2 s ago"), "a window from 5 s to 2 s is empty", "shorter", 2, 29),
    (wrap("touching(a, b) in 7 of 5 samples"), "cannot be counted", "3 of 5 samples", 2, 28),
    (wrap("touching(a, b) in 120 % of 5 s"), "'120 %' is not a share", "such as 60 %", 2, 28),
    (wrap("exists b: touching(a, b)"), "'b' is already the name", "another name", 2, 10),
    (wrap("touching(a, b) and exists c: seen(a)"), "of 'exists' is not used", "leave `exists c:` out", 2, 29),
    (wrap("gap(a, b) > 3 px for 20 min"), "would keep 244,806 values", "at most 100,000", 1, 6),
    (wrap("exists c: exists d: (touching(a, c) and touching(b, d))"), "looks at 4 objects together",
     "at most 3", 1, 6),
    (wrap("touching(a, b)", "rule r(a, for): info"), "'for' does not belong here", "a name", 1, 11),
    (wrap("touching(a, b)\n    hold 2 px"), "'hold' needs a time", "such as 2 s", 3, 10),
    (wrap("last(touching(a, b), 3) and seen(a)"), "'last' takes something and a time", "", 2, 31),
]  # fmt: skip


@pytest.mark.parametrize(("text", "what", "more", "line", "column"), BAD)
def test_a_mistake_is_told_with_its_place(
    text: str, what: str, more: str, line: int, column: int
) -> None:
    with pytest.raises(RuleError) as caught:
        parse_rules(text, "my.rules")
    message = str(caught.value)
    assert what in message
    assert more in message
    assert isinstance(caught.value.where, SourceLocation)
    assert (caught.value.where.line, caught.value.where.column) == (line, column)
    assert "^" in message


def test_all_mistakes_of_a_file_are_told_at_once_in_the_order_of_the_text() -> None:
    text = wrap("convergin(a, b)") + wrap("touching(a, b") + wrap("gap(a, b) < 1 s")
    text = text.replace("rule r(", "rule q(", 1)
    with pytest.raises(ErrorGroup) as caught:
        parse_rules(text, "my.rules")
    lines = [e.where.line for e in caught.value.errors if isinstance(e.where, SourceLocation)]
    assert lines == [2, 5, 7, 8]  # also what a slip would have hidden: two rules of one name


@pytest.mark.parametrize(
    ("sugar", "plain"),
    [
        ("x() > 0 implies y() > 0", "not x() > 0 or y() > 0"),
        ("x() > 0 implies y() > 0 implies x() > 1", "not x() > 0 or (not y() > 0 or x() > 1)"),
        ("x() > 0 iff y() > 0", "x() > 0 and y() > 0 or not x() > 0 and not y() > 0"),
        ("x() > 0 xor y() > 0", "x() > 0 and not y() > 0 or not x() > 0 and y() > 0"),
        ("x() > 0 release[2 s] y() > 0", "not (not x() > 0 until[2 s] not y() > 0)"),
        ("rising(x() > 0)", "x() > 0 and not previous x() > 0"),
        ("falling(x() > 0)", "previous x() > 0 and not x() > 0"),
        ("x() > 1e-3", "x() > 0.001"),
        ("once[2 s .. 2 s] x() > 0", "x() > 0 within 2 s to 2 s ago"),
    ],
)
def test_what_is_sugar_reads_as_what_it_stands_for(sugar: str, plain: str) -> None:
    known = signals("x", "y")
    assert parse_formula(sugar, known) == parse_formula(plain, known)


def test_two_rules_of_one_name_are_a_mistake() -> None:
    with pytest.raises(RuleError, match="two rules 'r'"):
        parse_rules(wrap("touching(a, b)") * 2)


def test_files_that_cannot_be_read_give_a_clear_word(tmp_path: Path) -> None:
    with pytest.raises(RuleError, match="cannot be read"):
        load_rules(tmp_path / "none.rules")
    (tmp_path / "binary.rules").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(RuleError, match="not text"):
        load_rules(tmp_path / "binary.rules")
    (tmp_path / "good.rules").write_text(wrap("touching(a, b)"))
    assert load_rules(tmp_path / "good.rules")[0].name == "r"


def test_an_empty_file_has_no_rules() -> None:
    assert parse_rules("# nothing here\n") == ()


def test_what_a_rule_costs_is_known_when_it_is_loaded() -> None:
    (rule,) = parse_rules(wrap("eventually[2 s] (gap(a, b) < 3 px until[1 s] touching(a, b))"))
    assert cost_of(rule).delay_s == 3.0
    (facts,) = parse_rules(wrap("touching(a, b) for 20 min"))
    assert cost_of(facts).kept < 10
    (short,), (long,) = (parse_rules(wrap(f"gap(a, b) < 3 px for {n} s")) for n in (1, 10))
    assert 8 < cost_of(long).kept / cost_of(short).kept < 11


def test_python_and_text_give_the_same_tree() -> None:
    text = """
rule crowd(a, b may repeat): critical
    when (gap(a, b) + 3 px < 20 px leave 25 px for 1 s or not touching(a, b) within 1 s to 2 s ago)
        and exists c: (gap(a, c) < 5 px in 60 % of 2 s and abs(speed(a) - speed(c)) < 2 px/s)
        and touching(a, b) since[3 s] seen(a) and last(rate(gap(a, b), 1 s), 2 s) < -3 px/s
    unless always coupled(a, b) in 3 of 5 samples
    hold 2 s
    cooldown 5 s
    say "{a} {is} near {b}."
"""
    gap, speed, touching = quantity.gap, quantity.speed, fact.touching
    close = (gap("a", "b") + px(3) < px(20)).leaving(px(25)).lasting(seconds(1))
    apart = ~touching("a", "b").within(seconds(1), seconds(2))
    near = (gap("a", "c") < px(5)).often(percent(60), seconds(2))
    other = exists("c", near & (abs(speed("a") - speed("c")) < px_s(2)))
    touched = touching("a", "b").since(fact.seen("a"), seconds(3))
    shrinks = gap("a", "b").over("rate", seconds(1)).over("last", seconds(2)) < px_s(-3)
    made = build.rule(
        "crowd", "a b", "critical", (close | apart) & other & touched & shrinks,
        "{a} {is} near {b}.",
        unless=always(fact.coupled("a", "b").often(number(3), number(5))),
        hold=seconds(2), cooldown=seconds(5), may_repeat="b",
    )  # fmt: skip
    assert (made,) == parse_rules(text)
    assert (made,) == parse_rules(str(made))


def test_a_rule_in_python_is_checked_as_one_of_a_file_is() -> None:
    with pytest.raises(RuleError, match="a length is compared with a time"):
        build.rule("r", "a b", "info", quantity.gap("a", "b") < seconds(3), "{a} {b}")


def test_every_relation_is_a_word() -> None:
    assert set(RELATION_NAMES) <= set(PREDICATES)


def test_both_languages_know_the_same_units_and_print_numbers_alike() -> None:
    from visup.tasks.grammar.conditions import bounds_of
    from visup.tasks.grammar.parser import read

    for unit in ("ms", "s", "min", "h"):
        formula = parse_formula(f"x() > 1 for 2 {unit}", signals("x"))
        assert str(formula) == f"x() > 1 for 2 {unit}"
        assert UNITS[unit] == (Number(1.0, unit).dimension, Number(1.0, unit).base)
    body = read("<t> ::= gap(a, b) < 2.5 px").stages[0].body
    assert isinstance(body, Comparison)
    assert bounds_of(body) == (Number(2.5, Unit.PX),)
