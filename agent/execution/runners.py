"""Running a behaviour on a frame: in the caller's thread, or in a thread that can be given up.

`process_runner.py` has the third way, a process of its own. All three keep one protocol, `Runner`.
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

STOPPING_S = 0.05
"""How long a step waits for a thread that it has just asked to stop, seconds."""


class RunTimeoutError(BehaviourError):
    """No answer came in time."""


class ProcessDiedError(BehaviourError):
    """The behaviour's process ended."""


class MemoryLimitError(BehaviourError):
    """It took more memory than it may."""


class Runner(Protocol):
    """Runs one behaviour; what it raises is the behaviour's failure."""

    def maintain(self) -> bool:
        """Look after it between runs: stop what was given up, replace what ended.

        Returns:
            Whether a run that was given up is still under way.
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
            Exception: Whatever the behaviour raised, `BehaviourError` for nonsense, `RunTimeoutError`,
                `ProcessDiedError` or `MemoryLimitError`.
        """
        ...

    def close(self) -> None:
        """Let go of what was started."""
        ...


def run_behaviour(
    behaviour: Behaviour,
    contract: Contract,
    frame: Frame,
    observation: Observation,
    directives: Sequence[Directive],
) -> tuple[Percept, ...]:
    """What a behaviour reports of a frame, known to make sense."""
    percepts = collect_percepts(contract, behaviour.perceive(frame, observation, directives))
    check_percepts(contract, percepts, frame, observation)
    return percepts


def start_behaviour(behaviour: Behaviour) -> tuple[Percept, ...]:
    """Call its method `start`, if it has one; nothing is perceived by that."""
    begin = getattr(behaviour, "start", None)
    if callable(begin):
        begin()
    return ()


class DirectRunner:
    """Runs a behaviour in the thread of the caller: nothing can stop it."""

    def __init__(self, behaviour: Behaviour, contract: Contract) -> None:
        self._behaviour = behaviour
        self._contract = contract
        self._started = False

    def maintain(self) -> bool:
        """Nothing is ever given up."""
        return False

    def run(
        self,
        frame: Frame,
        observation: Observation,
        directives: Sequence[Directive],
        seconds: float | None,
    ) -> tuple[Percept, ...]:
        """See `Runner`; `seconds` is not kept."""
        try:
            if not self._started:
                start_behaviour(self._behaviour)
                self._started = True
            return run_behaviour(self._behaviour, self._contract, frame, observation, directives)
        except (SystemExit, GeneratorExit) as leaving:
            raise _as_error(leaving) from leaving

    def close(self) -> None:
        """Nothing was started."""


@dataclass(slots=True)
class _Job:
    """One run that was handed to a thread."""

    work: Callable[[], tuple[Percept, ...]]
    done: threading.Event = field(default_factory=threading.Event)
    ending: threading.Lock = field(default_factory=threading.Lock)
    tried: bool = False
    given_up: bool = False
    percepts: tuple[Percept, ...] = ()
    fault: BaseException | None = None

    def run(self) -> None:
        """Do the work, once, and note what came of it."""
        if not self.tried:
            self.tried = True
            try:
                self.percepts = self.work()
            except BaseException as fault:
                # Whatever it is, it is the behaviour's failure and belongs to whoever waits.
                self.fault = fault if isinstance(fault, Exception) else _as_error(fault)
        with self.ending:
            self.done.set()


class ThreadRunner:
    """Runs a behaviour in its own thread, which is abandoned if it takes too long.

    The next run gets a new thread, once the one given up has ended.

    Args:
        behaviour: What is run.
        contract: Its contract.
        start_s: How long its method `start` may take, seconds.
    """

    def __init__(self, behaviour: Behaviour, contract: Contract, start_s: float) -> None:
        self._behaviour = behaviour
        self._contract = contract
        self._start_s = start_s
        self._started = False
        self._jobs: SimpleQueue[_Job | None] | None = None
        self._thread: threading.Thread | None = None
        self._given_up: tuple[threading.Thread, _Job] | None = None

    def maintain(self) -> bool:
        """Ask what was given up to stop once more; whether it is still under way."""
        if self._given_up is None:
            return False
        thread, job = self._given_up
        if thread.is_alive():
            _ask_to_stop(thread, job)
            return True
        self._given_up = None
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
            self._give_up(job)
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

    def _give_up(self, job: _Job) -> None:
        job.given_up = True
        self.close()
        if self._thread is not None:
            self._given_up = self._thread, job
            _ask_to_stop(self._thread, job)
            # Python code stops at once; whatever does not is looked at again in later steps.
            self._thread.join(STOPPING_S)


def _serve(jobs: SimpleQueue[_Job | None]) -> None:
    while (job := jobs.get()) is not None:
        while not job.done.is_set():
            # Being asked to stop may come at any moment; the work itself is never done twice.
            with suppress(_StopAsked):
                job.run()
        if job.given_up:
            return
        del job  # a frame must not live on while the thread is idle


def _as_error(fault: BaseException) -> BehaviourError:
    """A plug-in may end itself, never the supervisor."""
    return BehaviourError(f"it called for an exit ({type(fault).__name__})")


class _StopAsked(SystemExit):
    """Raised in a thread that was given up: behaviours that catch `Exception` let it pass."""


def _ask_to_stop(thread: threading.Thread, job: _Job) -> None:
    """Raise in a thread, unless its work is done: then there is nothing left to stop."""
    with job.ending:
        if thread.ident is not None and not job.done.is_set():
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(thread.ident), ctypes.py_object(_StopAsked)
            )


def duration_text(seconds: float) -> str:
    """A time for a message: milliseconds below a second."""
    return f"{seconds:g} s" if seconds >= 1.0 else f"{seconds * 1000:g} ms"


@cache
def _statm(process: int) -> int:
    """Where a process is told its own memory: opened once, for it is read in every step."""
    return os.open(f"/proc/{process}/statm", os.O_RDONLY)


def resident_mb() -> float:
    """Memory that this process holds now, megabytes; where that is not told, the most it ever held."""
    try:
        pages = int(os.pread(_statm(os.getpid()), 256, 0).split()[1])
    except OSError:
        import resource

        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / 2**20 if sys.platform == "darwin" else peak / 1024
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


LONGEST_ERROR = 400


def error_line(fault: BaseException) -> str:
    """An exception in one short line, whatever its own text does."""
    if isinstance(fault, BehaviourError):
        said = f"{fault.what}; expected {fault.expected}" if fault.expected else fault.what
    else:
        try:
            said = f"{type(fault).__name__}: {fault}"
        except Exception:
            # Even an exception's text is the plug-in's code.
            said = f"{type(fault).__name__}: (its message cannot be read)"
    return " ".join(said.split())[:LONGEST_ERROR]
