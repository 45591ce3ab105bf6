"""Approaches that are not to be seen in every view."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tasks.scripted import RelationSpan, Script, play
from visup.agent import Mind, Outcome, Verdict
from visup.tasks.analysis.judging import judged
from visup.tasks.checks.load import parse_task
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.order import Occurrence, frequent_occurrences, with_approaches
from visup.tasks.learning.traces import RunTrace, Symbol, trace_of

BLOCK, BASE, CAP = 1, 2, 3
NAMES = {BLOCK: {"block": 0.9}, BASE: {"base": 0.9}, CAP: {"cap": 0.9}}
PAIR = ("base", "block")
NEARS, MEETS = ("converging", PAIR), ("touching", PAIR)


def run_with_approach(name: str, trend: str = "", *, meets: bool = True) -> RunTrace:
    """A block, then a cap is put on a base; in some views the block does not seem to come nearer."""
    spans = [RelationSpan(trend, 2.0, 6.2, (BLOCK, BASE))] if trend else []
    spans += [RelationSpan("touching", 6.0, 1e9, (BLOCK, BASE))] if meets else []
    spans += [
        RelationSpan("converging", 8.0, 10.2, (CAP, BASE)),
        RelationSpan("touching", 10.0, 1e9, (CAP, BASE)),
    ]
    script = Script(tuple(spans), objects=dict.fromkeys(NAMES, (0.0, 1e9)), identities=NAMES)
    minds: list[Mind] = []

    def keep(mind: Mind, observation: object) -> Outcome:
        minds.append(mind)
        return Outcome(mind)

    play(keep, script, 16.0, fps=5.0)
    return trace_of(name, minds)


def test_an_approach_in_two_of_three_runs_is_required_and_may_be_hidden() -> None:
    learned = learn_task(
        "put",
        [
            run_with_approach("a", "converging"),
            run_with_approach("b"),
            run_with_approach("c", "converging"),
        ],
    )
    assert "<approach_base_block> ::= converging(base, block)" in learned.text
    assert "in 2 of 3 runs" in learned.text
    assert set(learned.good.values()) == {Verdict.SUCCEEDED}
    task = parse_task(learned.text)
    for trend in ("converging", ""):
        assert judged(task, run_with_approach("more", trend).minds).verdict is Verdict.SUCCEEDED
    never = run_with_approach("never", "converging", meets=False)
    assert judged(task, never.minds).verdict is not Verdict.SUCCEEDED


@pytest.mark.parametrize(
    "trends", [("converging", "", ""), ("converging", "converging", "diverging")]
)
def test_an_approach_in_few_runs_or_that_would_refuse_a_run_is_not_required(
    trends: tuple[str, ...],
) -> None:
    learned = learn_task(
        "put", [run_with_approach(f"run{k}", trend) for k, trend in enumerate(trends)]
    )
    assert "converging(base, block)" not in learned.text
    assert any(d.startswith("converging(base, block)") for d in learned.dropped)
    assert set(learned.good.values()) == {Verdict.SUCCEEDED}


symbols = st.tuples(
    st.sampled_from(["converging", "touching", "coupled", "decoupled"]),
    st.sampled_from([("a", "b"), ("a", "c"), ("b", "c")]),
)
words = st.lists(st.lists(symbols, max_size=8).map(tuple), min_size=1, max_size=4)


@given(words)
def test_only_approaches_to_meetings_are_added_and_the_core_is_retained(
    found: list[tuple[Symbol, ...]],
) -> None:
    core, frequent = frequent_occurrences(found, 0.8), frequent_occurrences(found, 0.5)
    both: list[Occurrence] = with_approaches(core, frequent)
    assert [o for o in both if o in core] == core
    met = {o[0][1] for o in core if isinstance(o[0], tuple) and o[0][0] in ("touching", "coupled")}
    assert all(
        o in core or (isinstance(o[0], tuple) and o[0][0] == "converging" and o[0][1] in met)
        for o in both
    )


def test_an_approach_is_added_before_its_meeting() -> None:
    core = [(MEETS, 0)]
    assert with_approaches(core, [(NEARS, 0), (MEETS, 0)]) == [(NEARS, 0), (MEETS, 0)]
    assert with_approaches([(NEARS, 0)], [(NEARS, 0), (("converging", ("a", "b")), 0)]) == [
        (NEARS, 0)
    ]
