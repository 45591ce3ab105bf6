"""Behaviours in processes of their own. Classes stand at the top, so that they can be sent there."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from tests.agent.scripted import frames
from tests.paths import ROOT
from visup.agent import Contract, Directive, Frame, Observation, Outcome, Percept, ReportState
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.execution import sandbox
from visup.agent.model.errors import BehaviourError
from visup.agent.model.step import Step
from visup.agent.plugins.factory import load_behaviours

LIMITS = Limits(hang_s=0.5)


class Alone:
    """Counts its runs, and does what it is told at frame 2."""

    contract = Contract("alone", gives=("pid", "count"), isolate=True, history=2, memory_mb=64)

    def __init__(self, does: str = "") -> None:
        self.does = does
        self.count = 0

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterator[Percept]:
        self.count += 1
        if frame.index == 2 and self.does:
            DOES[self.does](frame)
        yield self.contract.percept(frame, process_id())
        value = [self.count, int(frame.image.sum()), [p.frame.index for p in observation.past]]
        yield self.contract.percept(
            frame, [*value, [d.data["n"] for d in directives]], kind="count"
        )


def process_id() -> int:
    """Its number as the supervisor sees it, also from a namespace of its own."""
    return int(Path("/proc/self").readlink().name)


def loop_forever(frame: Frame) -> None:
    while True:
        pass


def allocate_memory(frame: Frame) -> None:
    np.ones(256 * 2**20, np.uint8)


def write_to_image(frame: Frame) -> None:
    frame.image[:] = 0


def unsendable(frame: Frame) -> None:
    raise type("Odd", (Exception,), {})("an exception that no other process knows")


DOES: dict[str, Callable[[Frame], Any]] = {
    "spin": loop_forever,
    "sleep": lambda frame: time.sleep(60),
    "exit": lambda frame: sys.exit(3),
    "end": lambda frame: os._exit(3),
    "crash": lambda frame: ctypes.string_at(0),
    "kill": lambda frame: os.kill(os.getpid(), signal.SIGKILL),
    "hoard": allocate_memory,
    "scribble": write_to_image,
    "odd": unsendable,
}


def event_of_frame(mind: Any, observation: Observation) -> Outcome:
    wish = Directive("look_at", "Look.", MappingProxyType({"n": observation.frame_index}))
    return Outcome(mind, directives=(wish,))


def steps_of(behaviour: Any, count: int, limits: Limits = LIMITS) -> list[Step]:
    agent = Agent([behaviour], Reasoners(cogitate=(event_of_frame,)), limits=limits)
    try:
        return list(agent.steps(frames(count)))
    finally:
        agent.close()


def counts(steps: list[Step]) -> list[Any]:
    return [v for s in steps for v in s.observation.of("count")]


def test_percepts_are_the_same_in_another_process() -> None:
    isolated, in_process = steps_of(Alone(), 6), steps_of(Alone(), 6, Limits(in_process=True))
    assert counts(isolated) == counts(in_process)
    assert counts(in_process)[3] == [4, 3 * 6 * 4 * 3, [1, 2], [2]]
    assert {v for s in isolated for v in s.observation.of("pid")}.isdisjoint({os.getpid()})


@pytest.mark.parametrize(
    ("does", "state", "said"),
    [
        ("spin", ReportState.LATE, "it gave no answer within 500 ms"),
        ("sleep", ReportState.LATE, "it gave no answer within 500 ms"),
        ("end", ReportState.FAILED, "its process ended with exit code 3"),
        ("crash", ReportState.FAILED, "its process ended by signal 11"),
        ("kill", ReportState.FAILED, "its process ended by signal 9"),
        ("hoard", ReportState.FAILED, "MemoryError"),
    ],
)
def test_a_broken_process_is_reported_and_replaced(
    does: str, state: ReportState, said: str
) -> None:
    steps = steps_of(Alone(does), 16)
    told = [s.reports[0] for s in steps]
    assert told[2].state is state
    assert said in told[2].error
    assert [r.state for r in told[3:12]] == [ReportState.SUSPENDED] * 9
    assert told[-1].state is ReportState.RAN
    assert counts(steps)[-1][0] == 4  # it began anew at frame 12
    assert "behaviour_failed" in {a.kind for a in steps[5].mind.alerts}


@pytest.mark.parametrize(
    ("does", "said"), [("exit", "it called for an exit"), ("scribble", "read-only"), ("odd", "Odd")]
)
def test_an_exception_does_not_end_the_process(does: str, said: str) -> None:
    steps = steps_of(Alone(does), 5)
    assert said in steps[2].reports[0].error
    assert [c[0] for c in counts(steps)] == [1, 2, 4, 5]


def test_a_closed_agent_leaves_no_process() -> None:
    agent = Agent([Alone()], limits=LIMITS)
    pid = agent.step(next(frames(1))).observation.of("pid")[0]
    assert alive(pid)
    agent.close()
    assert not alive(pid)


def test_a_forgotten_agent_leaves_no_process() -> None:
    agent = Agent([Alone()], limits=LIMITS)
    pid = agent.step(next(frames(1))).observation.of("pid")[0]
    del agent
    assert not alive(pid)


KILLED = """
import os, signal, sys
from tests.agent.scripted import frames
from tests.agent.execution.test_process_runner import Alone
from visup.agent.cycle.agent import Agent
if __name__ == "__main__":
    agent = Agent([Alone()])
    print(agent.step(next(frames(1))).observation.of("pid")[0], flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_supervisor_that_is_killed_leaves_no_process(tmp_path: Path) -> None:
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    root = ROOT
    paths = os.pathsep.join([str(root), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": paths},
    )
    pid = int(done.stdout)
    deadline = time.monotonic() + 10
    while alive(pid) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not alive(pid)


def alive(pid: int) -> bool:
    status = Path(f"/proc/{pid}/stat")
    try:
        os.kill(pid, 0)
        return not status.exists() or status.read_text().split()[2] != "Z"
    except (ProcessLookupError, FileNotFoundError):  # it may end between the two
        return False


class Holding(Alone):
    """Holds what cannot be sent from the beginning, or once it is started."""

    def __init__(self, when: str) -> None:
        super().__init__()
        self.when = when
        if when == "made":
            self.start()

    def start(self) -> None:
        if self.when == "never":
            raise OSError("no device")
        self.held = (n for n in range(3))


def test_unsendable_attributes_are_refused_with_a_hint() -> None:
    with pytest.raises(BehaviourError, match="cannot be sent to a process") as caught:
        Agent([Holding("made")], limits=LIMITS)
    assert "`start`" in str(caught.value)
    assert counts(steps_of(Holding("started"), 2))[-1][0] == 2


def test_a_failed_start_is_reported() -> None:
    told = [s.reports[0] for s in steps_of(Holding("never"), 2)]
    assert {r.state for r in told} == {ReportState.FAILED}
    assert told[0].error.endswith("it does not start: OSError: no device")


def test_a_behaviour_of_a_file_can_be_isolated_by_name(tmp_path: Path) -> None:
    path = tmp_path / "lamp.py"
    path.write_text(
        "from pathlib import Path\n"
        "from visup.agent import Contract\n"
        "class Lamp:\n"
        "    contract = Contract('lamp', gives=('lamp',))\n"
        "    def perceive(self, frame, observation, directives):\n"
        "        yield self.contract.percept(frame, {'pid': Path('/proc/self').readlink().name})\n"
    )
    (lamp,) = load_behaviours(str(path))
    steps = steps_of(lamp, 2, Limits(isolate=frozenset({"lamp"})))
    assert steps[-1].reports[0].error == ""
    assert steps[-1].observation.of("lamp")[0]["pid"] != str(os.getpid())


def test_a_name_that_is_not_there_cannot_be_isolated() -> None:
    with pytest.raises(BehaviourError, match="called 'nose' to isolate"):
        Agent([Alone()], limits=Limits(isolate=frozenset({"nose"})))


def test_isolation_works_without_namespaces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sandbox, "can_use_namespaces", lambda: False)
    assert counts(steps_of(Alone(), 2))[-1][0] == 2
