"""A behaviour in its own process, with hard limits of time and memory.

Images are passed in a memory file, everything else as messages, which are data (`messages.py`): nothing that
the process sends can execute here. A process that hangs or dies is replaced by a new one with the behaviour
in its initial state. `sandbox.py` starts and ends the process, `worker.py` runs in it.
"""

from __future__ import annotations

import base64
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.contract.limits import Limits
from visup.agent.execution.messages import Channel, Message, MessageError
from visup.agent.execution.runners import ProcessDiedError, RunTimeoutError, duration_text
from visup.agent.execution.sandbox import LARGEST_OUTPUT_BYTES, Sandbox
from visup.agent.execution.validation import check_percepts, collect_percepts
from visup.agent.execution.worker import EXCEPTIONS
from visup.agent.model.errors import BehaviourError
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, Percept
from visup.agent.plugins.isolated import IsolatedBehaviour
from visup.agent.storage.checkpoint import StateError, dump_state, loaded_modules, state_of
from visup.agent.storage.codec import decode_percept, encode, to_document

PLUGIN_MODULE_PREFIX = "visup_plugin_"


class ProcessRunner:
    """Runs a behaviour in its own process.

    Args:
        behaviour: The behaviour, which must not have run before.
        contract: Its contract.
        limits: Its limits.

    Raises:
        BehaviourError: It cannot be sent to another process.
    """

    def __init__(self, behaviour: Behaviour, contract: Contract, limits: Limits) -> None:
        self._contract = contract
        self._limits = limits
        memory_mb = limits.megabytes(contract)
        self._origin = {"do": "start", "memory_mb": memory_mb, **origin_of(behaviour, contract)}
        self._child: ChildProcess | None = None
        self._is_replacement = False
        self._last_sent_index = -1

    def maintain(self) -> bool:
        """Start a new process in place of a killed one, while the behaviour is suspended.

        Returns:
            Whether it is still starting and the step must not wait for it.
        """
        if self._child is not None and self._child.killed:
            self._child = self._start(self._child)
        if self._child is None or not self._is_replacement or not self._limits.budgets:
            return False
        return self._child.is_starting(self._limits.start_s)

    def run(
        self,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
        seconds: float | None,
    ) -> tuple[Percept, ...]:
        """See `Runner`."""
        child = self._ready(seconds)
        answer = child.ask(self._request(child, frame, observation, directives), seconds)
        if "fault" in answer:
            kind, text = _fault(answer)
            if kind == MemoryError.__name__:
                child.kill()  # frees its memory
            raise EXCEPTIONS.get(kind, BehaviourError)(text)
        percepts = collect_percepts(self._contract, _percepts(answer))
        check_percepts(self._contract, percepts, frame, observation)
        return percepts

    def close(self) -> None:
        """End the process."""
        if self._child is not None:
            self._child.close()
            self._child = None

    def _start(self, old: ChildProcess | None = None) -> ChildProcess:
        if old is not None:
            old.close()
        self._is_replacement = old is not None
        self._last_sent_index = -1
        return ChildProcess(self._origin)

    def _ready(self, seconds: float | None) -> ChildProcess:
        """The process, once its behaviour has started."""
        child = self._child = self._child or self._start()
        # A budget limits the wait of a step; without one, waiting keeps runs reproducible.
        wait_for_start = not self._limits.budgets or not self._is_replacement
        try:
            child.await_start(self._limits.start_s if wait_for_start else seconds)
        except BehaviourError as fault:
            if not isinstance(fault, RunTimeoutError) or wait_for_start:
                self._child = None
                child.close()
            raise
        return child

    def _request(
        self,
        child: ChildProcess,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
    ) -> Message:
        new_frames = [p for p in observation.past if p.frame.index > self._last_sent_index]
        if observation.past:
            self._last_sent_index = observation.past[-1].frame.index
        placements = child.place([frame.image, *(p.frame.image for p in new_frames)])
        return {
            "index": frame.index,
            "time": frame.time,
            "image": next(placements),
            "observation": to_document(observation),
            "directives": [encode(d) for d in directives],
            "past": [
                {
                    "index": p.frame.index,
                    "time": p.frame.time,
                    "image": image,
                    "observation": to_document(p.observation),
                }
                for p, image in zip(new_frames, placements, strict=True)
            ],
        }


class ChildProcess:
    """A process with a behaviour.

    Args:
        first: The first message: the behaviour to start, or a request for contracts.
    """

    def __init__(self, first: Message) -> None:
        self._sandbox = Sandbox()
        self._channel = Channel(self._sandbox.end)
        self._started_at = time.monotonic()
        self._started = False
        self.killed = False
        self.close = self._sandbox.close
        self._channel.send(first)

    def kill(self) -> None:
        """Kill it; it is reaped later."""
        self._sandbox.kill()
        self.killed = True

    def is_starting(self, patience_s: float) -> bool:
        """Whether it has not answered yet, and the given time has not passed."""
        if self._started or time.monotonic() - self._started_at > patience_s:
            return False
        return not self._channel.has_news()

    def await_start(self, seconds: float | None) -> None:
        """Wait until the behaviour has started.

        Raises:
            BehaviourError: It could not start, or not in time.
        """
        if self._started:
            return
        answer = self.receive(seconds, "it did not start")
        if "fault" in answer:
            kind, text = _fault(answer)
            raise BehaviourError(f"it does not start: {f'{kind}: ' if kind else ''}{text}")
        self._started = True

    def ask(self, request: Message, seconds: float | None) -> Message:
        """Send a request and wait for the answer; a process that does not answer is killed.

        Raises:
            BehaviourError: It did not answer in time, ended, or its answer is not valid.
        """
        try:
            try:
                self._channel.send(request, seconds)
            except TimeoutError as fault:
                raise RunTimeoutError("it does not listen") from fault
            except OSError as fault:
                raise self._died_error() from fault
            return self.receive(seconds, "it gave no answer")
        except BehaviourError:
            self.kill()
            raise

    def receive(self, seconds: float | None, what: str) -> Message:
        """The next message.

        Raises:
            BehaviourError: None arrived in time, the process ended, or it is not valid.
        """
        try:
            answer = self._channel.receive(seconds)
        except TimeoutError as fault:
            raise RunTimeoutError(f"{what} within {duration_text(seconds or 0.0)}") from fault
        except (EOFError, OSError) as fault:
            raise self._died_error() from fault
        except MessageError as fault:
            raise ProcessDiedError(str(fault)) from fault
        if not isinstance(answer, Mapping):
            raise ProcessDiedError("its answer is no message")
        return answer

    def place(self, images: Sequence[NDArray[np.uint8]]) -> Iterator[list[int]]:
        """Write images to the memory file; returns offset and shape of each."""
        # Written, not mapped: a process that truncates the file harms only itself.
        offset, placements = 0, []
        for image in images:
            data = np.ascontiguousarray(image).data.cast("B")
            written = 0
            while written < len(data):
                written += os.pwrite(self._sandbox.frames, data[written:], offset + written)
            placements.append([offset, *image.shape])
            offset += len(data)
        return iter(placements)

    def _died_error(self) -> ProcessDiedError:
        reason = self._sandbox.exit_text()
        if self._sandbox.output.exceeded:
            reason = f"wrote more than {LARGEST_OUTPUT_BYTES >> 20} MB to its output and was ended"
        return ProcessDiedError(f"its process {reason}")


def _fault(answer: Message) -> tuple[str, str]:
    document = answer["fault"]
    if (
        isinstance(document, list)
        and len(document) == 2
        and all(isinstance(t, str) for t in document)
    ):
        return document[0], " ".join(document[1].split())[:1000]
    raise ProcessDiedError("its answer is no message")


def _percepts(answer: Message) -> list[Percept]:
    try:
        return [decode_percept(p) for p in answer["percepts"]]
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as fault:
        raise BehaviourError(f"what it reported cannot be read ({error_text(fault)})") from fault


def error_text(fault: Exception) -> str:
    """The message of an exception, shortened."""
    return " ".join(f"{type(fault).__name__}: {fault}".split())[:200]


def origin_of(behaviour: Behaviour, contract: Contract) -> Message:
    """How a process recreates a behaviour: from its file, or from its class and attributes.

    Raises:
        BehaviourError: It cannot be recreated.
    """
    if isinstance(behaviour, IsolatedBehaviour):
        name = contract.name
        settings = {name: dict(behaviour.settings)} if behaviour.settings else {}
        return {"where": behaviour.where, "name": name, "settings": settings}
    kind = type(behaviour)
    module = sys.modules.get(kind.__module__)
    file = str(getattr(module, "__file__", "") or "")
    is_user_code = kind.__module__.startswith(PLUGIN_MODULE_PREFIX) or kind.__module__ == "__main__"
    attributes = state_of(behaviour)
    settings = _settings_document(kind, attributes.get("settings"))
    if settings is not None:
        del attributes["settings"]
    try:
        if "<locals>" in kind.__qualname__:
            raise StateError("a class inside a function")
        packed = dump_state(attributes)
    except StateError as fault:
        raise BehaviourError(
            f"behaviour '{contract.name}' cannot be sent to a process of its own: it holds {fault}",
            expected="attributes that are plain values, arrays and records of visup",
            hint="open models, sockets and devices in its method `start`, not in `__init__`",
        ) from fault
    return {
        "object": kind.__qualname__,
        "module": kind.__module__,
        "file": file if is_user_code else "",
        "modules": loaded_modules(packed),
        "attributes": base64.b64encode(packed).decode(),
        "own_settings": settings,
    }


def _settings_document(kind: type, given: Any) -> Any:
    """The settings of a plug-in as JSON values, or None."""
    model = getattr(kind, "Settings", None)
    if isinstance(model, type) and isinstance(given, model) and hasattr(given, "model_dump"):
        return given.model_dump(mode="json")
    return None
