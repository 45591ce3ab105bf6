"""The rule language: laws on random rules, good and bad sentences as tables."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.agent import Severity, Truth
from visup.agent.errors import ManyErrors, Place, RuleError
from visup.rules.facts import RELATION_NAMES
from visup.rules.formula import (
    DIMENSION,
    And,
    Comparison,
    For,
    Formula,
    Measure,
    Not,
    Number,
    Or,
    Predicate,
    Rule,
    Unit,
)
from visup.rules.language import load_rules, parse_rules, shipped_rules

durations = st.builds(
    Number,
    st.integers(1, 500).map(lambda n: n / 10),
    st.sampled_from([Unit.S, Unit.MS, Unit.MIN]),
)


def arguments(takes: tuple[str, ...]) -> tuple[str, ...]:
    objects = iter("ab")
    other = {"relation": "converging", "kind": "region", "name": "probe"}
    return tuple(next(objects) if t == "object" else other[t] for t in takes)


predicates = st.sampled_from(sorted(WORDS)).map(
    lambda name: Predicate(name, arguments(WORDS[name].takes))
)


@st.composite
def comparisons(draw: st.DrawFn) -> Comparison:
    name = draw(st.sampled_from(sorted(QUANTITIES)))
    fitting = [u for u, (d, _) in DIMENSION.items() if d == QUANTITIES[name].dimension]
    number = Number(draw(st.integers(-300, 300)) / 4, draw(st.sampled_from(fitting)))
    left = Measure(name, arguments(QUANTITIES[name].takes))
    return Comparison(left, draw(st.sampled_from(["<", "<=", ">", ">="])), number)


formulas: st.SearchStrategy[Formula] = st.recursive(
    predicates | comparisons(),
    lambda inner: st.one_of(
        st.builds(Not, inner),
        st.builds(lambda p: And(tuple(p)), st.lists(inner, min_size=2, max_size=3)),
        st.builds(lambda p: Or(tuple(p)), st.lists(inner, min_size=2, max_size=3)),
        st.builds(For, inner, durations),
    ),
    max_leaves=8,
)

BOTH = Predicate("converging", ("a", "b"))
rules = st.builds(
    lambda when, unless, hold, severity: Rule(
        "some_rule", ("a", "b"), severity, And((BOTH, when)), "{a} {is} near {b}.", unless, hold
    ),
    formulas,
    st.none() | formulas,
    st.none() | durations,
    st.sampled_from(list(Severity)),
)


@settings(max_examples=150, deadline=None)
@given(rules)
def test_a_rule_printed_is_the_rule_read(rule: Rule) -> None:
    assert parse_rules(str(rule)) == (rule,)


def test_shipped_rules_print_back_too() -> None:
    shipped = shipped_rules()
    assert parse_rules("\n".join(map(str, shipped))) == shipped
    assert {"collision_course", "unexpected_object"} <= {r.name for r in shipped}


values = st.sampled_from(list(Truth))


@given(st.lists(values, max_size=5), values)
def test_kleene(parts: list[Truth], one: Truth) -> None:
    rank = {Truth.FALSE: 0, Truth.UNKNOWN: 1, Truth.TRUE: 2}
    assert rank[all_true(parts)] == min((rank[p] for p in parts), default=2)
    assert rank[any_true(parts)] == max((rank[p] for p in parts), default=0)
    assert negated(negated(one)) is one
    assert negated(all_true(parts)) is any_true(map(negated, parts))
    assert all_true((one, negated(one))) is not Truth.TRUE


def wrap(when: str, head: str = "rule r(a, b): info", say: str = '"{a} {b}"') -> str:
    return f"{head}\n    when {when}\n    say {say}\n"


BAD = [
    (wrap("convergin(a, b)"), "no relation or fact 'convergin'", "mean 'converging'", 2, 10),
    (wrap("converging(a)"), "takes 2 argument(s), not 1", "converging(object, object)", 2, 10),
    (wrap("converging(a, a) and seen(b)"), "asked of one object twice", "", 2, 10),
    (wrap("converging(a, c) and seen(b)"), "'c' is no variable", "one of a, b", 2, 10),
    (wrap("gap(a, b) < 3 s"), "a length is compared with a time", "a length: px", 2, 10),
    (wrap("gap(a, b) < 3"), "a length is compared with a number", "a length: px", 2, 10),
    (wrap("gapp(a, b) < 3 px"), "no quantity 'gapp'", "did you mean 'gap'?", 2, 10),
    (wrap("gap(a, b)"), "no relation or fact 'gap'", "compare it with a number", 2, 10),
    (wrap("touching(a, b) for 2 px"), "'for' wants a time", "such as 2 s", 2, 29),
    (wrap("touching(a, b) for 0 s"), "'for' wants a time above 0", "", 2, 29),
    (wrap("seen(a)"), "the variable 'b' of 'r' is not used", "leave it out", 1, 6),
    (wrap("touching(a, b)", say='"{c}"'), "mentions 'c'", "one of a, b, is", 1, 6),
    (wrap("expected(near, a, b)"), "'near' is no relation", "one of converging", 2, 10),
    (wrap("touching(a, b) and"), "'say' does not belong here", "'not'", 3, 5),
    (wrap("touching(a b)"), "'b' does not belong here", "')' or ','", 2, 21),
    (wrap("touching(a, b)", "rule r(a, b): warnin"), "'warnin'", "mean 'warning'", 1, 15),
    (wrap("touching(a, b)", "rule r(a, b) info"), "'info' does not belong", "':'", 1, 14),
    (wrap("touching(a, b)", "rul r(a, b): info"), "'rul' does not belong", "'rule'", 1, 1),
    (wrap("touching(a, b)", say="near"), "'near' does not belong", "double quotes", 3, 9),
    ("rule r(a): info\n    when seen(a)\n", "ends too early", "'say'", 2, 17),
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
    assert isinstance(caught.value.where, Place)
    assert (caught.value.where.line, caught.value.where.column) == (line, column)
    assert "^" in message


def test_all_mistakes_of_a_file_are_told_at_once_in_the_order_of_the_text() -> None:
    text = wrap("convergin(a, b)") + wrap("touching(a, b") + wrap("gap(a, b) < 1 s")
    text = text.replace("rule r(", "rule q(", 1)
    with pytest.raises(ManyErrors) as caught:
        parse_rules(text, "my.rules")
    lines = [e.where.line for e in caught.value.errors if isinstance(e.where, Place)]
    assert lines == [2, 6, 8]


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


def test_every_relation_is_a_word() -> None:
    assert set(RELATION_NAMES) <= set(WORDS)
