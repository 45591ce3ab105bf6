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

Does = Callable[[Any, Any, Any], Any]
TICKET = itertools.count()


def plug(does: Does, **declared: Any) -> type:
    class Plug:
        contract = Contract("plug", gives=("x",), **declared)

        def __init__(self) -> None:
            self.kept: list[Any] = []

        def perceive(self, frame: Any, observation: Any, directives: Any) -> Any:
            return [self.contract.percept(frame, does(self, frame, observation))]

    return Plug


def write(self: Any, frame: Any, seen: Any) -> int:
    frame.image[0, 0] = 255
    return 0


def keep(self: Any, frame: Any, seen: Any) -> Any:
    self.kept.append(frame.index)
    return self.kept


CHEATS: dict[str, tuple[type, str]] = {
    "raises": (plug(lambda s, f, seen: 1 / 0), "runs on a disc that moves: frame 0: ZeroDivision"),
    "black": (plug(lambda s, f, seen: 1 / int(f.image.max())), "runs on black: frame 0: ZeroDivi"),
    "size": (plug(lambda s, f, seen: int(f.image[100, 100, 0])), "runs on an odd size"),
    "number": (
        plug(lambda s, f, seen: float("nan")),
        "reported 'x' as nan; expected a finite number",
    ),
    "writes": (plug(write), "read-only"),
    "keeps": (plug(keep), "percepts of earlier frames changed later"),
    "chance": (plug(lambda s, f, seen: next(TICKET)), "is deterministic: a second run"),
    "slow": (plug(lambda s, f, seen: time.sleep(0.002), cost_ms=1), "keeps its budget: "),
    "unknown need": (plug(lambda s, f, seen: 0, needs=("smell",)), "have no 'smell'"),
}


@pytest.mark.parametrize("name", sorted(CHEATS))
def test_a_cheat_is_found(name: str) -> None:
    cheat, message = CHEATS[name]
    with pytest.raises(AssertionError) as caught:
        check_behaviour(cheat)
    assert message in str(caught.value).replace("\n", " ").replace("  ", " ")


class Held:
    contract = Contract("held", gives=("x",), isolate=True)

    def __init__(self) -> None:
        self.held = (n for n in range(3))

    def perceive(self, frame: Any, observation: Any, directives: Any) -> Any:
        return ()


def test_what_cannot_be_sent_to_its_process_is_found() -> None:
    failed = [f.check for f in check_results(Held) if not f.passed]
    assert failed == ["can be sent to a process of its own"]


@pytest.mark.parametrize("kind", [HealthBehaviour, MotionBehaviour])
def test_visups_own_behaviours_keep_their_contracts(kind: type) -> None:
    check_behaviour(kind)


def test_an_instance_will_do_and_does_not_run_itself() -> None:
    given = Scripted("lamp", ("lamp",), lambda frame: 1.0)
    check_behaviour(given)
    assert given.directives == []


def test_what_is_needed_comes_from_what_is_true() -> None:
    def count(self: Any, frame: Any, seen: Any) -> int:
        return len(seen.of("region")) + len(seen.of("smell"))

    needy = plug(count, needs=("region", "smell"))
    found = check_results(needy, provide={"smell": lambda frame: "roses"})
    assert all(f.passed for f in found)
    assert any(f.detail.endswith("percepts: x") for f in found)


def test_the_truth_of_a_clip_is_true() -> None:
    for shot in disc(8):
        (region,) = shot.regions
        full = region.full_mask(shot.frame.size)
        grey = shot.frame.image[..., 0]
        assert grey[full].min() > grey[~full].max()
        assert region.area == full.sum()
    areas = [[r.area for r in shot.regions if r.id == 1] for shot in crossing(20)]
    assert min(area for (area,) in areas) < 0.8 * areas[0][0]  # the second one hides it in part


def test_a_region_of_a_mask_encloses_it() -> None:
    mask = np.zeros((20, 30), bool)
    mask[5:9, 7:17] = True
    region = region_of(mask, 4)
    assert (region.id, region.bbox, region.area) == (4, (7, 5, 10, 4), 40)
    assert (region.full_mask((30, 20)) == mask).all()


def test_a_scripted_source_runs_and_breaks_off() -> None:
    script = [shot.frame for shot in flat(9, 4)]
    source = ScriptedSource(script, problem="the cable was cut")
    last = Agent([]).run(source)
    assert last is not None
    assert last.frame_index == 3
    assert (source.ended, source.problem) == (Ending.TRUNCATED, "the cable was cut")
