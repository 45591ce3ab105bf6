"""The supervisor's handle on a camera process: start it, read its reports, measure it, end it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

from visup.serving.reports import MAX_LINE_BYTES, CameraJob, CameraReport, job_line, parse_report

Command = Callable[[int], Sequence[str]]
"""The command line, given the file descriptor of the report pipe; tests substitute their own."""

READ_BYTES = 2**16


def camera_command(pipe: int) -> Sequence[str]:
    """The command line of a camera process."""
    return sys.executable, "-m", "visup.serving.camera_process", str(pipe)


class CameraChild:
    """A child process that runs one job.

    It has a session of its own, so that Ctrl-C in the supervisor's terminal reaches the supervisor only.

    Args:
        job: The job; None for a spare process, which receives its job later.
        command: Makes the command line.

    Raises:
        OSError: The process cannot be started.
    """

    def __init__(self, job: CameraJob | None, command: Command = camera_command) -> None:
        self._reports, child_end = os.pipe()
        os.set_blocking(self._reports, False)
        try:
            self._process = subprocess.Popen(
                command(child_end),
                stdin=subprocess.PIPE,
                pass_fds=(child_end,),
                start_new_session=True,
            )
        except OSError:
            os.close(self._reports)
            raise
        finally:
            os.close(child_end)
        self.pid = self._process.pid
        self._partial_line = b""
        if job:
            self.send_job(job)

    def send_job(self, job: CameraJob) -> None:
        """Send the process its job."""
        self._send(job_line(job))

    def reports(self) -> list[CameraReport]:
        """Reports received since the last call."""
        data = self._partial_line
        with suppress(BlockingIOError):
            while piece := os.read(self._reports, READ_BYTES):
                data += piece
        *lines, self._partial_line = data.split(b"\n")
        self._partial_line = self._partial_line[-MAX_LINE_BYTES:]
        return [report for line in lines if (report := parse_report(line))]

    def exit_code(self) -> int | None:
        """The exit code, negative for a signal; None while the process runs.

        Its descendants are killed with it, before it is reaped: until then its group number cannot be reused.
        """
        if self._process.returncode is None:
            if os.waitid(os.P_PID, self.pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is None:
                return None
            self.kill()
        return self._process.poll()

    def memory_mb(self) -> float | None:
        """Resident memory, megabytes; None where the system does not provide it."""
        try:
            pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        except (OSError, ValueError, IndexError):
            return None
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    def cpu_s(self) -> float | None:
        """Processor time used, seconds; None where the system does not provide it."""
        try:
            fields = Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()
            return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
        except (OSError, ValueError):
            return None

    def terminate(self) -> None:
        """Ask the process to finish its step and close its recording (SIGTERM)."""
        self._signal(signal.SIGTERM)

    def kill(self) -> None:
        """Kill the process and its descendants; `exit_code` says when they have ended."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)

    def end(self, wait_s: float = 5.0) -> None:
        """Kill the process, wait for its end and release its resources."""
        self.kill()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(wait_s)
        self.close()

    def close_stdin(self) -> None:
        """Stop supervising it: it closes its recording, as when its supervisor dies."""
        if self._process.stdin:
            with suppress(OSError):
                self._process.stdin.close()

    def close(self) -> None:
        """Release its resources, once it has ended."""
        self.close_stdin()
        os.close(self._reports)

    def _send(self, line: bytes) -> None:
        assert self._process.stdin
        with suppress(BrokenPipeError):  # the exit code shows that it has ended
            self._process.stdin.write(line)
            self._process.stdin.flush()

    def _signal(self, number: signal.Signals) -> None:
        with suppress(ProcessLookupError):
            self._process.send_signal(number)
