"""Every shipped task, lived through on a clear day and on a bad one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import sin

import pytest

from tests.tasks.scripted import RelationSpan, Script, play
from visup.agent import Verdict
from visup.tasks import load_task, shipped_tasks
from visup.tasks.grammar.structure import task_actors
from visup.tasks.supervision.supervise import finish, task_reasoner

Days = dict[str, list[tuple[str, float, float, tuple[int, int]]]]
A, B, C = (1, 2), (2, 3), (1, 3)

GOOD: Days = {
    "dock": [("converging", 0, 5, A), ("touching", 5, 9, A), ("coupled", 6, 9, A)],
    "dock_with_retry": [
        ("converging", 0, 5, A),
        ("diverging", 5, 8, A),
        ("converging", 9, 12, A),
        ("touching", 12, 16, A),
        ("coupled", 13, 16, A),
    ],
    "undock": [("coupled", 0, 5, A), ("touching", 0, 6, A), ("diverging", 6, 12, A)],
    "inspect": [
        ("converging", 0, 5, A),
        ("diverging", 27, 32, A),
    ],
    "station_keeping": [("converging", 0, 20, A), ("diverging", 50, 55, A)],
    # gripper 1, part 2, fixture 3
    "pick_and_place": [
        ("converging", 0, 5, A),
        ("touching", 5, 20, A),
        ("coupled", 6, 18, A),
        ("converging", 8, 14, B),
        ("touching", 14, 30, B),
        ("diverging", 20, 25, A),
    ],
    # giver 1, payload 2, receiver 3
    "handover": [
        ("coupled", 0, 12, A),
        ("touching", 0, 13, A),
        ("converging", 0, 6, B),
        ("touching", 6, 20, B),
        ("coupled", 7, 20, B),
        ("diverging", 13, 18, A),
    ],
}
BAD: Days = {
    "dock": [("converging", 0, 5, A), ("touching", 5, 6, A), ("diverging", 6, 12, A)],
    "dock_with_retry": [("converging", 0, 5, A), ("touching", 5, 8, A), ("diverging", 8, 20, A)],
    "undock": [("coupled", 0, 5, A), ("diverging", 6, 8, A), ("converging", 8, 12, A)],
    "inspect": [("converging", 0, 5, A), ("touching", 5, 9, A)],
    "station_keeping": [("converging", 0, 20, A), ("diverging", 20, 45, A)],
    "pick_and_place": [
        ("converging", 0, 5, A),
        ("touching", 5, 10, A),
        ("coupled", 6, 10, A),
        ("converging", 8, 10, B),
        ("diverging", 10, 20, A),
    ],
    "handover": [
        ("coupled", 0, 5, A),
        ("converging", 0, 5, B),
        ("diverging", 5, 15, A),
    ],
}


# Pixels between the outlines over the days of those that ask for a range.
Gaps = Mapping[str, Callable[[float], float]]
GOOD_GAPS: Gaps = {
    "inspect": lambda t: 200 - 30 * min(t, 5) + 8 * sin(t) if t < 27 else 50 + 30 * (t - 27),
    "station_keeping": lambda t: 250 - 10 * min(t, 20) + 12 * sin(2 * t),
}
BAD_GAPS: Gaps = {
    "inspect": lambda t: max(0.0, 200 - 40 * t),
    "station_keeping": lambda t: 250 - 10 * min(t, 20) + 12 * max(0.0, t - 20),
}


def final_verdict(name: str, days: Days, gaps: Gaps) -> Verdict:
    task = load_task(name)
    numbers = {a: i for i, a in enumerate(task_actors(task), 1)}
    if name == "handover":
        numbers = {"giver": 1, "payload": 2, "receiver": 3}
    identities = {i: {task.models(a)[0]: 0.9} for a, i in numbers.items()}
    spans = tuple(RelationSpan(n, a, b, pair) for n, a, b, pair in days[name])
    objects = dict.fromkeys(numbers.values(), (0.0, 1e9))
    until = max(s.to_s for s in spans)
    script = Script(spans, objects, identities=identities, gaps=gaps.get(name))
    return finish(play(task_reasoner([task]), script, until, fps=5.0).last.tasks[0])


@pytest.mark.parametrize("name", shipped_tasks())
def test_shipped_tasks_accept_a_good_run(name: str) -> None:
    assert final_verdict(name, GOOD, GOOD_GAPS) is Verdict.SUCCEEDED


@pytest.mark.parametrize("name", shipped_tasks())
def test_shipped_tasks_refuse_a_bad_run(name: str) -> None:
    expected = {
        "inspect": Verdict.INTERRUPTED,
        "dock_with_retry": Verdict.IN_PROGRESS,  # it may always try again
    }
    assert final_verdict(name, BAD, BAD_GAPS) is expected.get(name, Verdict.FAILED)
