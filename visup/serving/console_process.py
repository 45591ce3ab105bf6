"""The console of a site in a process of its own, restarted when it ends; no camera waits for it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from visup.serving.backoff import Backoff
from visup.serving.site.records import SiteConsole
from visup.serving.site_log import SITE, LogEvent, SiteEvent

if TYPE_CHECKING:
    from visup.serving.site_supervisor import SiteSupervisor

CLOSING_S = 2.0
"""How long the process may take to end when asked to, seconds."""

StartProcess = Callable[[Sequence[str], Mapping[str, str]], "subprocess.Popen[bytes]"]


def console_command(console: SiteConsole, store: Path) -> Sequence[str]:
    """The command line; it holds no tokens, because every user of the machine can list commands."""
    host, port = console.listen
    names = (part for name in console.names for part in ("--name", name))
    saved = () if console.save_to is None else ("--save-to", str(console.save_to))
    return (
        *(sys.executable, "-m", "visup.cli", "console", str(store)),
        *("--host", host, "--port", str(port), *names, *saved),
    )


def console_environment(console: SiteConsole) -> Mapping[str, str]:
    """The tokens as environment variables, and the request to end with the parent."""
    variables = {
        "VISUP_CONSOLE_WITH_PARENT": "1",
        "VISUP_CONSOLE_TOKEN": console.token,
        "VISUP_CONSOLE_VIEWER_TOKEN": console.viewer_token,
    }
    return {name: token for name, token in variables.items() if token is not None}


def start_process(command: Sequence[str], tokens: Mapping[str, str]) -> subprocess.Popen[bytes]:
    """Start the process; it ends when its standard input closes, however the service ends.

    Its standard output is discarded: the address printed for people who start it by hand contains the token.
    """
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        env={**os.environ, **tokens},
        start_new_session=True,
    )


class ConsoleProcess:
    """Runs the console of a site as its site file says.

    Args:
        store: Folder of all runs.
        tell: Receives the events.
        begin: Starts the process.
    """

    def __init__(
        self, store: Path, log_event: LogEvent, start: StartProcess = start_process
    ) -> None:
        self._store, self._log_event, self._start_process = store, log_event, start
        self._process: subprocess.Popen[bytes] | None = None
        self._console: SiteConsole | None = None
        self._backoff, self._started_at, self._start_at = Backoff(), 0.0, 0.0

    def tick(self, supervisor: SiteSupervisor, now: float) -> None:
        """Start, restart or end the console as needed; waits for nothing but its end."""
        if self._console != supervisor.console:
            self.close()
            self._console, self._backoff, self._start_at = supervisor.console, Backoff(), now
        if self._process is not None and (code := self._process.poll()) is not None:
            self._ended(code, now)
        if self._console is not None and self._process is None and now >= self._start_at:
            self._start(self._console, now)

    def close(self) -> None:
        """End the console."""
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.wait(CLOSING_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        _close_stdin(process)

    def _start(self, console: SiteConsole, now: float) -> None:
        host, port = console.listen
        address = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
        try:
            self._process = self._start_process(
                console_command(console, self._store), console_environment(console)
            )
        except OSError as fault:
            self._schedule_restart(
                f"the console cannot be started ({fault.strerror or fault})", 0.0, now
            )
            return
        self._started_at = now
        self._log_event(SITE, f"the console is at {address}", SiteEvent.CONSOLE, address=address)

    def _ended(self, code: int, now: float) -> None:
        process, self._process = self._process, None
        if process is not None:
            _close_stdin(process)
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        self._schedule_restart(f"the console ended ({how})", now - self._started_at, now)

    def _schedule_restart(self, what: str, ran_s: float, now: float) -> None:
        self._backoff = self._backoff.after(ran_s)
        wait = self._backoff.wait_s
        self._start_at = now + wait
        text = f"{what}; restarting in {wait:g} s"
        self._log_event(SITE, text, SiteEvent.CONSOLE_ENDED, wait_s=wait)


def _close_stdin(process: subprocess.Popen[bytes]) -> None:
    if process.stdin:
        with suppress(OSError):
            process.stdin.close()
