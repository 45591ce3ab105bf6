from __future__ import annotations

from typing import Any

import pytest

from tests.agent.scripted import Scripted, frames
from visup.agent import Contract
from visup.agent.contract.contract import CONTRACT_VERSION, MAX_HISTORY
from visup.agent.execution.pipeline import ordered_slots
from visup.agent.model.errors import BehaviourError


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"name": ""}, "not a valid name for a behaviour"),
        ({"name": "two words"}, "not a valid name for a behaviour"),
        ({"name": 3}, "not a valid name for a behaviour"),
        ({"gives": ()}, "at least one kind"),
        ({"gives": "lamp"}, r"a tuple of one has a comma: gives=\('lamp',\)"),
        ({"gives": ("lamp", 3)}, "a tuple of words"),
        ({"gives": ("lamp", "lamp")}, "each kind once"),
        ({"needs": "region"}, r"needs=\('region',\)"),
        ({"every_s": -1.0}, "`every_s` is -1.0"),
        ({"every_s": float("nan")}, "`every_s` is nan"),
        ({"every_s": "1"}, "`every_s` is '1'"),
        ({"cost_ms": 0}, "a number above 0, or None"),
        ({"memory_mb": float("inf")}, "`memory_mb` is inf"),
        ({"history": MAX_HISTORY + 1}, f"0 to {MAX_HISTORY}"),
        ({"history": 1.5}, "`history` is 1.5"),
        ({"most_percepts": 0}, "1 to 1000000"),
        ({"deterministic": 1}, "True or False"),
        ({"isolate": "yes"}, "True or False"),
        ({"version": CONTRACT_VERSION + 1}, "written for another version of visup"),
    ],
)
def test_an_invalid_contract_is_refused_with_a_message(
    fields: dict[str, Any], message: str
) -> None:
    with pytest.raises(BehaviourError, match=message):
        Contract(**{"name": "lamp", "gives": ("lamp",), **fields})


def test_kinds_may_be_given_as_a_list() -> None:
    assert Contract("lamp", gives=["lamp"]).gives == ("lamp",)  # type: ignore[arg-type]


def test_a_contract_creates_percepts_of_its_behaviour() -> None:
    frame = next(frames(1))
    percept = Contract("eye", gives=("x", "y")).percept(frame, 3, kind="y", confidence=0.5)
    assert (percept.kind, percept.value, percept.time) == ("y", 3, frame.time)
    assert (percept.source, percept.confidence) == ("eye", 0.5)


def test_a_behaviour_that_needs_its_own_kind_is_refused() -> None:
    with pytest.raises(BehaviourError, match="which no behaviour but itself gives"):
        ordered_slots([Scripted("eye", ("x",), needs=("x",))])
