"""Running a behaviour on a frame: in the caller's thread, or in a thread that can be abandoned.

`process_runner.py` has the third kind, a separate process. All three implement `Runner`.
"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
import weakref
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from queue import SimpleQueue
from typing import Protocol

from visup.agent.contract.behaviour import Behaviour
from visup.agent.contract.contract import Contract
from visup.agent.execution.validation import check_percepts, collect_percepts
from visup.agent.model.errors import BehaviourError
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Observation, Percept

STOP_WAIT_S = 0.05
"""How long a step waits for a thread that was asked to stop, seconds."""


class RunTimeoutError(BehaviourError):
    """The behaviour did not answer in time."""


class ProcessDiedError(BehaviourError):
    """The behaviour's process ended."""


class MemoryLimitError(BehaviourError):
    """The behaviour exceeded its memory limit."""


class Runner(Protocol):
    """Runs one behaviour; its exceptions are failures of the behaviour."""

    def maintain(self) -> bool:
        """Maintenance between runs: stop abandoned runs, replace processes that ended.

        Returns:
            Whether an abandoned run is still active.
        """
        ...

    def run(
        self,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
        seconds: float | None,
    ) -> tuple[Percept, ...]:
        """Run it on a frame, with a time limit in seconds.

        Raises:
            Exception: Whatever the behaviour raised, `BehaviourError` for invalid output, `RunTimeoutError`,
                `ProcessDiedError` or `MemoryLimitError`.
        """
        ...

    def close(self) -> None:
        """Release its resources."""
        ...


def run_behaviour(
    behaviour: Behaviour,
    contract: Contract,
    frame: Frame,
    observation: Observation,
    directives: Sequence[Directive],
) -> tuple[Percept, ...]:
    """The validated percepts of a behaviour for a frame."""
    percepts = collect_percepts(contract, behaviour.perceive(frame, observation, directives))
    check_percepts(contract, percepts, frame, observation)
    return percepts


def start_behaviour(behaviour: Behaviour) -> tuple[Percept, ...]:
    """Call its method `start`, if it has one; returns no percepts."""
    start = getattr(behaviour, "start", None)
    if callable(start):
        start()
    return ()


class DirectRunner:
    """Runs a behaviour in the caller's thread, where nothing can stop it."""

    def __init__(self, behaviour: Behaviour, contract: Contract) -> None:
        self._behaviour = behaviour
        self._contract = contract
        self._started = False

    def maintain(self) -> bool:
        """Nothing to do: no run is ever abandoned."""
        return False

    def run(
        self,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
        seconds: float | None,
    ) -> tuple[Percept, ...]:
        """See `Runner`; `seconds` is ignored."""
        try:
            if not self._started:
                start_behaviour(self._behaviour)
                self._started = True
            return run_behaviour(self._behaviour, self._contract, frame, observation, directives)
        except (SystemExit, GeneratorExit) as exit_fault:
            raise _as_error(exit_fault) from exit_fault

    def close(self) -> None:
        """Nothing to release."""


@dataclass(slots=True)
class _Job:
    """One run passed to a thread."""

    work: Callable[[], tuple[Percept, ...]]
    done: threading.Event = field(default_factory=threading.Event)
    completion_lock: threading.Lock = field(default_factory=threading.Lock)
    started: bool = False
    abandoned: bool = False
    percepts: tuple[Percept, ...] = ()
    fault: BaseException | None = None

    def run(self) -> None:
        """Do the work once and store the result."""
        if not self.started:
            self.started = True
            try:
                self.percepts = self.work()
            except BaseException as fault:
                # Any exception is a failure of the behaviour and is re-raised in the waiting thread.
                self.fault = fault if isinstance(fault, Exception) else _as_error(fault)
        with self.completion_lock:
            self.done.set()


class ThreadRunner:
    """Runs a behaviour in its own thread, which is abandoned if it takes too long.

    The next run gets a new thread once the abandoned one has ended.

    Args:
        behaviour: The behaviour.
        contract: Its contract.
        start_s: Time limit of its method `start`, seconds.
    """

    def __init__(self, behaviour: Behaviour, contract: Contract, start_s: float) -> None:
        self._behaviour = behaviour
        self._contract = contract
        self._start_s = start_s
        self._started = False
        self._jobs: SimpleQueue[_Job | None] | None = None
        self._thread: threading.Thread | None = None
        self._abandoned: tuple[threading.Thread, _Job] | None = None

    def maintain(self) -> bool:
        """Ask an abandoned run to stop once more; returns whether it is still active."""
        if self._abandoned is None:
            return False
        thread, job = self._abandoned
        if thread.is_alive():
            _request_stop(thread, job)
            return True
        self._abandoned = None
        return False

    def run(
        self,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
        seconds: float | None,
    ) -> tuple[Percept, ...]:
        """See `Runner`."""
        behaviour, contract = self._behaviour, self._contract
        if not self._started:
            self._wait(_Job(lambda: start_behaviour(behaviour)), self._start_s)
            self._started = True
        return self._wait(
            _Job(lambda: run_behaviour(behaviour, contract, frame, observation, directives)),
            seconds,
        )

    def close(self) -> None:
        """Let the thread end once it is idle."""
        if self._jobs is not None:
            self._jobs.put(None)
            self._jobs = None

    def _wait(self, job: _Job, seconds: float | None) -> tuple[Percept, ...]:
        self._queue().put(job)
        if not job.done.wait(seconds):
            self._abandon(job)
            raise RunTimeoutError(f"it gave no answer within {duration_text(seconds or 0.0)}")
        if job.fault is not None:
            raise job.fault
        return job.percepts

    def _queue(self) -> SimpleQueue[_Job | None]:
        if self._jobs is None:
            jobs: SimpleQueue[_Job | None] = SimpleQueue()
            self._thread = threading.Thread(
                target=_serve, args=(jobs,), name=f"behaviour {self._contract.name}", daemon=True
            )
            self._thread.start()
            weakref.finalize(self, jobs.put, None)
            self._jobs = jobs
        return self._jobs

    def _abandon(self, job: _Job) -> None:
        job.abandoned = True
        self.close()
        if self._thread is not None:
            self._abandoned = self._thread, job
            _request_stop(self._thread, job)
            # Python code stops at once; other code is checked again in later steps.
            self._thread.join(STOP_WAIT_S)


def _serve(jobs: SimpleQueue[_Job | None]) -> None:
    while (job := jobs.get()) is not None:
        while not job.done.is_set():
            # The request to stop may arrive at any moment; the work is never repeated.
            with suppress(_StopRequested):
                job.run()
        if job.abandoned:
            return
        del job  # an idle thread must not keep a frame alive


def _as_error(fault: BaseException) -> BehaviourError:
    """Convert SystemExit and the like: a plug-in may end itself, never the supervisor."""
    return BehaviourError(f"it called for an exit ({type(fault).__name__})")


class _StopRequested(SystemExit):
    """Raised in an abandoned thread: it passes behaviours that catch `Exception`."""


def _request_stop(thread: threading.Thread, job: _Job) -> None:
    """Raise `_StopRequested` in a thread unless its work is done."""
    with job.completion_lock:
        if thread.ident is not None and not job.done.is_set():
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(thread.ident), ctypes.py_object(_StopRequested)
            )


def duration_text(seconds: float) -> str:
    """A duration for a message: milliseconds below a second."""
    return f"{seconds:g} s" if seconds >= 1.0 else f"{seconds * 1000:g} ms"


@cache
def _statm(process: int) -> int:
    """File descriptor of `/proc/self/statm`: opened once, because it is read in every step."""
    return os.open(f"/proc/{process}/statm", os.O_RDONLY)


def resident_mb() -> float:
    """Resident memory of this process, megabytes; its peak where the present value is not available."""
    try:
        pages = int(os.pread(_statm(os.getpid()), 256, 0).split()[1])
    except OSError:
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / 2**20 if sys.platform == "darwin" else peak / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


LONGEST_ERROR = 400


def error_line(fault: BaseException) -> str:
    """An exception as one short line, even if its `__str__` fails."""
    if isinstance(fault, BehaviourError):
        text = f"{fault.what}; expected {fault.expected}" if fault.expected else fault.what
    else:
        try:
            text = f"{type(fault).__name__}: {fault}"
        except Exception:
            # The text of an exception is code of the plug-in, too.
            text = f"{type(fault).__name__}: (its message cannot be read)"
    return " ".join(text.split())[:LONGEST_ERROR]
