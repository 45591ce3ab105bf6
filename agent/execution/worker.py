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

_SOME = (ArithmeticError, ZeroDivisionError, AttributeError, IndexError, KeyError, MemoryError)
_MORE = (OSError, RecursionError, RuntimeError, TypeError, ValueError)
EXCEPTIONS: Mapping[str, type[Exception]] = MappingProxyType(
    {kind.__name__: kind for kind in (*_SOME, *_MORE)}
)
"""Exceptions that are reported by their names; all others become `BehaviourError`."""

LONGEST_REFUSAL = 100
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
        started = _answer(channel, lambda: _started(first))
        if started is None:
            return
        past: deque[PastFrame] = deque(maxlen=started.contract.history)
        while True:
            request = channel.receive()
            _answer(channel, lambda r=request: _run(started, r, past, frames))  # type: ignore[misc]


def _answer(channel: Channel, does: Callable[[], tuple[Message, Any]]) -> Any:
    """Call a function and send its answer; returns its result, or None if it failed."""
    made = None
    try:
        message, made = does()
    except BaseException as fault:
        # Any exception is a failure of the behaviour; the supervisor decides what follows.
        message = _failure(fault)
    try:
        channel.send(message)
    except ValueError as fault:
        channel.send({"fault": ["", f"what it reported cannot be sent: {error_line(fault)}"]})
    return made


def _contracts(asked: Message) -> tuple[Message, None]:
    """The contracts of a file or module, whose behaviours are created with their settings."""
    limit_at_start(0.0)
    made = load_behaviours(asked["where"], asked["settings"])
    return {"contracts": [contract_document(b.contract) for b in made]}, None


def _started(asked: Message) -> tuple[Message, Behaviour]:
    limit_at_start(asked["memory_mb"])
    behaviour = _rebuilt(asked) if "object" in asked else _loaded(asked)
    start_behaviour(behaviour)
    limit_memory(asked["memory_mb"])
    return {}, behaviour


def _loaded(asked: Message) -> Behaviour:
    """The behaviour of a name in a file or module."""
    for made in load_behaviours(asked["where"], asked["settings"]):
        if made.contract.name == asked["name"]:
            return made
    raise BehaviourError(f"there is no behaviour called '{asked['name']}'", where=asked["where"])


def _rebuilt(asked: Message) -> Behaviour:
    """A behaviour created in the supervisor, with the attributes that it had there."""
    for name in asked["modules"]:
        importlib.import_module(name)
    file = asked["file"]
    kind: Any = import_file(Path(file)) if file else importlib.import_module(asked["module"])
    for part in asked["object"].split("."):
        kind = getattr(kind, part)
    made = object.__new__(kind)
    for name, value in load_state(base64.b64decode(asked["attributes"])).items():
        object.__setattr__(made, name, value)
    if asked["own_settings"] is not None:
        object.__setattr__(made, "settings", kind.Settings.model_validate(asked["own_settings"]))
    return as_behaviour(made, asked["object"])


def _run(
    behaviour: Behaviour, request: Message, past: deque[PastFrame], frames: int
) -> tuple[Message, None]:
    contract = behaviour.contract
    for one in request["past"]:
        image = _image(one["image"], frames)
        seen = from_document(one["observation"])
        past.append(PastFrame(Frame(one["index"], one["time"], image), seen))
    frame = Frame(request["index"], request["time"], _image(request["image"], frames))
    observation_so_far = from_document(request["observation"])
    observation = Observation(
        observation_so_far.frame_index,
        observation_so_far.time,
        observation_so_far.frame_size,
        observation_so_far.reports,
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
    kind, said = type(fault).__name__, error_line(fault)
    refused = [_refusal(f) for f in _single_faults(fault)[:LONGEST_REFUSAL]]
    if kind in EXCEPTIONS:
        return {"fault": [kind, said.removeprefix(f"{kind}: ")], "refused": refused}
    return {"fault": ["", said], "refused": refused}


def _single_faults(fault: BaseException) -> list[VisupError]:
    if isinstance(fault, ErrorGroup):
        return list(fault.errors)
    return [fault] if isinstance(fault, VisupError) else []


def _refusal(fault: VisupError) -> Message:
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
