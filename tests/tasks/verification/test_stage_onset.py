"""When a stage began: what is believed late is dated back, within the bounds of what came before."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.rules.relations.samples import SampleWindow
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.automaton.states import Leaf, TaskStep
from visup.tasks.verification.stage_onset import stage_onset
from visup.tasks.verification.step_monitor import StepMonitor

NOW = 10.0
TIMES = np.arange(NOW - 1.5, NOW + 1e-6, 0.1)
WHO = {"a": 1, "b": 2, "c": 3}


def step(
    action: str, by: str | None, since: float | None, earliest: float = 0.0
) -> Leaf[StepMonitor]:
    monitor = StepMonitor(NOW, helped_by=by, helped_since=since, earliest=earliest)
    return Leaf(TaskStep(action, ("a", "b"), "s"), monitor)


def departing(at: float) -> SampleWindow:
    """Two that rest side by side until one leaves at 60 px/s."""
    apart = np.full((len(TIMES), 3, 3), np.nan)
    apart[:, 0, 1] = apart[:, 1, 0] = 5.0 + 60.0 * np.maximum(0.0, TIMES - at)
    return SampleWindow(ids=(1, 2, 3), times=TIMES, separation=apart)


def onset(*steps: Leaf[StepMonitor], window: SampleWindow) -> float:
    objects = lambda actors: tuple(WHO[a] for a in actors)  # noqa: E731
    return stage_onset(steps, ACTIONS, objects, NOW, window)


@pytest.mark.parametrize("action", ["diverging", "decoupled"])
@pytest.mark.parametrize("at", [9.0, 9.4])
def test_a_departure_is_dated_to_its_motion_onset(action: str, at: float) -> None:
    seen = step(action, "diverging", 9.8)
    assert onset(seen, window=departing(at)) == pytest.approx(at)


def test_without_samples_the_relation_dates_the_stage() -> None:
    assert onset(step("diverging", "diverging", 9.8), window=SampleWindow()) == 9.8
    assert onset(step("coupled", "coupled", 9.1), window=SampleWindow()) == 9.1


def test_contacts_and_unobserved_actions_are_not_dated_back() -> None:
    for seen in (step("touching", "touching", 9.5), step("diverging", None, None)):
        assert onset(seen, window=departing(9.0)) == NOW


def test_helping_relations_do_not_date_a_step() -> None:
    assert onset(step("touching", "converging", 9.0), window=SampleWindow()) == NOW


def test_a_stage_begins_with_the_last_of_its_actions() -> None:
    both = step("coupled", "coupled", 8.0), step("diverging", "diverging", 9.8)
    assert onset(*both, window=departing(9.4)) == pytest.approx(9.4)
    late_contact = step("coupled", "coupled", 8.0), step("touching", "touching", 9.7)
    assert onset(*late_contact, window=departing(9.4)) == NOW


@given(st.floats(0.0, 12.0), st.floats(8.0, NOW), st.floats(8.5, 10.0))
def test_no_stage_is_dated_before_the_last_ended_or_after_its_report(
    earliest: float, since: float, at: float
) -> None:
    found = onset(step("diverging", "diverging", since, earliest), window=departing(at))
    assert min(earliest, NOW) <= found <= NOW
