"""Tasks learned from runs: what all runs share, in their order; what a bad run alone does is forbidden."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tasks.scripted import RelationSpan, Script, play
from visup.agent import Mind, Outcome, Verdict
from visup.agent.model.errors import TaskError
from visup.tasks import parse_task
from visup.tasks.analysis.coverage import coverage_of, share_covered
from visup.tasks.analysis.judging import judged
from visup.tasks.analysis.languages import difference
from visup.tasks.learning.fitting import fitted_amounts, with_amounts
from visup.tasks.learning.induction import learn_task
from visup.tasks.learning.order import (
    Loop,
    Series,
    Unordered,
    frequent_occurrences,
    leaves_of,
    plan_of,
    with_loops,
)
from visup.tasks.learning.traces import RunTrace, trace_of

ARM, PART, TRAY, CRATE = 1, 2, 3, 4
NAMES = {
    ARM: {"arm": 0.9},
    PART: {"part": 0.9},
    TRAY: {"tray": 0.9},
    CRATE: {"crate": 0.9},
}


def run_of(name: str, spans: Sequence[RelationSpan], until: float = 40.0) -> RunTrace:
    script = Script(tuple(spans), objects=dict.fromkeys(NAMES, (0.0, 1e9)), identities=NAMES)
    minds: list[Mind] = []

    def keep(mind: Mind, observation: object) -> Outcome:
        minds.append(mind)
        return Outcome(mind)

    play(keep, script, until, fps=5.0)
    return trace_of(name, minds)


def pick_run(name: str, seed: int, spoilt: str = "") -> RunTrace:
    """The arm comes to the part, couples, brings it to the tray, lets go."""
    rng = Random(seed)
    t1, t2, t3, t4 = (sum(rng.uniform(2.5, 5.0) for _ in range(k)) for k in (1, 2, 3, 4))
    spans = [
        RelationSpan("converging", 0.6, t1 + 0.4, (ARM, PART)),
        RelationSpan("touching", t1, t4, (ARM, PART)),
        RelationSpan("coupled", t1 + 0.8, t4, (ARM, PART)),
        RelationSpan("converging", t2, t3, (PART, TRAY)),
        RelationSpan("touching", t3, 1e9, (PART, TRAY)),
        RelationSpan("diverging", t4, t4 + 6.0, (ARM, PART)),
    ]
    if rng.random() < 0.5:  # something that some runs have, by the way
        spans.append(RelationSpan("converging", 1.0, 3.0, (CRATE, TRAY)))
    if spoilt == "never":
        spans = spans[:1]
    elif spoilt == "drop":
        spans[2] = RelationSpan("coupled", t1 + 0.8, t2, (ARM, PART))
        spans[1] = RelationSpan("touching", t1, t2, (ARM, PART))
        spans[3:] = [RelationSpan("diverging", t2, t2 + 8.0, (ARM, PART))]
    elif spoilt == "bump":
        spans.append(RelationSpan("touching", t2, t2 + 2.0, (ARM, CRATE)))
    return run_of(name, spans, t4 + 14.0)


@cache
def good_runs() -> list[RunTrace]:
    return [pick_run(f"good{k}", k) for k in range(3)]


@cache
def bad_runs() -> list[RunTrace]:
    return [pick_run("drop", 50, "drop"), pick_run("bump", 51, "bump")]


def test_a_task_learned_from_three_runs_accepts_good_runs_and_refuses_bad_ones() -> None:
    learned = learn_task("bring", good_runs(), bad_runs())
    task = parse_task(learned.text)
    assert set(learned.good.values()) == {Verdict.SUCCEEDED}
    others = [judged(task, pick_run("x", k).minds).verdict for k in range(10, 16)]
    assert others.count(Verdict.SUCCEEDED) == 6
    kinds = ("never", "drop", "bump")
    bad = [judged(task, pick_run("x", 30 + k, kinds[k % 3]).minds).verdict for k in range(6)]
    assert Verdict.SUCCEEDED not in bad
    assert all(v is not Verdict.SUCCEEDED for v in learned.bad.values())
    assert "never touching(arm, crate)" in learned.text
    assert "in 3 of 3 runs" in learned.text
    assert "crate, tray" not in learned.text  # some runs had it only


def test_a_learned_task_resembles_a_handwritten_one() -> None:
    learned = parse_task(learn_task("bring", good_runs()).text)
    written = parse_task(
        "<bring> ::= <approach> <grasp> <carry> <place> <release>\n"
        "<approach> ::= converging(arm, part)\n<grasp> ::= coupled(arm, part)\n"
        "<carry> ::= converging(part, tray)\n<place> ::= touching(part, tray)\n"
        "<release> ::= decoupled(arm, part)"
    )
    found = difference(learned, written)
    courses = [c for c in (found.only_first, found.only_second) if c is not None]
    assert len(courses) <= 2
    assert all(len(c) >= 4 for c in courses)


def wiping_run(name: str, times: int, every_s: float = 3.0, seed: int = 0) -> RunTrace:
    """The arm touches the tray again and again, then holds the part."""
    rng, at, spans = Random(seed + times), 2.0, []
    for _ in range(times):
        spans.append(RelationSpan("touching", at, at + 1.0, (ARM, TRAY)))
        at += every_s * rng.uniform(0.9, 1.2)
    spans += [RelationSpan(n, at, 1e9, (ARM, PART)) for n in ("touching", "coupled")]
    return run_of(name, spans, at + 8.0)


def test_a_regular_repetition_is_learned_as_a_period() -> None:
    learned = learn_task("wipe", [wiping_run(f"good{n}", n) for n in (5, 7, 6)])
    assert "touching(arm, tray) every 1.5 s to 5.5 s  # every 2." in learned.text
    assert set(learned.good.values()) == {Verdict.SUCCEEDED}
    task = parse_task(learned.text)
    assert judged(task, wiping_run("often", 9).minds).verdict is Verdict.SUCCEEDED
    assert judged(task, wiping_run("slow", 5, 8.0).minds).verdict is not Verdict.SUCCEEDED


def test_a_fixed_count_or_an_irregular_repetition_is_not_a_period() -> None:
    always_five = learn_task("wipe", [wiping_run(f"good{n}", 5, seed=n) for n in range(3)])
    uneven = learn_task("wipe", [wiping_run(f"good{n}", n, 2.5 * n - 9) for n in (5, 7, 6)])
    assert " every " not in always_five.text.replace("# every", "")
    assert " every " not in uneven.text


def test_runs_with_nothing_in_common_are_an_error() -> None:
    with pytest.raises(TaskError, match="nothing in common"):
        learn_task("t", [run_of("idle", ())])


A, B, C, D = (("touching", (n, "top")) for n in "abcd")


def test_only_items_seen_in_both_orders_are_unordered() -> None:
    words = [(A, B, C, D), (A, C, B, D)]
    plan = plan_of(words, frequent_occurrences(words, 1.0))
    assert plan == Series(((A, 0), Unordered(((B, 0), (C, 0))), (D, 0)))


def test_repeats_become_a_loop_if_that_is_shorter() -> None:
    words, times = with_loops([(A, B, C, B, C, B, C, D), (A, B, C, B, C, D)])
    loop = Loop((B, C))
    assert words == [(A, loop, D), (A, loop, D)]
    assert times == {loop: (2, 3)}
    once, none = with_loops([(A, B, A, C)])
    assert (once, none) == ([(A, B, A, C)], {})


@given(st.lists(st.permutations([A, B, C, D]), min_size=1, max_size=5))
def test_a_plan_has_each_occurrence_once_and_every_common_order(
    orders: list[list[object]],
) -> None:
    words = [tuple(o) for o in orders]
    plan = plan_of(words, frequent_occurrences(words, 1.0))  # type: ignore[arg-type]
    found = [o[0] for o in leaves_of(plan)]
    assert set(found) == {A, B, C, D}
    assert len(found) == 4
    for x in words[0]:
        for y in words[0]:
            if x != y and all(w.index(x) < w.index(y) for w in words):
                assert found.index(x) < found.index(y)  # type: ignore[arg-type]


TEXT = """# how a part is brought
<bring> ::= <reach> <grasp> <let_go>   # three stages
<reach> ::= converging(arm, part) within 90 s
<grasp> ::= coupled(arm, part) for 1 s
<let_go> ::= decoupled(arm, part)
"""


def test_fitting_changes_only_durations() -> None:
    task = parse_task(TEXT)
    runs = [judged(task, run.minds) for run in good_runs()]
    fitted = fitted_amounts(task, runs)
    assert next(f.clause for f in fitted) == "within 90 s"
    text = with_amounts(TEXT, fitted)
    assert parse_task(text)
    assert text.splitlines()[:2] == TEXT.splitlines()[:2]
    assert "90 s" not in text
    assert all(judged(parse_task(text), r.minds).verdict is Verdict.SUCCEEDED for r in good_runs())


def test_coverage_names_stages_that_no_run_reached() -> None:
    task = parse_task(
        "<t> ::= <reach> (<grasp> | <miss>)\n<reach> ::= converging(arm, part)\n"
        "<grasp> ::= coupled(arm, part) decoupled(arm, part)\n<miss> ::= diverging(arm, part) for 30 s"
    )
    stages = coverage_of(task, [judged(task, run.minds) for run in good_runs()])
    said = [str(s) for s in stages]
    assert said == [
        "<reach>: done in 3 of 3, never failed",
        "<grasp>: done in 3 of 3, never failed",
        "<miss>: never begun",
    ]
    assert share_covered(stages) == pytest.approx(2 / 3)


SAME = [
    ("<t> ::= <a> <b>\n<a> ::= touching(x, y)\n<b> ::= coupled(x, y)",
     "<other> ::= touching(y, x) <rest>\n<rest> ::= coupled(x, y)"),
    ("<t> ::= any order (touching(a, b), touching(c, d))",
     "<t> ::= touching(a, b) touching(c, d) | touching(c, d) touching(a, b)"),
    ("<t> ::= touching(a, b)+", "<t> ::= touching(a, b) touching(a, b)*"),
]  # fmt: skip
UNLIKE = [
    ("<t> ::= touching(a, b) coupled(a, b)", "<t> ::= coupled(a, b) touching(a, b)",
     "touching(a, b), then coupled(a, b)", "coupled(a, b), then touching(a, b)"),
    ("<t> ::= touching(a, b) coupled(a, b)?", "<t> ::= touching(a, b) coupled(a, b)",
     "touching(a, b)", None),
    ("<t> ::= touching(a, b) & present(a)", "<t> ::= touching(a, b)",
     "present(a) & touching(a, b)", "touching(a, b)"),
]  # fmt: skip


@pytest.mark.parametrize(("one", "two"), SAME)
def test_tasks_with_the_same_language_do_not_differ(one: str, two: str) -> None:
    found = difference(parse_task(one), parse_task(two))
    assert (found.only_first, found.only_second, found.whole) == (None, None, True)


@pytest.mark.parametrize(("one", "two", "first", "second"), UNLIKE)
def test_the_shortest_course_of_only_one_task_is_reported(
    one: str, two: str, first: str, second: str | None
) -> None:
    found = difference(parse_task(one), parse_task(two))
    lines = list(found.lines("A", "B"))
    assert f"only A allows: {first}; B does not" in lines
    assert (second is None) == (found.only_second is None)
    if second is not None:
        assert f"only B allows: {second}; A does not" in lines


def test_different_times_and_invariants_are_reported() -> None:
    one = parse_task("<t> ::= touching(a, b) within 5 s\nnever touching(a, c)\nactor c is red")
    two = parse_task("<t> ::= touching(a, b) within 9 s")
    said = "\n".join(difference(one, two).lines("A", "B"))
    assert "both allow the same courses" in said
    assert "only A has never touching(a, c) (invariants)" in said
    assert "within 9 s" in said


@pytest.mark.parametrize(
    ("more", "what"),
    [
        (" pauses when touching(a, c)", "`touching(a, b) pauses when touching(a, c)` (conditions)"),
        (" fails when gone(b)", "`touching(a, b) fails when gone(b)` (conditions)"),
        (
            "\nzone z is (0, 0) (9, 0) (9, 9)\nnever inside(a, z)",
            "`zone z is (0, 0) (9, 0) (9, 9)`",
        ),
    ],
)
def test_different_conditions_and_places_are_reported(more: str, what: str) -> None:
    one, two = parse_task("<t> ::= touching(a, b)"), parse_task("<t> ::= touching(a, b)" + more)
    found = difference(one, two)
    assert found
    assert any(what in line for line in found.lines("A", "B"))


def test_actions_of_only_one_task_are_named() -> None:
    one = parse_task("<t> ::= (touching(a, b) & moving(b)) fails when apart(b, a)")
    two = parse_task("<t> ::= touching(b, a) coupled(a, b)")
    named = [line for line in difference(one, two).lines("A", "B") if line.endswith("(actions)")]
    assert named == [
        "only A has `apart(a, b)` (actions)",
        "only A has `moving(b)` (actions)",
        "only B has `coupled(a, b)` (actions)",
    ]


PAUSE = "pauses when touching(part, tray)"


@pytest.mark.parametrize(
    ("course", "seconds"),
    [
        (f"touching(arm, part) for 4 s within 90 s {PAUSE}", "3.8"),
        (f"(touching(arm, part) for 4 s {PAUSE}) within 90 s", "13.8"),
    ],
)
def test_pauses_count_towards_a_duration_only_inside_its_clause(course: str, seconds: str) -> None:
    task = parse_task(f"<hold> ::= {course}")
    hold, pause = (
        RelationSpan("touching", 1.0, 30.0, (ARM, PART)),
        RelationSpan("touching", 2.0, 12.0, (PART, TRAY)),
    )
    run = judged(task, run_of("paused", [hold, pause], 20.0).minds)
    assert run.verdict is Verdict.SUCCEEDED
    assert run.paused_s()["hold"] == pytest.approx(10.0, abs=0.5)
    (fitted,) = (f for f in fitted_amounts(task, [run]) if f.clause.startswith("within"))
    assert fitted.seen.startswith(f"1 of 1 runs, {seconds} ")
