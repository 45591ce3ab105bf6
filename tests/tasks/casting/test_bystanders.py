"""Bystanders are let be; parts of one machine do nothing to each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import pytest

from tests.rules.scenes import Rect, box_region, seen
from visup.agent import AlertCondition, Event, Mind, Severity, TaskBelief, Verdict
from visup.agent.cycle.agent import Agent, Reasoners
from visup.rules.reasoners import default_reasoners
from visup.rules.safety.reasoner import once_per_machine
from visup.tasks import parse_task
from visup.tasks.supervision.supervise import task_reasoner

Path = Callable[[float], Rect]
NAMES = {1: "arm", 2: "tray", 3: "person"}
ARM: Path = lambda t: (60 + 4 * t, 200, 60, 60)  # noqa: E731
TRAY: Path = lambda t: (520, 300, 60, 60)  # noqa: E731
WALKER: Path = lambda t: (400 - 30 * max(0.0, t - 3), 40 + 25 * max(0.0, t - 3), 40, 80)  # noqa: E731


@dataclass(frozen=True)
class SceneResult:
    """The final mind and the events of a scene."""

    mind: Mind
    events: tuple[Event, ...]

    @property
    def alerts(self) -> set[str]:
        return {str(e.data["alert_kind"]) for e in self.events if e.kind == "alert"}


def play_scene(
    text: str, paths: Mapping[int, Path], names: Mapping[int, str], seconds: float
) -> SceneResult:
    rules = default_reasoners(traits=True)
    task = task_reasoner([parse_task(text)])
    agent = Agent(reasoners=Reasoners(rules.update, rules.cogitate, match=(task,)))
    events: list[Event] = []
    for i in range(round(seconds * 25)):
        regions = [box_region(n, path(i / 25)) for n, path in paths.items()]
        present = {r.id for r in regions if r is not None}
        visible_names = {n: [(name, 0.9)] for n, name in names.items() if n in present}
        events += agent.reason(seen(i, regions, names=visible_names)).events
    return SceneResult(agent.mind, tuple(events))


WATCHED = "<t> ::= converging(arm, tray) for 30 s"
SCENE = {1: ARM, 2: TRAY, 3: lambda t: WALKER(t) if t > 3 else (-100, 0, 10, 10)}


def test_an_unknown_object_interrupts_the_task() -> None:
    result = play_scene(WATCHED, SCENE, NAMES, 10.0)
    assert "unexpected_object" in result.alerts
    assert result.mind.tasks[0].verdict is Verdict.INTERRUPTED


@pytest.mark.parametrize(
    "declaration",
    ["bystander person", "bystanders ignored", "bystander walker is smaller than 120 px"],
)
def test_a_bystander_does_not_interrupt_the_task(declaration: str) -> None:
    result = play_scene(f"{declaration}\n{WATCHED}", SCENE, NAMES, 10.0)
    assert result.alerts == set()
    assert result.mind.tasks[0].verdict is not Verdict.INTERRUPTED
    assert result.mind.tasks[0].bystanders == (3,)


def test_an_object_that_is_no_bystander_still_interrupts() -> None:
    result = play_scene(f"bystander dog\n{WATCHED}", SCENE, NAMES, 12.0)
    assert "unexpected_object" in result.alerts


CLAW: Path = lambda t: (260 - 40 * min(t, 2.6), 215, 30, 30)  # noqa: E731
PARTS = {1: lambda t: (60, 200, 100, 60), 2: TRAY, 3: CLAW}
ITS_NAMES = {1: "arm", 2: "tray", 3: "claw"}


def test_relations_between_parts_of_one_machine_are_no_events() -> None:
    apart = "<t> ::= present(claw) present(arm) present(tray)"
    machine = "<t> ::= present(claw of arm) present(tray)"
    between = [
        [e for e in play_scene(text, PARTS, ITS_NAMES, 6.0).events if e.objects == (1, 3)]
        for text in (apart, machine)
    ]
    assert [e.kind for e in between[0]] == ["relation", "coupled"]
    assert [e.kind for e in between[1]] == ["relation"]  # told before the claw was known for a part
    result = play_scene(machine, PARTS, ITS_NAMES, 9.0)
    assert result.mind.tasks[0].machines == ((1, 3),)
    assert result.mind.one_machine(1, 3)
    assert not result.mind.one_machine(1, 2)


def test_an_alert_about_a_machine_is_raised_once() -> None:
    task = TaskBelief("t", Verdict.IN_PROGRESS, machines=((1, 3),))
    with_claw, with_arm, other = (
        AlertCondition("collision_course", pair, severity, "closing")
        for pair, severity in (
            ((3, 5), Severity.WARNING),
            ((1, 5), Severity.CRITICAL),
            ((2, 5), Severity.WARNING),
        )
    )
    conditions = (with_claw, with_arm, other)
    assert once_per_machine(conditions, Mind()) == conditions
    assert once_per_machine(conditions, Mind(tasks=(task,))) == (with_arm, other)
