"""A behaviour in a process of its own: hard limits of time and memory, whatever it does.

The frame goes over shared memory, everything else as messages. The process is started by a server
that has the libraries loaded already where the platform has one (`forkserver`), else afresh
(`spawn`). A process that hangs or dies is replaced by a new one, whose behaviour is as it was when
it was plugged in: what it had learnt is lost. `worker.py` is the other end.

Both ends are pickled through a pipe that nobody else can open. Loading what comes back may run code of the
behaviour's, which importing its file here has done before: isolation is for mishaps, not for malice.
"""

from __future__ import annotations

import multiprocessing as mp
import pickle
import sys
import weakref
from collections.abc import Sequence
from multiprocessing.connection import Connection
from multiprocessing.context import BaseContext
from multiprocessing.process import BaseProcess
from multiprocessing.shared_memory import SharedMemory
from typing import Any

import numpy as np

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.contract.limits import Limits
from visup.agent.execution.runners import ProcessDiedError, RunTimeoutError, duration_text
from visup.agent.execution.validation import check_percepts, collect_percepts
from visup.agent.execution.worker import (
    EXCEPTIONS,
    PackedBehaviour,
    RunReply,
    RunRequest,
    pickled,
    serve,
)
from visup.agent.model.errors import BehaviourError
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, Percept

LARGEST_REPLY_BYTES = 256 * 2**20
"""Bytes of one answer; what is larger is refused unread."""


class ProcessRunner:
    """Runs a behaviour in a process of its own.

    Args:
        behaviour: What is run; it must not have run before.
        contract: Its contract.
        limits: What it is held to.

    Raises:
        BehaviourError: It cannot be sent to another process.
    """

    def __init__(self, behaviour: Behaviour, contract: Contract, limits: Limits) -> None:
        self._contract = contract
        self._limits = limits
        self._parcel = pack_behaviour(behaviour, contract)
        self._child: _ChildProcess | None = None
        self._sent = -1

    def maintain(self) -> bool:
        """Start a new process in place of one that was killed, while the behaviour is suspended."""
        if self._child is not None and self._child.killed:
            self._child = self._start(self._child)
        return False

    def run(
        self,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
        seconds: float | None,
    ) -> tuple[Percept, ...]:
        """See `Runner`."""
        child = self._ready(seconds)
        try:
            answer = child.ask(self._request(child, frame, observation, directives), seconds)
        except (RunTimeoutError, ProcessDiedError):
            child.kill()
            raise
        if answer.fault is not None:
            kind, said = answer.fault
            if kind == MemoryError.__name__:
                child.kill()  # what it holds is given back
            raise EXCEPTIONS.get(kind, BehaviourError)(said)
        percepts = collect_percepts(self._contract, answer.percepts)
        check_percepts(self._contract, percepts, frame, observation)
        return percepts

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.end()
            self._child = None

    def _start(self, old: _ChildProcess | None = None) -> _ChildProcess:
        if old is not None:
            old.end()
        self._sent = -1
        memory_mb = self._limits.megabytes(self._contract)
        return _ChildProcess(self._parcel, memory_mb, replaces=old is not None)

    def _ready(self, seconds: float | None) -> _ChildProcess:
        """The process, once its behaviour has started."""
        child = self._child = self._child or self._start()
        # A budget says how long a step may wait; without one, waiting keeps runs repeatable.
        patient = not self._limits.budgets or not child.replaces
        try:
            child.await_start(self._limits.start_s if patient else seconds)
        except BehaviourError as fault:
            if not isinstance(fault, RunTimeoutError) or patient:
                self._child = None
                child.end()
            raise
        return child

    def _request(
        self,
        child: _ChildProcess,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
    ) -> RunRequest:
        news = tuple(p for p in observation.past if p.frame.index > self._sent)
        if observation.past:
            self._sent = observation.past[-1].frame.index
        without = Observation(
            observation.frame_index, observation.time, observation.frame_size, observation.reports
        )
        return RunRequest(
            frame.index, frame.time, *child.place(frame.image), without, tuple(directives), news
        )


def pack_behaviour(behaviour: Behaviour, contract: Contract) -> PackedBehaviour:
    """A behaviour as it is sent to a process.

    Raises:
        BehaviourError: It cannot be sent.
    """
    module = sys.modules.get(type(behaviour).__module__)
    file = str(getattr(module, "__file__", "") or "")
    own = module is not None and module.__name__.startswith("visup_plugin_")
    try:
        packed = pickled(behaviour)
    except Exception as fault:
        raise BehaviourError(
            f"behaviour '{contract.name}' cannot be sent to a process of its own: {fault}",
            expected="attributes that can be pickled",
            hint="open models, sockets and devices in its method `start`, not in `__init__`",
        ) from fault
    return PackedBehaviour(packed, file if own else "", tuple(sys.path), contract)


class _ChildProcess:
    """A process with a behaviour, and the memory shared with it."""

    def __init__(self, sent: PackedBehaviour, memory_mb: float, *, replaces: bool) -> None:
        context = _context()
        here, there = context.Pipe()
        process = context.Process(  # type: ignore[attr-defined]
            target=serve, args=(there, sent, memory_mb), name="visup behaviour", daemon=True
        )
        process.start()
        there.close()
        self.replaces = replaces
        self._process: BaseProcess = process
        self._pipe: Connection = here
        self.killed = False
        self._shared: list[SharedMemory] = []
        self._started = False
        self.end = weakref.finalize(self, _end, process, here, self._shared)

    def kill(self) -> None:
        """Stop it at once; it is cleared away later."""
        self._process.kill()
        self.killed = True

    def await_start(self, seconds: float | None) -> None:
        """Wait until the behaviour has started.

        Raises:
            BehaviourError: It could not start, or not in time.
        """
        if self._started:
            return
        answer = self._receive(seconds, "it did not start")
        if answer.fault is not None:
            kind, said = answer.fault
            raise BehaviourError(f"it does not start: {f'{kind}: ' if kind else ''}{said}")
        self._started = True

    def ask(self, request: RunRequest, seconds: float | None) -> RunReply:
        """Send a request and wait for the answer."""
        try:
            self._pipe.send_bytes(pickled(request))
        except OSError as fault:
            raise self._lost() from fault
        return self._receive(seconds, "it gave no answer")

    def place(self, image: np.ndarray[Any, np.dtype[np.uint8]]) -> tuple[str, tuple[int, ...]]:
        """Put an image where the process finds it: name of the shared memory, shape."""
        if not self._shared or self._shared[0].size < image.nbytes:
            _release(self._shared)
            self._shared.append(SharedMemory(create=True, size=max(1, image.nbytes)))
        block = self._shared[0]
        np.ndarray(image.shape, np.uint8, block.buf)[:] = image
        return block.name, image.shape

    def _receive(self, seconds: float | None, what: str) -> RunReply:
        try:
            if not self._pipe.poll(seconds):
                raise RunTimeoutError(f"{what} within {duration_text(seconds or 0.0)}")
            answer: RunReply = pickle.loads(self._pipe.recv_bytes(LARGEST_REPLY_BYTES))
        except (EOFError, OSError) as fault:
            raise self._lost() from fault
        return answer

    def _lost(self) -> ProcessDiedError:
        self._process.join(1.0)
        code = self._process.exitcode
        how = f"by signal {-code}" if code is not None and code < 0 else f"with exit code {code}"
        return ProcessDiedError(f"its process ended {how}")


def _end(process: BaseProcess, pipe: Connection, shared: list[SharedMemory]) -> None:
    process.kill()
    process.join(5.0)
    pipe.close()
    _release(shared)


def _release(shared: list[SharedMemory]) -> None:
    while shared:
        block = shared.pop()
        block.close()
        block.unlink()


def _context() -> BaseContext:
    if "forkserver" not in mp.get_all_start_methods():
        return mp.get_context("spawn")
    context = mp.get_context("forkserver")
    context.set_forkserver_preload(["visup.agent.execution.worker"])
    return context
