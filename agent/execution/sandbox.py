"""A process for user code: its output is captured, and it is ended with its children.

On Linux, where the kernel allows user namespaces (`unshare` of util-linux), it also has its own user and
process namespaces: it can neither signal the supervisor nor read its memory, and all its children end with
it, or when the supervisor is killed. Elsewhere its process group is ended. What it may still do (access the
user's files and the network) is described in docs/security.md.
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
"""Limit of its standard output and error together; beyond it the process is ended."""
OUTPUT_TAIL_BYTES = 2000
KILL_TIMEOUT_S = 5.0
EXIT_TIMEOUT_S = 1.0

NAMESPACES = ("--user", "--map-current-user", "--pid", "--fork", "--kill-child=KILL")
NAMESPACE_INIT = '(read none <&"$1"; kill -9 -1) 2>/dev/null & shift; "$@"; exit "$?"'
"""First process of the namespace: runs the command, and ends all once the supervisor is gone."""


class Sandbox:
    """A process that runs `visup.agent.execution.worker`, and its shared resources.

    Attributes:
        end: The supervisor's end of the connection, a stream socket.
        frames: Descriptor of the memory file for images.
    """

    def __init__(self) -> None:
        if not CAN_ISOLATE:
            raise BehaviourError(
                "behaviours cannot run in processes of their own on this system",
                expected="Linux, macOS or another POSIX system",
            )
        self.end, child_end = socket.socketpair()
        self.frames = _memory_file()
        lifeline, lifeline_end = os.pipe()
        inherited = (child_end.fileno(), self.frames, lifeline)
        self._process = subprocess.Popen(
            [
                *_namespace_prefix(lifeline),
                sys.executable,
                "-P",
                "-m",
                WORKER,
                *map(str, inherited),
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=inherited,
            start_new_session=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)},
        )
        child_end.close()
        os.close(lifeline)
        self._lifeline = _Lifeline(self._process, os.fdopen(lifeline_end, "wb"))
        self.output = _Output(self._process, self._lifeline)
        self.close = weakref.finalize(self, _end, self._lifeline, self.end, self.frames)

    def kill(self) -> None:
        """Kill it with its children; `close` releases the resources."""
        self._lifeline.cut()

    def exit_text(self) -> str:
        """How a process ended by itself, with the last line of its output."""
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return "closed its connection"
        number = -code if code < 0 else code - 128  # shell convention
        reason = f"by signal {number}" if number > 0 else f"with exit code {code}"
        return f"ended {reason}{self.output.last_line()}"


WORKER = "visup.agent.execution.worker"


@dataclass(frozen=True, slots=True)
class _Lifeline:
    """The means to end a process.

    Attributes:
        process: The process, or with namespaces the outer one that waits for all inner ones.
        pipe_end: A pipe end; closing it ends the process.
    """

    process: subprocess.Popen[bytes]
    pipe_end: IO[bytes]

    def cut(self) -> None:
        """Kill the process."""
        self.pipe_end.close()
        if not can_use_namespaces():
            self._kill_group()

    def end(self) -> None:
        """Kill it, and wait until it and its children have ended."""
        self.cut()
        for seconds in (EXIT_TIMEOUT_S, KILL_TIMEOUT_S):
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(seconds)
                break
            self._kill_group()  # the first process of the namespace was itself killed
        if not can_use_namespaces():
            self._kill_group()  # children left behind

    def _kill_group(self) -> None:
        # Its session is its process group.
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.process.pid, signal.SIGKILL)


class _Output:
    """The output of a process, read continuously so that it never blocks; only the end is stored."""

    def __init__(self, process: subprocess.Popen[bytes], lifeline: _Lifeline) -> None:
        self.exceeded = False
        self._tail = b""
        self._thread = threading.Thread(target=self._drain, args=(process, lifeline), daemon=True)
        self._thread.start()

    def last_line(self) -> str:
        """': ' and the last line of the output, or nothing."""
        self._thread.join(0.5)
        lines = self._tail.decode(errors="replace").split("\n")
        written = [line.strip() for line in lines if line.strip()]
        return f": {written[-1][:200]}" if written else ""

    def _drain(self, process: subprocess.Popen[bytes], lifeline: _Lifeline) -> None:
        stream: IO[bytes] = process.stdout  # type: ignore[assignment]  # requested above
        total = 0
        with suppress(OSError, ValueError):
            while part := os.read(stream.fileno(), 2**16):
                total += len(part)
                self._tail = (self._tail + part)[-OUTPUT_TAIL_BYTES:]
                if total > LARGEST_OUTPUT_BYTES and not self.exceeded:
                    # Read until it has ended: a broken pipe would be reported as its fault.
                    self.exceeded = True
                    lifeline.cut()
        stream.close()


def _namespace_prefix(lifeline: int) -> list[str]:
    if not can_use_namespaces():
        return []
    return [*namespace_command(), "sh", "-c", NAMESPACE_INIT, "sh", str(lifeline)]


def namespace_command() -> list[str]:
    """The prefix that runs a command in separate namespaces."""
    return [shutil.which("unshare") or "unshare", *NAMESPACES]


@cache
def can_use_namespaces() -> bool:
    """Whether processes can have their own namespaces here."""
    if not sys.platform.startswith("linux") or shutil.which("unshare") is None:
        return False
    try:
        result = subprocess.run(
            [*namespace_command(), "true"], capture_output=True, timeout=10, check=False
        )
    except (OSError, subprocess.SubprocessError):
        return False
    return result.returncode == 0


def _memory_file() -> int:
    if hasattr(os, "memfd_create"):
        return os.memfd_create("visup frames")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def _end(lifeline: _Lifeline, end: socket.socket, frames: int) -> None:
    lifeline.end()
    end.close()
    os.close(frames)
