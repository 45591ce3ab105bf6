"""Plug-ins that mean harm, in processes of their own: the supervisor goes on, and runs none of their code."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from tests.agent.execution.test_process_runner import alive
from tests.agent.scripted import frames
from visup.agent import Report, ReportState
from visup.agent.contract.limits import Limits
from visup.agent.cycle.agent import Agent
from visup.agent.execution.contracts import read_contracts
from visup.agent.execution.sandbox import can_use_namespaces
from visup.agent.model.errors import BehaviourError, SettingsError
from visup.agent.plugins.isolated import IsolatedBehaviour

HANG_S = 2.0
LIMITS = Limits(hang_s=HANG_S, start_s=20.0)
SHORT = Limits(hang_s=0.5, start_s=20.0)
"""For what never answers: it is waited for until then."""
PATIENT = Limits(hang_s=60.0, start_s=60.0)
"""For what a plug-in does rather than leaves undone: it has to come to it beside others that work."""

HEAD = """
import os, sys, signal, socket, struct, time
from pathlib import Path
from visup.agent import Contract

def supervisor():
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("PPid"):
            child = int(line.split()[1])
    # Up to the first process that is not of this session.
    while True:
        stat = Path(f"/proc/{child}/stat").read_text().rsplit(")", 1)[1].split()
        if stat[3] != MINE:
            return child
        child = int(stat[1])

MINE = Path("/proc/self/stat").read_text().rsplit(")", 1)[1].split()[3]

def connection():
    return int(sys.argv[1])

class Plug:
    contract = Contract("plug", gives=("x",), isolate=True)
    def perceive(self, frame, observation, directives):
        yield self.contract.percept(frame, self.does(frame))
    def does(self, frame):
"""


def isolated_behaviour(folder: Path, body: str, top: str = "") -> IsolatedBehaviour:
    """A behaviour that does something on each frame, and something when its file is imported."""
    lines = "".join(f"        {line}\n" for line in body.strip().split("\n"))
    path = folder / "plug.py"
    path.write_text(top + HEAD + lines)
    (contract,) = read_contracts(str(path))
    return IsolatedBehaviour(contract, str(path))


def reports(behaviour: IsolatedBehaviour, count: int = 2, limits: Limits = LIMITS) -> list[Report]:
    agent = Agent([behaviour], limits=limits)
    try:
        return [agent.step(f).reports[0] for f in frames(count)]
    finally:
        agent.close()


@pytest.mark.parametrize(
    ("top", "said"),
    [
        ("import os; os._exit(0)", "ended with exit code 0"),
        ("raise SystemExit(0)", "does not run: SystemExit"),
        ("import os; os.kill(os.getpid(), 9)", "ended by signal 9"),
        ("class Plug: pass\nraise ValueError('\\x1b[31mred')", "ValueError"),
        ("def broken(:", "SyntaxError"),
        ("import sys; print('last words', file=sys.stderr); import os; os._exit(3)", "last words"),
    ],
)
def test_a_file_that_ends_its_process_is_refused_with_a_message(
    tmp_path: Path, top: str, said: str
) -> None:
    path = tmp_path / "plug.py"
    path.write_text(top)
    with pytest.raises(BehaviourError, match=said):
        read_contracts(str(path))


def test_contracts_and_errors_equal_those_of_an_import(tmp_path: Path) -> None:
    path = tmp_path / "lamp.py"
    path.write_text(
        "from pydantic import BaseModel, Field\n"
        "from visup.agent import Contract\n"
        "class Lamp:\n"
        "    contract = Contract('lamp', gives=('lamp',), needs=('region',), cost_ms=3.5, history=2)\n"
        "    class Settings(BaseModel):\n"
        "        contrast: float = Field(100, gt=0)\n"
        "    def __init__(self, settings=None):\n"
        "        pass\n"
        "    def perceive(self, frame, observation, directives):\n"
        "        return ()\n"
    )
    (told,) = read_contracts(str(path))
    assert (told.name, told.needs, told.cost_ms, told.history) == ("lamp", ("region",), 3.5, 2)
    with pytest.raises(SettingsError, match="contrast"):
        read_contracts(str(path), {"lamp": {"contrast": -1}})


def test_the_file_of_a_plug_in_is_not_imported_by_the_supervisor(tmp_path: Path) -> None:
    mark = tmp_path / "pids"
    top = f"import os\nopen({str(mark)!r}, 'a').write(os.readlink('/proc/self') + '\\n')\n"
    told = reports(isolated_behaviour(tmp_path, "return 1", top))
    assert told[-1].state is ReportState.RAN
    assert str(os.getpid()) not in mark.read_text().split()


def test_reports_of_a_process_cannot_execute_code(tmp_path: Path) -> None:
    body = "return type('Evil', (), {'__reduce__': lambda self: (os.abort, ())})()"
    told = reports(isolated_behaviour(tmp_path, body))
    assert {r.state for r in told} == {ReportState.FAILED}


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("os.write(connection(), b'abc'); time.sleep(60)", "no answer within"),
        ("os.write(connection(), struct.pack('<Q', 50) + b'{'); time.sleep(60)", "no answer"),
        ("os.write(connection(), struct.pack('<Q', 2**62)); time.sleep(60)", "more than 256 MB"),
        (
            "os.write(connection(), struct.pack('<Q', 4) + b'nope'); time.sleep(90)",
            "cannot be read",
        ),
        ("os.write(connection(), struct.pack('<Q', 2) + b'[]'); time.sleep(90)", "no message"),
        (
            "os.write(connection(), struct.pack('<Q', 9_000_002) + b'[' * 9_000_002); time.sleep(90)",
            "more than 4000000 values",
        ),
        ("print('x' * 2**20, flush=True)\nwhile True: print('x' * 2**20)", "16 MB to its output"),
        ("os.close(connection()); time.sleep(60)", "no answer"),
        ("return 10 ** 400_000", "bits"),
        ("return '\\ud800'", "cannot be sent"),
    ],
)
def test_invalid_messages_are_a_failure_and_do_not_block(
    tmp_path: Path, body: str, said: str
) -> None:
    behaviour = isolated_behaviour(tmp_path, body)
    begin = time.monotonic()
    told = reports(behaviour, limits=SHORT if "no answer" in said else PATIENT)
    assert time.monotonic() - begin < LIMITS.start_s + 5 * HANG_S
    assert told[0].state in (ReportState.FAILED, ReportState.LATE)
    assert said in told[0].error


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no bounds of memory here")
def test_shared_memory_is_limited_too(tmp_path: Path) -> None:
    taken = reports(
        isolated_behaviour(tmp_path, "import mmap\nmmap.mmap(-1, 2**40)\nreturn 1"), 1, PATIENT
    )
    assert taken[0].state is ReportState.FAILED
    assert "memory" in taken[0].error


needs_namespaces = pytest.mark.skipif(
    not can_use_namespaces(), reason="processes cannot have namespaces of their own here"
)


@needs_namespaces
def test_a_plug_in_cannot_signal_the_supervisor(tmp_path: Path) -> None:
    got: list[int] = []
    before = signal.signal(signal.SIGUSR1, lambda number, frame: got.append(number))
    try:
        told = reports(
            isolated_behaviour(tmp_path, "os.kill(supervisor(), signal.SIGUSR1)\nreturn 1")
        )
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert told[0].state is ReportState.FAILED
    assert not got


@needs_namespaces
def test_a_plug_in_cannot_read_the_memory_of_the_supervisor(tmp_path: Path) -> None:
    told = reports(
        isolated_behaviour(tmp_path, "open(f'/proc/{supervisor()}/mem', 'r+b')\nreturn 1")
    )
    assert "PermissionError" in told[0].error


LEFTOVER = """
if os.fork() == 0:
    os.setsid()
    if os.fork():
        os._exit(0)
    time.sleep(60)
    os._exit(0)
time.sleep(0.2)
return [int(Path(p).name) for p in Path('/proc').glob('[0-9]*') if held(p)]
"""


@needs_namespaces
def test_children_of_a_plug_in_end_with_it(tmp_path: Path) -> None:
    # They are told by a file that only they hold open.
    mark = tmp_path / "held"
    top = (
        "import os\n"
        f"HELD = open({str(mark)!r}, 'w')\n"
        "def held(p):\n"
        "    try:\n"
        f"        return any(os.readlink(f) == {str(mark)!r} for f in os.scandir(f'{{p}}/fd'))\n"
        "    except OSError:\n"
        "        return False\n"
    )
    agent = Agent([isolated_behaviour(tmp_path, LEFTOVER, top)], limits=LIMITS)
    pids = agent.step(next(frames(1))).observation.of("x")[0]
    assert len(pids) >= 2
    assert all(map(alive, pids))
    agent.close()
    assert not any(map(alive, pids))


@pytest.mark.skipif(os.geteuid() == 0, reason="the system does not count the processes of root")
def test_a_plug_in_cannot_fork_without_limit(tmp_path: Path) -> None:
    body = "for n in range(3000):\n    if os.fork() == 0:\n        time.sleep(60)\nreturn n"
    assert "BlockingIOError" in reports(isolated_behaviour(tmp_path, body), 1, PATIENT)[0].error
