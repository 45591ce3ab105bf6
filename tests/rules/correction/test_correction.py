"""Least corrections: of a text that lacks words, has others, or is said in plain words."""

from __future__ import annotations

import doctest
from itertools import islice

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lark import Lark
from lark.exceptions import UnexpectedInput

from visup.rules.correction import everyday_phrases, plain_sentences, repair_search
from visup.rules.correction.automaton import END, LrAutomaton, Stack
from visup.rules.correction.local_edits import edits
from visup.rules.correction.repair_search import EditCosts, Replacement, least_cost_repairs
from visup.rules.correction.tokens import Word, terminals_of, tokens_of
from visup.rules.predicates import arguments

PARSER = Lark(
    """
    start: _item ("," _item)*
    _item: NAME | group | pair
    group: "(" start ")"
    pair: NAME "=" NUMBER
    NAME: /[a-z]+/
    NUMBER: /[0-9]+/
    %ignore " "
    """,
    parser="lalr",
)
AUTOMATON = LrAutomaton.of(PARSER, "start")
PUT = {
    "NAME": (2.0, ("x",)),
    "NUMBER": (2.0, ("1",)),
    "COMMA": (1.0, (",",)),
    "LPAR": (1.0, ("(",)),
    "RPAR": (1.0, (")",)),
    "EQUAL": (1.0, ("=",)),
}
ITEMS = st.recursive(
    st.one_of(st.sampled_from("abc"), st.builds("{} = {}".format, st.just("a"), st.integers(0, 9))),
    lambda inner: st.lists(inner, min_size=1, max_size=3).map(lambda some: f"({', '.join(some)})"),
    max_leaves=5,
)
TEXTS = st.lists(ITEMS, min_size=1, max_size=4).map(", ".join)


def meant(words: object, at: int) -> list[Replacement]:
    said = words[at].text if isinstance(words, list) else ""
    return [Replacement(1, ("COMMA",), ",", 0.1)] if said == ";" else []


SPELLER = EditCosts(AUTOMATON, terminals_of(PARSER), PUT, lambda word: 1.0, meant)


def first_corrections(text: str, since: int = 0, readings: int = 3000) -> list[str]:
    left = iter(range(readings))
    found = least_cost_repairs(text, since, SPELLER, lambda: next(left, None) is not None)
    return [repair.applied(text) for repair in islice(found, 5)]


def is_read(text: str) -> bool:
    try:
        PARSER.parse(text)
    except UnexpectedInput:
        return False
    return True


@given(TEXTS)
def test_the_automaton_takes_what_the_parser_takes(text: str) -> None:
    stack: Stack | None = AUTOMATON.initial
    for word in tokens_of(text, terminals_of(PARSER)):
        assert stack is not None
        stack = AUTOMATON.step(stack, word.terminals[0])
    assert stack is not None
    assert AUTOMATON.step(stack, END) is not None


@settings(max_examples=60)
@given(TEXTS, st.data())
def test_a_text_that_lost_a_word_is_brought_into_the_grammar(
    text: str, data: st.DataObject
) -> None:
    words = list(tokens_of(text, terminals_of(PARSER)))
    lost: Word = data.draw(st.sampled_from(words))
    broken = text[: lost.begin] + text[lost.end :]
    if not is_read(broken):
        found = first_corrections(broken)
        assert found
        assert all(map(is_read, found))


@settings(max_examples=60)
@given(TEXTS, st.data())
def test_a_word_too_many_is_left_out_again(text: str, data: st.DataObject) -> None:
    word = data.draw(st.sampled_from(list(tokens_of(text, terminals_of(PARSER)))))
    broken = f"{text[: word.begin]} % {text[word.begin :]}"
    assert text.replace(" ", "") in [found.replace(" ", "") for found in first_corrections(broken)]


def test_what_is_meant_comes_before_what_costs_more() -> None:
    assert first_corrections("a; b")[0] == "a, b"
    assert first_corrections("(a, b")[:2] == ["(a, b)", "(a), b"]


def test_nothing_is_changed_before_where_it_may_be() -> None:
    assert all(found.startswith("a, (b") for found in first_corrections("a, (b c", since=6))


def test_it_stops_when_it_may_not_go_on() -> None:
    assert first_corrections("a b c ( ( (", readings=3) == []


def test_words_know_their_place_and_what_they_may_be() -> None:
    found = list(tokens_of("ab = 1 ?", terminals_of(PARSER)))
    assert [(w.begin, w.text, w.terminals) for w in found] == [
        (0, "ab", ("NAME",)),
        (3, "=", ("EQUAL",)),
        (5, "1", ("NUMBER",)),
        (7, "?", ()),
    ]


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("the arm holds the part", ("holds", "arm", "part")),
        ("arm is held by part", ("held", "arm", "part")),
        ("holds arm part", ("holds", "arm", "part")),
        ("arm and part holds", ("holds", "arm", "part")),
        ("holds between arm and part", ("holds", "arm", "part")),
    ],
)
def test_plain_sentences_say_what_calls_say(said: str, meant: tuple[str, ...]) -> None:
    def verb(word: str, things: int) -> str | None:
        return word if word in ("holds", "held") and things == 2 else None

    words = said.removeprefix("the ").split()
    assert meant in [call for _, call in plain_sentences.sentences(words, ["arm", "part"], verb)]


def test_a_call_is_offered_without_one_of_its_arguments_and_without_itself() -> None:
    line = "abs(speed(a), speed(b)) > 3"
    offered = {repair.applied(line) for repair in edits(line, 0, 23, (), unread=False)}
    assert "abs(speed(a)) > 3" in offered
    assert "speed(b) > 3" in offered


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (("named", ["satellite", "a"], ["object", "name"]), "named(a, satellite)"),
        (("along_x", ["a", "b", "before"], ["allen", "object", "object"]), "along_x(before, a, b)"),
        (("touching", ["a"], ["object", "object"]), "touching(a, b)"),
        (("tpcc", ["a"], ["tpcc", *["object"] * 3]), "(exists c: tpcc(csf, a, b, c))"),
    ],
)
def test_arguments_are_rearranged_to_fit(
    call: tuple[str, list[str], list[str]], meant: str
) -> None:
    assert arguments.rearranged_call(*call, ["a", "b"]) == meant


@pytest.mark.parametrize("module", [repair_search, plain_sentences, everyday_phrases, arguments])
def test_doctests_of_correction_hold(module: object) -> None:
    assert doctest.testmod(module).failed == 0  # type: ignore[arg-type]
