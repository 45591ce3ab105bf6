"""The other end of `process_runner.py`: what runs in the process of an isolated behaviour."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from io import BytesIO
from multiprocessing.connection import Connection, wait
from multiprocessing.process import parent_process
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.execution.runners import error_line, run_behaviour, start_behaviour
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, PastFrame, Percept
from visup.agent.plugins.factory import import_file

_SOME = (ArithmeticError, ZeroDivisionError, AttributeError, IndexError, KeyError, MemoryError)
_MORE = (OSError, RecursionError, RuntimeError, TypeError, ValueError)
EXCEPTIONS: Mapping[str, type[Exception]] = MappingProxyType(
    {kind.__name__: kind for kind in (*_SOME, *_MORE)}
)
"""Exceptions that are told by their own names; all others come as `BehaviourError`."""


@dataclass(frozen=True, slots=True)
class PackedBehaviour:
    """A behaviour on its way to a process.

    Attributes:
        packed: The behaviour, pickled.
        file: The file of the user's own in which its class stands, or ''.
        paths: Where modules are found.
        contract: Its contract.
    """

    packed: bytes
    file: str
    paths: tuple[str, ...]
    contract: Contract


@dataclass(frozen=True, slots=True)
class RunRequest:
    """A frame to run on.

    Attributes:
        index: Of the frame.
        time: Of the frame, seconds.
        shared: Name of the shared memory with its image.
        shape: Of the image, uint8.
        observation: What others reported of it.
        directives: What the last step asked for.
        past: Past frames that were not sent before.
    """

    index: int
    time: float
    shared: str
    shape: tuple[int, ...]
    observation: Observation
    directives: tuple[Directive, ...]
    past: tuple[PastFrame, ...]


@dataclass(frozen=True, slots=True)
class RunReply:
    """What came of it: percepts, or the kind and the words of a fault."""

    percepts: tuple[Percept, ...] = ()
    fault: tuple[str, str] | None = None


def serve(pipe: Connection, parcel: PackedBehaviour, memory_mb: float) -> None:
    """Start a behaviour and run it on the frames that come, until the other end is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the supervisor decides when to stop
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        behaviour = _unpacked(parcel)
        start_behaviour(behaviour)
        _limit(memory_mb)
    except BaseException as fault:
        _send(pipe, _failure_reply(fault))
        return
    _send(pipe, RunReply())
    past: deque[PastFrame] = deque(maxlen=parcel.contract.history)
    with suppress(EOFError):
        while True:
            request: RunRequest = pickle.loads(pipe.recv_bytes())
            _send(pipe, _answer(behaviour, parcel.contract, request, past))


def _answer(
    behaviour: Behaviour, contract: Contract, request: RunRequest, past: deque[PastFrame]
) -> RunReply:
    try:
        past.extend(request.past)
        frame = Frame(request.index, request.time, _image(request))
        observation = replace(request.observation, past=tuple(past))
        return RunReply(run_behaviour(behaviour, contract, frame, observation, request.directives))
    except BaseException as fault:
        # Whatever it is, it is the behaviour's failure; the supervisor decides what comes of it.
        return _failure_reply(fault)


def _failure_reply(fault: BaseException) -> RunReply:
    if isinstance(fault, SystemExit | GeneratorExit | KeyboardInterrupt):
        return RunReply(fault=("", f"it called for an exit ({type(fault).__name__})"))
    kind, said = type(fault).__name__, error_line(fault)
    if kind in EXCEPTIONS:
        return RunReply(fault=(kind, said.removeprefix(f"{kind}: ")))
    return RunReply(fault=("", said))


def _send(pipe: Connection, answer: RunReply) -> None:
    try:
        sent = pickled(answer)
    except Exception as fault:
        # A value that cannot be sent is a fault of what was perceived.
        said = f"what it reported cannot be sent: {type(fault).__name__}: {fault}"
        sent = pickled(RunReply(fault=("", said[:1000])))
    with suppress(OSError):
        pipe.send_bytes(sent)


def pickled(value: object) -> bytes:
    """A value pickled; read-only mappings, which records hold, are among what can be."""
    into = BytesIO()
    _Pickler(into, pickle.HIGHEST_PROTOCOL).dump(value)
    return into.getvalue()


def _read_only(values: dict[Any, Any]) -> Mapping[Any, Any]:
    return MappingProxyType(values)


class _Pickler(pickle.Pickler):
    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, MappingProxyType):
            return _read_only, (dict(obj),)
        return NotImplemented


_attached: dict[str, SharedMemory] = {}


def _image(request: RunRequest) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """A copy of its own: the behaviour may keep frames, the shared memory is written over."""
    block = _attached.get(request.shared)
    if block is None:
        for old in _attached.values():
            old.close()
        _attached.clear()
        block = _attached[request.shared] = SharedMemory(request.shared)
    image = np.array(np.ndarray(request.shape, np.uint8, block.buf))
    image.flags.writeable = False
    return image


def _unpacked(parcel: PackedBehaviour) -> Behaviour:
    sys.path[:] = parcel.paths
    if parcel.file:
        import_file(Path(parcel.file))
    behaviour: Behaviour = pickle.loads(parcel.packed)
    return behaviour


def _limit(memory_mb: float) -> None:
    """Bound the memory of this process, where the platform can: what it has now and so much more."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[5])
        most = pages * resource.getpagesize() + int(memory_mb * 2**20)
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        if hard == resource.RLIM_INFINITY or most < hard:
            resource.setrlimit(resource.RLIMIT_DATA, (most, hard))
    except (ImportError, OSError, ValueError):
        return


def _end_with_parent() -> None:
    """A supervisor that was killed leaves no process behind, not even one that hangs."""
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)
