"""The worker process of an isolated behaviour; the counterpart of `process_runner.py`.

Started by `sandbox.py` as `python -m visup.agent.execution.worker`. The first message requests contracts or
names the behaviour to start; the following ones are frames. Answers are data (`messages.py`).
"""

from __future__ import annotations

import base64
import importlib
import os
import signal
import socket
import sys
import threading
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.execution.messages import Channel, Message
from visup.agent.execution.resource_limits import limit_at_start, limit_memory
from visup.agent.execution.runners import error_line, run_behaviour, start_behaviour
from visup.agent.model.errors import BehaviourError, ErrorGroup, VisupError
from visup.agent.model.records import Frame, Observation, PastFrame
from visup.agent.plugins.factory import as_behaviour, import_file, load_behaviours
from visup.agent.storage.checkpoint import load_state
from visup.agent.storage.codec import (
    UnsupportedTypeError,
    decode,
    encode_percept,
    from_document,
)

_BUILT_IN = (
    *(ArithmeticError, ZeroDivisionError, AttributeError, IndexError, KeyError, MemoryError),
    *(OSError, RecursionError, RuntimeError, TypeError, ValueError),
)
EXCEPTIONS: Mapping[str, type[Exception]] = MappingProxyType(
    {kind.__name__: kind for kind in _BUILT_IN}
)
"""Exceptions that are reported by their names; all others become `BehaviourError`."""

MAX_REPORTED_FAULTS = 100
"""Maximum number of reported faults of settings."""


def main(channel: Channel, frames: int) -> None:
    """Serve the supervisor until it closes its end.

    Args:
        channel: Channel to the supervisor.
        frames: Descriptor of the file with the images.
    """
    with suppress(EOFError, OSError):
        first = channel.receive()
        if first["do"] == "contracts":
            _answer(channel, lambda: _contracts(first))
            return
        started = _answer(channel, lambda: _start_requested(first))
        if started is None:
            return
        past: deque[PastFrame] = deque(maxlen=started.contract.history)
        while True:
            request = channel.receive()
            _answer(channel, lambda r=request: _run(started, r, past, frames))  # type: ignore[misc]


def _answer(channel: Channel, work: Callable[[], tuple[Message, Any]]) -> Any:
    """Call a function and send its answer; returns its result, or None if it failed."""
    result = None
    try:
        message, result = work()
    except BaseException as fault:
        # Any exception is a failure of the behaviour; the supervisor decides what follows.
        message = _failure(fault)
    try:
        channel.send(message)
    except ValueError as fault:
        channel.send({"fault": ["", f"what it reported cannot be sent: {error_line(fault)}"]})
    return result


def _contracts(request: Message) -> tuple[Message, None]:
    """The contracts of a file or module, whose behaviours are created with their settings."""
    limit_at_start(0.0)
    behaviours = load_behaviours(request["where"], request["settings"])
    return {"contracts": [contract_document(b.contract) for b in behaviours]}, None


def _start_requested(request: Message) -> tuple[Message, Behaviour]:
    limit_at_start(request["memory_mb"])
    behaviour = _recreated(request) if "object" in request else _loaded(request)
    start_behaviour(behaviour)
    limit_memory(request["memory_mb"])
    return {}, behaviour


def _loaded(request: Message) -> Behaviour:
    """The behaviour of a name in a file or module."""
    for behaviour in load_behaviours(request["where"], request["settings"]):
        if behaviour.contract.name == request["name"]:
            return behaviour
    raise BehaviourError(
        f"there is no behaviour called '{request['name']}'", where=request["where"]
    )


def _recreated(request: Message) -> Behaviour:
    """A behaviour created in the supervisor, with the attributes that it had there."""
    for name in request["modules"]:
        importlib.import_module(name)
    file = request["file"]
    kind: Any = import_file(Path(file)) if file else importlib.import_module(request["module"])
    for part in request["object"].split("."):
        kind = getattr(kind, part)
    behaviour = object.__new__(kind)
    for name, value in load_state(base64.b64decode(request["attributes"])).items():
        object.__setattr__(behaviour, name, value)
    if request["own_settings"] is not None:
        object.__setattr__(
            behaviour, "settings", kind.Settings.model_validate(request["own_settings"])
        )
    return as_behaviour(behaviour, request["object"])


def _run(
    behaviour: Behaviour, request: Message, past: deque[PastFrame], frames: int
) -> tuple[Message, None]:
    contract = behaviour.contract
    for past_frame in request["past"]:
        image = _image(past_frame["image"], frames)
        past_observation = from_document(past_frame["observation"])
        past.append(
            PastFrame(Frame(past_frame["index"], past_frame["time"], image), past_observation)
        )
    frame = Frame(request["index"], request["time"], _image(request["image"], frames))
    received = from_document(request["observation"])
    observation = Observation(
        received.frame_index,
        received.time,
        received.frame_size,
        received.reports,
        tuple(past),
    )
    directives = tuple(decode(d) for d in request["directives"])
    percepts = run_behaviour(behaviour, contract, frame, observation, directives)
    try:
        return {"percepts": [encode_percept(p) for p in percepts]}, None
    except UnsupportedTypeError as fault:
        raise BehaviourError(
            f"what it reported cannot be sent: {fault}",
            expected="plain values, arrays, and records of visup",
        ) from fault


def _failure(fault: BaseException) -> Message:
    if isinstance(fault, SystemExit | GeneratorExit | KeyboardInterrupt):
        return {"fault": ["", f"it called for an exit ({type(fault).__name__})"]}
    kind, text = type(fault).__name__, error_line(fault)
    reported = [_error_document(f) for f in _single_faults(fault)[:MAX_REPORTED_FAULTS]]
    if kind in EXCEPTIONS:
        return {"fault": [kind, text.removeprefix(f"{kind}: ")], "refused": reported}
    return {"fault": ["", text], "refused": reported}


def _single_faults(fault: BaseException) -> list[VisupError]:
    if isinstance(fault, ErrorGroup):
        return list(fault.errors)
    return [fault] if isinstance(fault, VisupError) else []


def _error_document(fault: VisupError) -> Message:
    where = None if fault.where is None else str(fault.where)
    return {
        "kind": type(fault).__name__,
        "what": fault.what,
        "where": where,
        "expected": fault.expected,
        "hint": fault.hint,
    }


def contract_document(contract: Contract) -> Message:
    """A contract as JSON values."""
    return {f.name: getattr(contract, f.name) for f in fields(contract)}


def _image(placed: list[int], frames: int) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    """A copy of an image: the behaviour may keep frames, while the file is overwritten."""
    offset, *shape = placed
    data = os.pread(frames, int(np.prod(shape)), offset)
    return np.frombuffer(data, np.uint8).reshape(shape)  # read-only, since it is backed by bytes


def _end_with_supervisor(lifeline: int) -> None:
    """End with a killed supervisor, on systems where nothing else does."""
    while os.read(lifeline, 1):
        pass
    os._exit(1)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the supervisor decides when to stop
    connection, memory, lifeline_end = map(int, sys.argv[1:4])
    for handle in (connection, memory, lifeline_end):
        os.set_inheritable(handle, False)
    threading.Thread(target=_end_with_supervisor, args=(lifeline_end,), daemon=True).start()
    main(Channel(socket.socket(fileno=connection)), memory)
