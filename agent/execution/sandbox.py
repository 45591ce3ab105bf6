"""A process for code of the user's own: its output is captured, and it is ended with its children.

On Linux, where the kernel lets users have namespaces (`unshare` of util-linux), it also has a user and a
process namespace of its own: it cannot signal the supervisor, nor look into its memory, and whatever
it started ends with it, as it does when the supervisor is killed. Elsewhere its process group is ended.
What it may still do (read and write the user's files, talk to the network) is said in docs/security.md.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import weakref
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from typing import IO

from visup.agent.model.errors import BehaviourError

CAN_ISOLATE = os.name == "posix"
LARGEST_OUTPUT_BYTES = 16 * 2**20
"""What it may write to its standard output and error together; the process is ended beyond."""
KEPT_OUTPUT_BYTES = 2000
ENDING_S = 5.0
PATIENCE_S = 1.0

NAMESPACES = ("--user", "--map-current-user", "--pid", "--fork", "--kill-child=KILL")
WARDEN = '(read none <&"$1"; kill -9 -1) 2>/dev/null & shift; "$@"; exit "$?"'
"""First process of the namespace: runs the rest, and ends it all once the supervisor is gone."""


class Sandbox:
    """A process that runs `visup.agent.execution.worker`, and what is shared with it.

    Attributes:
        end: The supervisor's end of the connection, a stream socket.
        frames: Descriptor of a file in memory that the process reads images from.
    """

    def __init__(self) -> None:
        if not CAN_ISOLATE:
            raise BehaviourError(
                "behaviours cannot run in processes of their own on this system",
                expected="Linux, macOS or another POSIX system",
            )
        self.end, theirs = socket.socketpair()
        self.frames = _memory_file()
        lifeline, keep = os.pipe()
        passed = (theirs.fileno(), self.frames, lifeline)
        self._process = subprocess.Popen(
            [*_wrapped(lifeline), sys.executable, "-P", "-m", WORKER, *map(str, passed)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=passed,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )
        theirs.close()
        os.close(lifeline)
        self._lifeline = _Lifeline(self._process, os.fdopen(keep, "wb"))
        self.output = _Output(self._process, self._lifeline)
        self.close = weakref.finalize(self, _end, self._lifeline, self.end, self.frames)

    def kill(self) -> None:
        """End it at once, with all that it started; `close` clears it away."""
        self._lifeline.cut()

    def how_it_ended(self) -> str:
        """Words for a process that ended by itself, with the last line that it wrote."""
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "closed its connection"
        number = -code if code < 0 else code - 128  # as a shell tells it
        how = f"by signal {number}" if number > 0 else f"with exit code {code}"
        return f"ended {how}{self.output.last_line()}"


WORKER = "visup.agent.execution.worker"


@dataclass(frozen=True, slots=True)
class _Lifeline:
    """By which a process is ended.

    Attributes:
        process: The process, or in namespaces the one outside that waits for all of theirs to end.
        held: While it is open the process may live.
    """

    process: subprocess.Popen[bytes]
    held: IO[bytes]

    def cut(self) -> None:
        """End the process at once."""
        self.held.close()
        if not isolating():
            self._kill_group()

    def end(self) -> None:
        """End it, and wait until it is gone with all that it started."""
        self.cut()
        for seconds in (PATIENCE_S, ENDING_S):
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(seconds)
                break
            self._kill_group()  # what should have ended it was ended itself
        if not isolating():
            self._kill_group()  # what was left behind

    def _kill_group(self) -> None:
        # Its own session is its process group.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)


class _Output:
    """What a process writes, read all the time so that it never waits; only the end is kept."""

    def __init__(self, process: subprocess.Popen[bytes], lifeline: _Lifeline) -> None:
        self.exceeded = False
        self._kept = b""
        self._thread = threading.Thread(target=self._drain, args=(process, lifeline), daemon=True)
        self._thread.start()

    def last_line(self) -> str:
        """': ' and the last line that was written, or nothing."""
        self._thread.join(0.5)
        lines = self._kept.decode(errors="replace").split("\n")
        written = [line.strip() for line in lines if line.strip()]
        return f": {written[-1][:200]}" if written else ""

    def _drain(self, process: subprocess.Popen[bytes], lifeline: _Lifeline) -> None:
        stream: IO[bytes] = process.stdout  # type: ignore[assignment]  # asked for above
        total = 0
        with suppress(OSError, ValueError):
            while part := os.read(stream.fileno(), 2**16):
                total += len(part)
                self._kept = (self._kept + part)[-KEPT_OUTPUT_BYTES:]
                if total > LARGEST_OUTPUT_BYTES and not self.exceeded:
                    # Read on until it is gone: a pipe that breaks first would be told as its fault.
                    self.exceeded = True
                    lifeline.cut()
        stream.close()


def _wrapped(lifeline: int) -> list[str]:
    return [*namespace_command(), "sh", "-c", WARDEN, "sh", str(lifeline)] if isolating() else []


def namespace_command() -> list[str]:
    """The prefix that runs a command in separate namespaces."""
    return [shutil.which("unshare") or "unshare", *NAMESPACES]


@cache
def isolating() -> bool:
    """Whether processes can have namespaces of their own here."""
    if not sys.platform.startswith("linux") or shutil.which("unshare") is None:
        return False
    try:
        tried = subprocess.run(
            [*namespace_command(), "true"], capture_output=True, timeout=10, check=False
        )
    except (OSError, subprocess.SubprocessError):
        return False
    return tried.returncode == 0


def _memory_file() -> int:
    if hasattr(os, "memfd_create"):
        return os.memfd_create("visup frames")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def _end(lifeline: _Lifeline, end: socket.socket, frames: int) -> None:
    lifeline.end()
    end.close()
    os.close(frames)
