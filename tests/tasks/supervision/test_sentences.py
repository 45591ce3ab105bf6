"""Until when, or since when, a step that is over is told to have been what it should be."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Status
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.automaton.states import TaskStep
from visup.tasks.supervision.sentences import evidence, in_retrospect, outcome
from visup.tasks.verification.reported_relations import (
    excludes,
    merged_reports,
    since_reported,
    with_reported,
)
from visup.tasks.verification.step_monitor import StepMonitor

NEARED = StepMonitor(1.0, begun=2.3, helped_since=2.0, helped_at=3.0)
HELD = StepMonitor(1.0, begun=3.9, held=True, held_s=4.3, fulfilled=True)
PAIR = ("arm", "part")
PARTED = with_reported((), PAIR, "diverging", 2.4)
COUPLED = with_reported((), PAIR, "coupled", 8.3)


@pytest.mark.parametrize(
    ("action", "monitor", "followed", "denied", "told"),
    [
        ("converging", NEARED, (), None, "converging until 3.0 s"),
        ("converging", NEARED, (2.6,), None, "converging until 2.6 s"),
        # What followed may have begun before it was noticed that they converge, ...
        ("converging", NEARED, (2.2,), None, "converging from 2.0 s to 2.2 s"),
        # ... what had been so before says nothing of the end, ...
        ("converging", NEARED, (1.5,), None, "converging until 3.0 s"),
        # ... nor hides what came after.
        ("converging", NEARED, (1.5, 2.6), None, "converging until 2.6 s"),
        ("coupled", HELD, (), None, "coupled since 3.9 s"),
        ("coupled", HELD, (7.9,), None, "coupled since 3.9 s"),
        ("coupled", HELD, (7.9,), 7.9, "coupled until 7.9 s"),
        ("coupled", HELD, (), 3.0, "coupled since 3.9 s"),
        # What excludes it was told in between: it began anew.
        (
            "converging",
            replace(NEARED, reported=PARTED),
            (),
            None,
            "converging from 2.4 s to 3.0 s",
        ),
        (
            "coupled",
            replace(HELD, reported=with_reported((), PAIR, "diverging", 5.6)),
            (),
            None,
            "since 5.6 s",
        ),
        (
            "coupled",
            replace(HELD, reported=with_reported((), PAIR, "touching", 5.6)),
            (),
            None,
            "since 3.9 s",
        ),
    ],
)
def test_times_of_what_is_over_agree_with_what_follows(
    action: str,
    monitor: StepMonitor,
    followed: tuple[float, ...],
    denied: float | None,
    told: str,
) -> None:
    step = TaskStep(action, ("arm", "part"), "stage")
    status, why = outcome(step, ACTIONS[action], monitor, 8.2, followed, denied)
    assert status is Status.DONE
    assert why.endswith(told)


@pytest.mark.parametrize(
    ("monitor", "told"),
    [
        (StepMonitor(8.3, helped_by="diverging", helped_since=8.1), "diverging since 8.1 s"),
        (
            StepMonitor(8.3, helped_by="diverging", helped_since=8.1, reported=COUPLED),
            "diverging since 8.3 s",
        ),
    ],
)
def test_what_excludes_what_was_told_is_told_to_begin_no_sooner(
    monitor: StepMonitor, told: str
) -> None:
    """Two that were told to be coupled at 8.3 s are not told, later, to have drawn apart since 8.1 s."""
    step = TaskStep("diverging", PAIR, "stage")
    going_on = replace(monitor, status=Status.PROGRESSING)
    assert evidence(step, ACTIONS["diverging"], going_on, 8.5, ACTIONS).endswith(told)
    failing = replace(
        monitor, status=Status.FAILING, contrary="diverging", contrary_since=monitor.helped_since
    )
    step = TaskStep("coupled", PAIR, "stage")
    assert f"{told};" in evidence(step, ACTIONS["coupled"], failing, 8.5, ACTIONS)


def test_a_condition_by_which_a_stage_fails_is_quoted() -> None:
    step = TaskStep("converging", ("part",), "lift")
    apart = StepMonitor(3.0, status=Status.FAILING, contrary="apart(arm, part)", contrary_since=4.7)
    assert evidence(step, ACTIONS["converging"], apart, 5.2, ACTIONS) == (
        "`apart(arm, part)` has held since 4.7 s; stage `lift` fails when it does"
    )
    before = replace(apart, contrary=None, fault="apart(arm, part)", fault_since=4.7)
    assert evidence(step, ACTIONS["converging"], before, 9.0, ACTIONS) == (
        "`apart(arm, part)` held at 4.7 s and the stage has not recovered; stage `lift` fails when it does"
    )
    under_way = StepMonitor(
        3.0, status=Status.PROGRESSING, helped_by="range(arm, part) < 5 m", helped_since=3.5
    )
    told = evidence(step, ACTIONS["converging"], under_way, 9.0, ACTIONS)
    assert told == "`range(arm, part) < 5 m` has held since 3.5 s"


def test_what_was_going_on_when_a_stage_was_left_is_not_told_to_go_on_later() -> None:
    assert in_retrospect("the arm has been moving since 3.9 s", 4.9) == (
        "at 4.9 s the arm had been moving since 3.9 s"
    )
    for why in ("the arm and the part were converging until 3.0 s", "all stages were done"):
        assert in_retrospect(why, 4.9) == why


RELATIONS = st.sampled_from(sorted(ACTIONS))
TELLINGS = st.lists(st.tuples(st.permutations(PAIR), RELATIONS, st.floats(0, 9)))


@given(TELLINGS, RELATIONS, st.floats(0, 9))
def test_exclusive_relations_are_not_reported_for_the_same_time(
    tellings: list[tuple[list[str], str, float]], relation: str, since: float
) -> None:
    told = merged_reports(with_reported((), who, what, until) for who, what, until in tellings)
    begins = since_reported(told, PAIR, relation, since)
    assert begins >= since
    untils = [until for _, what, until in tellings if excludes(what, relation)]
    assert begins == max((since, *untils))
    assert since_reported(told, ("arm", "target"), relation, since) == since
    assert not excludes(relation, relation)
    assert len(told) == len({what for _, what, _ in tellings})


@given(RELATIONS, RELATIONS)
def test_excluding_goes_both_ways(first: str, second: str) -> None:
    assert excludes(first, second) == excludes(second, first)
