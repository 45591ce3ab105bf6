"""Checkpoints next to the journal, from which a killed run resumes within seconds."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import OutputError
from visup.agent.model.step import Step
from visup.agent.storage.atomic import write_atomically
from visup.agent.storage.checkpoint import StateError, dump_state, load_state
from visup.agent.storage.seal import SealError, own_key, seal, unsealed
from visup.agent.storage.text_file import read_bounded
from visup.version import __version__

CHECKPOINT = "state.bin"
MAX_STATE_BYTES = 2**30
STATE_MODULES = ("visup.runs.wiring", "visup.report.collector")
"""Modules whose classes, with those they import, may be in a state; reading instantiates only loaded
classes."""
COMPRESSED = b"VISUPSTZ"
"""Prefix of a compressed state."""
BYTES_PER_HOUR = 160e6
BURST_BYTES = 40e6
"""Write budget of states per hour of the source, and its burst size: at most 200 MB in any hour. Between two
states nearly all data of behaviours change, so that differences would be no smaller; compressed, a state has
an eighth of its size. Large states are saved less often."""


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """The state of a run after a step.

    Attributes:
        frame_index: Number of the step's frame.
        agent: State for `Agent.load`.
        recorder: State of the recorder.
    """

    frame_index: int
    agent: Mapping[str, Any]
    recorder: Mapping[str, Any]


class CheckpointWriter:
    """Saves the latest state to a file, replaced atomically in a separate thread.

    Args:
        folder: The run folder.
        every_s: Seconds of the source between two states; 0 saves none.

    Attributes:
        note: Why no state can be saved, or None.
        largest: Size of the largest state so far, bytes in memory.
        written: Bytes written so far.
    """

    def __init__(self, folder: Path, every_s: float) -> None:
        self.note, self._key = _sealing_key() if every_s else (None, b"")
        self.largest = 0
        self.written = 0
        self._path = folder / CHECKPOINT
        self._every_s = every_s
        self._last_saved: float | None = None
        self._disk = ThreadPoolExecutor(max_workers=1, thread_name_prefix="state")
        self._last_offered: float | None = None
        self._writing: Future[None] | None = None
        self._write_budget = BURST_BYTES
        self._size = 0.0

    def offer(
        self, agent: Agent, step: Step, recorder_state: Callable[[], Mapping[str, Any] | None]
    ) -> None:
        """Save the state after a step if it is due.

        Args:
            agent: The agent after the step.
            step: The step, already in the journal.
            recorder_state: Gives the state of the recorder; None if no state can be saved now.
        """
        self._last_saved = step.time if self._last_saved is None else self._last_saved
        if self._last_offered is not None:
            saved = max(0.0, step.time - self._last_offered) * BYTES_PER_HOUR / 3600.0
            self._write_budget = min(BURST_BYTES, self._write_budget + saved)
        self._last_offered = step.time
        busy = self._writing is not None and not self._writing.done()
        early = step.time - self._last_saved < self._every_s or self._write_budget < min(
            self._size, BURST_BYTES
        )
        if not self._every_s or self.note or busy or early:
            return
        self._last_saved = step.time
        recorder = recorder_state()
        data = None if recorder is None else self._serialised_or_none(agent, step, recorder)
        if data is not None:
            with suppress(RuntimeError):  # no memory for a thread
                self._writing = self._disk.submit(self._write, data)

    def keep(self, agent: Agent, step: Step, recorder: Mapping[str, Any] | None) -> None:
        """Save the state after a step at once, and wait until it is on disk.

        Args:
            agent: The agent after the step.
            step: The step, already in the journal.
            recorder: State of the recorder; None if no state can be saved now.
        """
        if not self._every_s or self.note or recorder is None:
            return
        self._last_saved = step.time
        data = self._serialised_or_none(agent, step, recorder)
        if data is not None:
            self._disk.submit(self._write, data).result()

    def _serialised_or_none(
        self, agent: Agent, step: Step, recorder: Mapping[str, Any]
    ) -> bytes | None:
        """The serialised state, or None if it cannot be saved."""
        try:
            data = self._serialised(agent, step, recorder)
        except StateError as fault:
            self.note = _not_saved_note(fault)
            return None
        except MemoryError:
            return None  # no memory for a copy: the older state stays, supervision goes on
        self.largest = max(self.largest, len(data))
        return data

    def _write(self, data: bytes) -> None:
        packed = seal(COMPRESSED + zlib.compress(data, 1), self._key)
        # On failure the older state stays; disk faults are reported for the journal.
        with suppress(OSError):
            write_atomically(self._path, packed)
        self.written += len(packed)
        self._size = float(len(packed))
        self._write_budget -= len(packed)

    def close(self) -> None:
        """Wait for the disk."""
        self._disk.shutdown(wait=True)

    def _serialised(self, agent: Agent, step: Step, recorder: Mapping[str, Any]) -> bytes:
        state = agent.save()
        if state["behaviours"] is None:
            raise StateError("a behaviour has no save and load")
        return dump_state(
            {
                "visup": __version__,
                "frame_index": step.frame_index,
                "agent": state,
                "kept": dict(recorder),
            }
        )


def _sealing_key() -> tuple[str | None, bytes]:
    """Why no state can be saved, or None; and the key."""
    try:
        return None, own_key()
    except SealError as fault:
        return _not_saved_note(fault), b""


def _not_saved_note(fault: Exception) -> str:
    return f"no checkpoint of this run is kept ({fault}): resuming it perceives all frames again"


def read_checkpoint(folder: Path) -> tuple[Checkpoint | None, str | None]:
    """The state in a run folder, if this user's visup wrote it, since its content is trusted.

    Returns:
        The state, or None if there is no usable one; and why an existing state is not usable.
    """
    for name in STATE_MODULES:
        import_module(name)
    try:
        packed = unsealed(read_bounded(folder / CHECKPOINT, MAX_STATE_BYTES))
        state = load_state(_decompressed(packed))
        if state["visup"] != __version__:
            return None, f"its checkpoint is of visup {state['visup']}"
        return Checkpoint(int(state["frame_index"]), state["agent"], state["kept"]), None
    except FileNotFoundError:
        return None, None
    except (OSError, OutputError, KeyError, TypeError, ValueError) as fault:
        return None, str(fault)


def _decompressed(data: bytes) -> bytes:
    """The decompressed state.

    Raises:
        ValueError: It is damaged or too large.
    """
    if not data.startswith(COMPRESSED):
        return data
    inflater = zlib.decompressobj()
    try:
        state = inflater.decompress(data[len(COMPRESSED) :], MAX_STATE_BYTES)
    except zlib.error as fault:
        raise ValueError("its check sum is wrong") from fault
    if not inflater.eof:
        raise ValueError("it is cut off or too large")
    return state
