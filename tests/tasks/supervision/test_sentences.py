"""Until when, or since when, a step that is over is told to have been what it should be."""

from __future__ import annotations

import pytest

from visup.agent import Status
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.automaton.states import TaskStep
from visup.tasks.supervision.sentences import outcome
from visup.tasks.verification.step_monitor import StepMonitor

NEARED = StepMonitor(1.0, begun=2.3, helped_since=2.0, helped_at=3.0)
HELD = StepMonitor(1.0, begun=3.9, held=True, held_s=4.3, fulfilled=True)


@pytest.mark.parametrize(
    ("action", "monitor", "followed", "denied", "told"),
    [
        ("converging", NEARED, (), None, "converging until 3.0 s"),
        ("converging", NEARED, (2.6,), None, "converging until 2.6 s"),
        # What followed may have begun before it was noticed that they converge, ...
        ("converging", NEARED, (2.2,), None, "converging until 2.2 s"),
        # ... what had been so before says nothing of the end, ...
        ("converging", NEARED, (1.5,), None, "converging until 3.0 s"),
        # ... nor hides what came after.
        ("converging", NEARED, (1.5, 2.6), None, "converging until 2.6 s"),
        ("coupled", HELD, (), None, "coupled since 3.9 s"),
        ("coupled", HELD, (7.9,), None, "coupled since 3.9 s"),
        ("coupled", HELD, (7.9,), 7.9, "coupled until 7.9 s"),
        ("coupled", HELD, (), 3.0, "coupled since 3.9 s"),
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
