"""Reads damaged files in a process of its own, within limits, and tells what came of each."""

from __future__ import annotations

import faulthandler
import os
import random
import resource
import select
import shutil
import signal
import sys
import time
import traceback
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from tests.oracles.hardening.subjects import REFUSED, Subject

SLOW_S = 10.0
MEMORY = 2**30
"""Seconds and bytes that reading one file may take."""
LOST_S = 40.0
"""After so long without a word, seconds, the process hangs in a library."""


@dataclass
class Findings:
    """What came of the files of one kind.

    Attributes:
        outcomes: How many were 'read', 'refused', 'raised', 'slow', 'crashed', 'ran' (code), or took too much
            'memory'.
        failures: What went wrong, with the number of the file.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    failures: list[str] = field(default_factory=list)

    def add(self, number: int, outcome: str, detail: str) -> None:
        """Count one file."""
        self.outcomes[outcome] += 1
        if outcome not in ("read", "refused"):
            self.failures.append(f"{number}: {outcome} {detail}")


def fuzz(subject: Subject, count: int, seed: int, place: Path) -> Findings:
    """Read so many damaged files; the same seed gives the same files."""
    findings, begin = Findings(), 0
    while begin < count:
        begin = _batch(subject, range(begin, count), seed, place, findings)
    return findings


def _batch(subject: Subject, numbers: range, seed: int, place: Path, findings: Findings) -> int:
    """Read files until a process ends; the number to go on with."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        try:
            _work(subject, numbers, seed, place, os.fdopen(writing, "w"))
        finally:
            os._exit(0)
    os.close(writing)
    at = numbers.start
    with os.fdopen(reading) as lines:
        while select.select([lines], [], [], LOST_S)[0]:
            line = lines.readline()
            if not line:
                break
            number, outcome, detail = line.rstrip("\n").split("\t", 2)
            findings.add(int(number), outcome, detail)
            at = int(number) + 1
        else:
            os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if at in numbers:
        code = os.waitstatus_to_exitcode(status)
        killed = code == -signal.SIGKILL
        findings.add(at, "slow" if killed else "crashed", "" if killed else _ending(code))
        at += 1
    return at


def _ending(code: int) -> str:
    """How a process ended that told nothing more."""
    return f"by {signal.Signals(-code).name}" if code < 0 else f"with the exit code {code}"


class _TooSlow(BaseException):
    pass


def _work(subject: Subject, numbers: range, seed: int, place: Path, told: IO[str]) -> None:
    faulthandler.disable()  # a crash is found by its signal
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(null, stream)

    def too_slow(number: int, frame: object) -> None:
        raise _TooSlow

    signal.signal(signal.SIGALRM, too_slow)
    ran: list[str] = []
    watching = False

    def audit(event: str, arguments: tuple[object, ...]) -> None:
        if watching and event in CODE:
            ran.append(event)

    sys.addaudithook(audit)
    folder = place / "damaged"
    for number in numbers:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        ran.clear()
        try:
            subject.make(folder, random.Random(f"{seed} {number}"))
            watching = number > numbers.start  # the first one loads libraries
            outcome, detail = _read(subject, folder)
        except _TooSlow:  # it came just when all was done
            outcome, detail = "slow", ""
        except Exception as fault:
            outcome, detail = "raised", f"{_said(fault)}, when it was made"
        watching = False
        outcome = "ran" if ran else outcome
        told.write(f"{number}\t{outcome}\t{' '.join([*ran[:3], detail])}\n")
        told.flush()


CODE = frozenset(
    {"os.system", "os.exec", "os.posix_spawn", "os.spawn", "subprocess.Popen",
     "ctypes.dlopen", "socket.connect"}
)  # fmt: skip
"""What no file may bring about."""


def _read(subject: Subject, folder: Path) -> tuple[str, str]:
    held, begin = _address_space(), time.monotonic()
    resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, resource.RLIM_INFINITY))
    signal.setitimer(signal.ITIMER_REAL, SLOW_S)
    try:
        subject.read(folder)
    except REFUSED:
        return "refused", ""
    except _TooSlow:
        return "slow", ""
    except MemoryError:
        return "memory", ""
    except BaseException as fault:
        return "raised", _said(fault)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        resource.setrlimit(resource.RLIMIT_AS, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return ("slow", "") if time.monotonic() - begin > SLOW_S else ("read", "")


def _said(fault: BaseException) -> str:
    where = traceback.extract_tb(fault.__traceback__)[-1]
    said = f"{type(fault).__name__}: {fault} at {Path(where.filename).name}:{where.lineno}"
    return " ".join(said.split())[:300]


def _address_space() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


__all__ = ["Findings", "fuzz"]
