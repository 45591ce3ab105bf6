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
class Lived:
    """What became of a scene."""

    mind: Mind
    events: tuple[Event, ...]

    @property
    def alerts(self) -> set[str]:
        return {str(e.data["alert_kind"]) for e in self.events if e.kind == "alert"}


def lived(text: str, paths: Mapping[int, Path], names: Mapping[int, str], seconds: float) -> Lived:
    rules = default_reasoners(traits=True)
    task = task_reasoner([parse_task(text)])
    agent = Agent(reasoners=Reasoners(rules.update, rules.cogitate, match=(task,)))
    events: list[Event] = []
    for i in range(round(seconds * 25)):
        regions = [box_region(n, path(i / 25)) for n, path in paths.items()]
        here = {r.id for r in regions if r is not None}
        said = {n: [(name, 0.9)] for n, name in names.items() if n in here}
        events += agent.reason(seen(i, regions, names=said)).events
    return Lived(agent.mind, tuple(events))


WATCHED = "<t> ::= converging(arm, tray) for 30 s"
SCENE = {1: ARM, 2: TRAY, 3: lambda t: WALKER(t) if t > 3 else (-100, 0, 10, 10)}


def test_an_unknown_object_interrupts_the_task() -> None:
    found = lived(WATCHED, SCENE, NAMES, 10.0)
    assert "unexpected_object" in found.alerts
    assert found.mind.tasks[0].verdict is Verdict.INTERRUPTED


@pytest.mark.parametrize(
    "said", ["bystander person", "bystanders ignored", "bystander walker is smaller than 120 px"]
)
def test_a_bystander_does_not_interrupt_the_task(said: str) -> None:
    found = lived(f"{said}\n{WATCHED}", SCENE, NAMES, 10.0)
    assert found.alerts == set()
    assert found.mind.tasks[0].verdict is not Verdict.INTERRUPTED
    assert found.mind.tasks[0].bystanders == (3,)


def test_an_object_that_is_no_bystander_still_interrupts() -> None:
    found = lived(f"bystander dog\n{WATCHED}", SCENE, NAMES, 12.0)
    assert "unexpected_object" in found.alerts


CLAW: Path = lambda t: (260 - 40 * min(t, 2.6), 215, 30, 30)  # noqa: E731
PARTS = {1: lambda t: (60, 200, 100, 60), 2: TRAY, 3: CLAW}
ITS_NAMES = {1: "arm", 2: "tray", 3: "claw"}


def test_what_parts_of_one_machine_do_to_each_other_is_no_event() -> None:
    apart = "<t> ::= present(claw) present(arm) present(tray)"
    machine = "<t> ::= present(claw of arm) present(tray)"
    between = [
        [e for e in lived(text, PARTS, ITS_NAMES, 6.0).events if e.objects == (1, 3)]
        for text in (apart, machine)
    ]
    assert [e.kind for e in between[0]] == ["relation", "coupled"]
    assert [e.kind for e in between[1]] == ["relation"]  # told before the claw was known for a part
    found = lived(machine, PARTS, ITS_NAMES, 9.0)
    assert found.mind.tasks[0].machines == ((1, 3),)
    assert found.mind.one_machine(1, 3)
    assert not found.mind.one_machine(1, 2)


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
