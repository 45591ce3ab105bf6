"""Steps that are measured are the same steps, and what is measured adds up."""

from __future__ import annotations

from itertools import count

from tests.clips import moving_disc
from visup.agent import Frame
from visup.agent.cycle.agent import Agent
from visup.agent.model.step import Step
from visup.agent.storage.jsonable import to_jsonable
from visup.percepts.health import HealthBehaviour
from visup.runs.unattended.phase_meter import PhaseMeter


def test_measuring_does_not_change_a_step() -> None:
    ticks = count()
    told: list[Step] = []
    meter = PhaseMeter(lambda: float(next(ticks)))
    plain, measured = Agent([HealthBehaviour()]), Agent([HealthBehaviour()])
    measured.observers = [lambda step, frame: told.append(step)]
    for number, image in enumerate(moving_disc(5)):
        frame = Frame(number, number / 10.0, image)
        expected, step = plain.step(frame), meter.step(measured, frame)
        assert told[-1] is step
        told_of, wanted = (to_jsonable(s.mind) for s in (step, expected))
        assert told_of == wanted
        assert (step.events, step.alerts) == (expected.events, expected.alerts)
    assert meter.ms == dict.fromkeys(
        ("perceive", "update", "cogitate", "match", "attend", "act", "observe"), 5000.0
    )
