"""The times at which past steps are reported to have held."""

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

CONVERGED = StepMonitor(1.0, begun=2.3, helped_since=2.0, helped_at=3.0)
HOLDING = StepMonitor(1.0, begun=3.9, held=True, held_s=4.3, fulfilled=True)
PAIR = ("arm", "part")
PARTED = with_reported((), PAIR, "diverging", 2.4)
COUPLED = with_reported((), PAIR, "coupled", 8.3)


@pytest.mark.parametrize(
    ("action", "monitor", "followed", "refuted", "text"),
    [
        ("converging", CONVERGED, (), None, "converging until 3.0 s"),
        ("converging", CONVERGED, (2.6,), None, "converging until 2.6 s"),
        # What followed may have begun before it was noticed that they converge, ...
        ("converging", CONVERGED, (2.2,), None, "converging from 2.0 s to 2.2 s"),
        # ... what had been so before says nothing of the end, ...
        ("converging", CONVERGED, (1.5,), None, "converging until 3.0 s"),
        # ... nor hides what came after.
        ("converging", CONVERGED, (1.5, 2.6), None, "converging until 2.6 s"),
        ("coupled", HOLDING, (), None, "coupled since 3.9 s"),
        ("coupled", HOLDING, (7.9,), None, "coupled since 3.9 s"),
        ("coupled", HOLDING, (7.9,), 7.9, "coupled until 7.9 s"),
        ("coupled", HOLDING, (), 3.0, "coupled since 3.9 s"),
        # What excludes it was told in between: it began anew.
        (
            "converging",
            replace(CONVERGED, reported=PARTED),
            (),
            None,
            "converging from 2.4 s to 3.0 s",
        ),
        (
            "coupled",
            replace(HOLDING, reported=with_reported((), PAIR, "diverging", 5.6)),
            (),
            None,
            "since 5.6 s",
        ),
        (
            "coupled",
            replace(HOLDING, reported=with_reported((), PAIR, "touching", 5.6)),
            (),
            None,
            "since 3.9 s",
        ),
    ],
)
def test_times_of_past_steps_agree_with_later_events(
    action: str,
    monitor: StepMonitor,
    followed: tuple[float, ...],
    refuted: float | None,
    text: str,
) -> None:
    step = TaskStep(action, ("arm", "part"), "stage")
    status, why = outcome(step, ACTIONS[action], monitor, 8.2, followed, refuted)
    assert status is Status.DONE
    assert why.endswith(text)


@pytest.mark.parametrize(
    ("monitor", "text"),
    [
        (StepMonitor(8.3, helped_by="diverging", helped_since=8.1), "diverging since 8.1 s"),
        (
            StepMonitor(8.3, helped_by="diverging", helped_since=8.1, reported=COUPLED),
            "diverging since 8.3 s",
        ),
    ],
)
def test_a_relation_begins_no_sooner_than_an_exclusive_one_was_reported(
    monitor: StepMonitor, text: str
) -> None:
    """Two that were told to be coupled at 8.3 s are not told, later, to have drawn apart since 8.1 s."""
    step = TaskStep("diverging", PAIR, "stage")
    going_on = replace(monitor, status=Status.PROGRESSING)
    assert evidence(step, ACTIONS["diverging"], going_on, 8.5, ACTIONS).endswith(text)
    failing = replace(
        monitor, status=Status.FAILING, contrary="diverging", contrary_since=monitor.helped_since
    )
    step = TaskStep("coupled", PAIR, "stage")
    assert f"{text};" in evidence(step, ACTIONS["coupled"], failing, 8.5, ACTIONS)


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
    text = evidence(step, ACTIONS["converging"], under_way, 9.0, ACTIONS)
    assert text == "`range(arm, part) < 5 m` has held since 3.5 s"


def test_continuing_relations_are_put_into_the_past_tense() -> None:
    assert in_retrospect("the arm has been moving since 3.9 s", 4.9) == (
        "at 4.9 s the arm had been moving since 3.9 s"
    )
    for why in ("the arm and the part were converging until 3.0 s", "all stages were done"):
        assert in_retrospect(why, 4.9) == why


RELATIONS = st.sampled_from(sorted(ACTIONS))
REPORTS = st.lists(st.tuples(st.permutations(PAIR), RELATIONS, st.floats(0, 9)))


@given(REPORTS, RELATIONS, st.floats(0, 9))
def test_exclusive_relations_are_not_reported_for_the_same_time(
    reports: list[tuple[list[str], str, float]], relation: str, since: float
) -> None:
    merged = merged_reports(with_reported((), pair, name, until) for pair, name, until in reports)
    begins = since_reported(merged, PAIR, relation, since)
    assert begins >= since
    untils = [until for _, name, until in reports if excludes(name, relation)]
    assert begins == max((since, *untils))
    assert since_reported(merged, ("arm", "target"), relation, since) == since
    assert not excludes(relation, relation)
    assert len(merged) == len({name for _, name, _ in reports})


@given(RELATIONS, RELATIONS)
def test_exclusion_is_symmetric(first: str, second: str) -> None:
    assert excludes(first, second) == excludes(second, first)
