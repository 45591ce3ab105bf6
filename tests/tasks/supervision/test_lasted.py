"""What must hold `for` a while: from when it began to hold, and `(... for 2 s)` within a condition."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.tasks.scripted import ARM, SATELLITE, RelationSpan, Script, task_of, watch
from visup.agent import Truth, Verdict
from visup.tasks.grammar.parser import read
from visup.tasks.supervision.supervise import finish

HOLD = """
<t>    ::= <come> <hold>
<come> ::= converging(arm, satellite)
<hold> ::= coupled(arm, satellite) for 1 s
"""
DOCK = "<dock> ::= converging(arm, satellite) ends when {}"
tenths = st.integers(10, 90).map(lambda n: n / 10)


@settings(max_examples=15)
@given(st.lists(st.tuples(tenths, tenths), max_size=3))
def test_a_duration_alone_equals_that_of_the_stage(spans: list[tuple[float, float]]) -> None:
    script = Script([RelationSpan("touching", start, start + lasts) for start, lasts in spans])
    texts = ("touching(arm, satellite) for 2 s", "(touching(arm, satellite) for 2 s)")
    separate, nested = (task_of(watch(script, 12.0, DOCK.format(t), fps=5.0)) for t in texts)
    assert (separate.verdict, separate.confidence) == (nested.verdict, nested.confidence)


@pytest.mark.parametrize(
    ("condition", "good"),
    [
        ("(touching(arm, satellite) for 2 s) and not coupled(arm, satellite)", True),
        ("(touching(arm, satellite) for 4 s) and not coupled(arm, satellite)", False),
        ("not (touching(arm, satellite) for 4 s) and coupled(arm, satellite)", True),
        ("(coupled(arm, satellite) for 4 s) or (touching(arm, satellite) for 2 s)", True),
    ],
)
def test_a_duration_can_be_part_of_a_condition(condition: str, good: bool) -> None:
    script = Script(
        [
            RelationSpan("converging", 0.5, 3.0),
            RelationSpan("touching", 3.0, 6.0),
            RelationSpan("coupled", 6.5, 8.0),
        ]
    )
    played = watch(script, 10.0, DOCK.format(condition), fps=5.0)
    assert (finish(task_of(played)) is Verdict.SUCCEEDED) == good


def test_a_duration_in_a_condition_is_printed_and_parsed_back() -> None:
    text = DOCK.format("not (touching(a, b) and seen(a) for 2 s) or (seen(b) for wait)")
    assert str(read(text)) == text


@given(st.integers(0, 6), st.integers(2, 20))
def test_a_duration_counts_from_its_onset_even_if_confirmed_late(late: int, lasts: int) -> None:
    """The two meet at 2.9 s; that they are coupled is doubtful at first; then one leaves the picture."""
    until = 3.0 + lasts / 10
    script = Script(
        [
            RelationSpan("converging", 0.5, 2.9),
            RelationSpan("touching", 2.9, until),
            RelationSpan("coupled", 3.0, 3.0 + late / 10, truth=Truth.UNKNOWN),
            RelationSpan("coupled", 3.0, until),
        ],
        objects={ARM: (0.0, until), SATELLITE: (0.0, 1e9)},
    )
    succeeded = finish(task_of(watch(script, 7.0, HOLD))) is Verdict.SUCCEEDED
    # The frame in which it begins and the one in which it leaves may count or not.
    assert succeeded if lasts >= 13 else not succeeded or lasts > 10


@pytest.mark.parametrize(("hidden", "good"), [((9.0, 9.1), True), ((3.5, 4.4), False)])
def test_unobserved_time_does_not_count(hidden: tuple[float, float], good: bool) -> None:
    script = Script(
        [
            RelationSpan("converging", 0.5, 2.9),
            RelationSpan("touching", 2.9, 4.7),
            RelationSpan("coupled", 3.0, 4.7),
        ],
        objects={ARM: (0.0, 4.7), SATELLITE: (0.0, 1e9)},
        hidden={ARM: hidden},
    )
    assert (finish(task_of(watch(script, 7.0, HOLD))) is Verdict.SUCCEEDED) == good


@pytest.mark.parametrize(("until", "good"), [(3.2, False), (3.8, True)])
def test_time_before_the_stage_does_not_count(until: float, good: bool) -> None:
    """Both hold from 0.5 s on; the first stage takes until 2.5 s, so the second one until 3.5 s."""
    text = """
    <t>    ::= <meet> <hold>
    <meet> ::= touching(arm, satellite) for 2 s
    <hold> ::= already coupled(arm, satellite) for 1 s
    """
    script = Script(
        [RelationSpan("touching", 0.5, until), RelationSpan("coupled", 0.5, until)],
        objects={ARM: (0.0, until), SATELLITE: (0.0, 1e9)},
    )
    assert (finish(task_of(watch(script, 7.0, text))) is Verdict.SUCCEEDED) == good
