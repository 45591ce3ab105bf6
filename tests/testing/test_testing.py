"""The contract checker finds every way in which a behaviour breaks its contract."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from visup.agent import Contract
from visup.agent.cycle.agent import Agent
from visup.percepts.health import HealthBehaviour
from visup.percepts.motion.behaviour import MotionBehaviour
from visup.percepts.video.source import Ending
from visup.testing import (
    Scripted,
    ScriptedSource,
    check_behaviour,
    check_results,
    crossing,
    disc,
    flat,
    region_of,
)

Perceive = Callable[[Any, Any, Any], Any]
COUNTER = itertools.count()


def behaviour_class(perceive_one: Perceive, **declared: Any) -> type:
    class Plug:
        contract = Contract("plug", gives=("x",), **declared)

        def __init__(self) -> None:
            self.indices: list[Any] = []

        def perceive(self, frame: Any, observation: Any, directives: Any) -> Any:
            return [self.contract.percept(frame, perceive_one(self, frame, observation))]

    return Plug


def write(self: Any, frame: Any, observation: Any) -> int:
    frame.image[0, 0] = 255
    return 0


def keep(self: Any, frame: Any, observation: Any) -> Any:
    self.indices.append(frame.index)
    return self.indices


VIOLATIONS: dict[str, tuple[type, str]] = {
    "raises": (
        behaviour_class(lambda s, f, observation: 1 / 0),
        "runs on a disc that moves: frame 0: ZeroDivision",
    ),
    "black": (
        behaviour_class(lambda s, f, observation: 1 / int(f.image.max())),
        "runs on black: frame 0: ZeroDivi",
    ),
    "size": (
        behaviour_class(lambda s, f, observation: int(f.image[100, 100, 0])),
        "runs on an odd size",
    ),
    "number": (
        behaviour_class(lambda s, f, observation: float("nan")),
        "reported 'x' as nan; expected a finite number",
    ),
    "writes": (behaviour_class(write), "read-only"),
    "keeps": (behaviour_class(keep), "percepts of earlier frames changed later"),
    "chance": (
        behaviour_class(lambda s, f, observation: next(COUNTER)),
        "is deterministic: a second run",
    ),
    "slow": (
        behaviour_class(lambda s, f, observation: time.sleep(0.002), cost_ms=1),
        "keeps its budget: ",
    ),
    "unknown need": (
        behaviour_class(lambda s, f, observation: 0, needs=("smell",)),
        "have no 'smell'",
    ),
}


@pytest.mark.parametrize("name", sorted(VIOLATIONS))
def test_each_violation_is_found(name: str) -> None:
    violating, message = VIOLATIONS[name]
    with pytest.raises(AssertionError) as caught:
        check_behaviour(violating)
    assert message in str(caught.value).replace("\n", " ").replace("  ", " ")


class Unpicklable:
    contract = Contract("unpicklable", gives=("x",), isolate=True)

    def __init__(self) -> None:
        self.generator = (n for n in range(3))

    def perceive(self, frame: Any, observation: Any, directives: Any) -> Any:
        return ()


def test_a_behaviour_that_cannot_be_pickled_is_found() -> None:
    failed = [f.check for f in check_results(Unpicklable) if not f.passed]
    assert failed == ["can be sent to a process of its own"]


@pytest.mark.parametrize("kind", [HealthBehaviour, MotionBehaviour])
def test_shipped_behaviours_keep_their_contracts(kind: type) -> None:
    check_behaviour(kind)


def test_an_instance_is_copied_before_it_is_checked() -> None:
    behaviour = Scripted("lamp", ("lamp",), lambda frame: 1.0)
    check_behaviour(behaviour)
    assert behaviour.directives == []


def test_needed_percepts_come_from_the_ground_truth() -> None:
    def count(self: Any, frame: Any, observation: Any) -> int:
        return len(observation.of("region")) + len(observation.of("smell"))

    behaviour = behaviour_class(count, needs=("region", "smell"))
    results = check_results(behaviour, provide={"smell": lambda frame: "roses"})
    assert all(f.passed for f in results)
    assert any(f.detail.endswith("percepts: x") for f in results)


def test_the_ground_truth_of_clips_is_correct() -> None:
    for shot in disc(8):
        (region,) = shot.regions
        full = region.full_mask(shot.frame.size)
        grey = shot.frame.image[..., 0]
        assert grey[full].min() > grey[~full].max()
        assert region.area == full.sum()
    areas = [[r.area for r in shot.regions if r.id == 1] for shot in crossing(20)]
    assert min(area for (area,) in areas) < 0.8 * areas[0][0]  # the second one hides it in part


def test_a_region_has_the_extent_of_its_mask() -> None:
    mask = np.zeros((20, 30), bool)
    mask[5:9, 7:17] = True
    region = region_of(mask, 4)
    assert (region.id, region.bbox, region.area) == (4, (7, 5, 10, 4), 40)
    assert (region.full_mask((30, 20)) == mask).all()


def test_a_scripted_source_can_end_with_a_problem() -> None:
    script = [shot.frame for shot in flat(9, 4)]
    source = ScriptedSource(script, problem="the cable was cut")
    last = Agent([]).run(source)
    assert last is not None
    assert last.frame_index == 3
    assert (source.ended, source.problem) == (Ending.TRUNCATED, "the cable was cut")
