"""The supervisor's side of a camera's process: begun, listened to, measured, ended."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from visup.serving.reports import LONGEST_LINE, CameraJob, CameraReport, job_line, parse_report

Command = Callable[[int], Sequence[str]]
"""What is run, given the number of the pipe for reports; tests run something else."""

MOST_READ = 2**16


def camera_command(pipe: int) -> Sequence[str]:
    """The process of a camera."""
    return sys.executable, "-m", "visup.serving.camera_process", str(pipe)


class CameraChild:
    """A process that does one job.

    It is of a session of its own: Ctrl-C in the supervisor's terminal is the supervisor's alone to hear.

    Args:
        job: What it is to do; None of one that stands ready, and is given its job later.
        command: What is run.

    Raises:
        OSError: No process can be begun.
    """

    def __init__(self, job: CameraJob | None, command: Command = camera_command) -> None:
        self._reports, theirs = os.pipe()
        os.set_blocking(self._reports, False)
        try:
            self._process = subprocess.Popen(
                command(theirs), stdin=subprocess.PIPE, pass_fds=(theirs,), start_new_session=True
            )
        except OSError:
            os.close(self._reports)
            raise
        finally:
            os.close(theirs)
        self.pid = self._process.pid
        self._rest = b""
        if job:
            self.give(job)

    def give(self, job: CameraJob) -> None:
        """Give it its job."""
        self._send(job_line(job))

    def reports(self) -> list[CameraReport]:
        """What it has told since it was last asked."""
        data = self._rest
        with suppress(BlockingIOError):
            while piece := os.read(self._reports, MOST_READ):
                data += piece
        *lines, self._rest = data.split(b"\n")
        self._rest = self._rest[-LONGEST_LINE:]
        return [report for line in lines if (report := parse_report(line))]

    def exit_code(self) -> int | None:
        """With what it ended, below 0 for a signal; None while it goes on.

        What it began ends with it: as long as it is not collected its group is nobody else's.
        """
        if self._process.returncode is None:
            if os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
                return None
            self.kill()
        return self._process.poll()

    def memory_mb(self) -> float | None:
        """Memory that it has in use, megabytes; None where the system does not say."""
        try:
            pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        except (OSError, ValueError, IndexError):
            return None
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    def cpu_s(self) -> float | None:
        """Processor time that it has used, seconds; None where the system does not say."""
        try:
            told = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
            return sum(map(int, told[11:15])) / os.sysconf("SC_CLK_TCK")
        except (OSError, ValueError):
            return None

    def ask_to_end(self) -> None:
        """Let it finish its step and close its books."""
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        """End it at once, with all that it began; `exit_code` tells when it has."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)

    def end(self, wait_s: float = 5.0) -> None:
        """End it at once, wait until it has, and free what is held of it."""
        self.kill()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(wait_s)
        self.close()

    def let_go(self) -> None:
        """Supervise it no more: it closes its books, as when its supervisor has died."""
        if self._process.stdin:
            with suppress(OSError):
                self._process.stdin.close()

    def close(self) -> None:
        """Free what is held of it, once it has ended."""
        self.let_go()
        os.close(self._reports)

    def _send(self, line: bytes) -> None:
        assert self._process.stdin
        with suppress(BrokenPipeError):  # its end is told by its exit code
            self._process.stdin.write(line)
            self._process.stdin.flush()

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError):
            self._process.send_signal(number)
