"""States of agents: what is thawed goes on as what was frozen, and files cannot run anything."""

from __future__ import annotations

import json
import struct
import zlib
from collections import deque
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.agent.scripted import COUNTING, Scripted, alert_while, counting, frames
from tests.agent.storage.test_codec import equal_values, plugin_values, regions
from visup.agent import Health, HealthStatus, Region
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.errors import OutputError
from visup.agent.storage.checkpoint import MAGIC, StateError, dump_state, load_state
from visup.agent.storage.codec import pack_observation
from visup.rules.formula.units import Span
from visup.tasks.grammar.conditions import Name, PartName


@settings(max_examples=40)
@given(st.lists(regions(), max_size=2), plugin_values)
def test_a_loaded_state_equals_the_saved_one(given_regions: list[Region], value: Any) -> None:
    assert equal_values(load_state(dump_state([given_regions, value])), [given_regions, value])


def test_shared_references_are_preserved() -> None:
    shared = [1, 2]
    a, b, c = load_state(dump_state((shared, shared, [1, 2])))
    assert a is b
    assert a is not c


def test_containers_and_arrays_preserve_type_and_memory_order() -> None:
    columns = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    told = load_state(dump_state((deque([1, 2], 5), MappingProxyType({(1, 2): {3}}), columns)))
    assert (told[0], told[0].maxlen) == (deque([1, 2]), 5)
    assert isinstance(told[1], MappingProxyType)
    assert told[1][1, 2] == {3}
    assert told[2].flags.f_contiguous
    assert (told[2] == columns).all()


def test_names_of_tasks_are_saved_with_their_positions() -> None:
    name = PartName("gripper", Name("arm", Span(1, 9, 1, 12)), Span(1, 1, 1, 12))
    told = load_state(dump_state([name]))[0]
    assert (told, type(told), told.machine, told.span) == (name, PartName, "arm", name.span)
    assert told.machine.span == name.machine.span


@dataclass
class Elsewhere:
    x: int = 1


@pytest.mark.parametrize("value", [print, Elsewhere(), lambda: 1, int, object(), np.array([{}])])
def test_values_that_cannot_be_saved_are_refused(value: object) -> None:
    with pytest.raises(StateError):
        dump_state({"x": [value]})


def test_recursive_objects_are_refused() -> None:
    loop: list[Any] = []
    loop.append(loop)
    with pytest.raises(StateError, match="holds itself"):
        dump_state(loop)


def forged(table: Any, root: Any = (0,)) -> bytes:
    tree = json.dumps([table, root, []]).encode()
    return struct.pack("<8sQII", MAGIC, len(tree), zlib.crc32(tree), zlib.crc32(b"")) + tree


@pytest.mark.parametrize(
    "table",
    [
        [["object", "os:system", []]],
        [["object", "subprocess:Popen", [["args", "x"]]]],
        [["object", "visup.agent.storage.checkpoint:frozen", []]],
        [["object", "visup.agent.storage.checkpoint:sys", []]],
        [["object", "visup.agent.storage.checkpoint:np.ndarray", []]],
        [["object", "visup.no.such:Thing", []]],
        [["enum", "visup.agent.model.records:Frame", 1]],
        [["enum", "visup.agent.model.records:Severity", 99]],
        [["array", 0]],
        [["named", "visup.agent.model.records:Health", []]],
        [["text", "visup.agent.model.records:Severity", "x", []]],
        [["strange"]],
        [["tuple", [[7]]]],
        [["dict", [[[0], 1]]]],
        {"a": 1},
        3,
    ],
)
def test_a_forged_state_is_refused(table: Any) -> None:
    with pytest.raises(OutputError, match="cannot be read"):
        load_state(forged(table))


@settings(max_examples=100)
@given(st.data())
def test_damaged_bytes_are_refused(data: st.DataObject) -> None:
    good = dump_state({"health": Health(HealthStatus.OK), "n": np.arange(5)})
    at = data.draw(st.integers(0, len(good) - 1))
    cut = data.draw(st.booleans())
    bad = good[:at] if cut else good[:at] + bytes([good[at] ^ 1 << (at % 8)]) + good[at + 1 :]
    with pytest.raises(OutputError):
        load_state(bad)


class Summing:
    """A behaviour that holds state from frame to frame, and can tell it."""

    def __init__(self) -> None:
        self.inner = Scripted("sum", ("sum",), self._said)
        self.contract = self.inner.contract
        self.total = 0

    def _said(self, index: int) -> int:
        if index % 7 == 3:
            raise RuntimeError("at times")
        self.total += index
        return self.total

    def perceive(self, frame: Any, observation: Any, directives: Any) -> Any:
        return self.inner.perceive(frame, observation, directives)

    def save(self) -> dict[str, int]:
        return {"total": self.total}

    def load(self, state: Any) -> None:
        self.total = state["total"]


def counting_agent() -> Agent:
    worry = alert_while(lambda t: t % 3 < 1.5)
    return Agent([Summing()], Reasoners(update=(counting,), cogitate=(worry,)))


@given(st.integers(1, 59))
@settings(max_examples=15)
def test_an_agent_with_a_loaded_state_continues_identically(at: int) -> None:
    sequence = list(frames(60))
    first = counting_agent()
    first.run(sequence[:at])
    second = counting_agent()
    assert second.load(load_state(dump_state(first.save())))
    for frame in sequence[at:]:
        a, b = first.step(frame), second.step(frame)
        assert pack_observation(a.observation) == pack_observation(b.observation)
        assert (a.events, a.alerts) == (b.events, b.alerts)


def test_only_the_mind_is_saved_if_a_behaviour_cannot_be() -> None:
    first = Agent([Scripted("eye", ("x",))], Reasoners(update=(counting,)))
    first.run(frames(5))
    second = Agent([Scripted("eye", ("x",))], Reasoners(update=(counting,)))
    assert not second.load(load_state(dump_state(first.save())))
    assert second.mind.recall(COUNTING) == 5
