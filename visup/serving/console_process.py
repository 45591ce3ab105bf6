"""The console beside the cameras: a process of its own, begun again when it ends; no camera waits for it."""

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
from visup.serving.site_log import SITE, SiteEvent, Tell

if TYPE_CHECKING:
    from visup.serving.site_supervisor import SiteSupervisor

CLOSING_S = 2.0
"""How long it may take to end once it is asked to, seconds."""

Begin = Callable[[Sequence[str], Mapping[str, str]], "subprocess.Popen[bytes]"]


def console_command(console: SiteConsole, store: Path) -> Sequence[str]:
    """What is run; tokens are no part of it, for everybody sees the commands of a machine."""
    host, port = console.listen
    names = (part for name in console.names for part in ("--name", name))
    saved = () if console.save_to is None else ("--save-to", str(console.save_to))
    return (
        *(sys.executable, "-m", "visup.cli", "console", str(store)),
        *("--host", host, "--port", str(port), *names, *saved),
    )


def console_environment(console: SiteConsole) -> Mapping[str, str]:
    """Tokens, as the command takes them; and that it shall end with its parent."""
    given = {
        "VISUP_CONSOLE_WITH_PARENT": "1",
        "VISUP_CONSOLE_TOKEN": console.token,
        "VISUP_CONSOLE_VIEWER_TOKEN": console.viewer_token,
    }
    return {name: token for name, token in given.items() if token is not None}


def begun(command: Sequence[str], tokens: Mapping[str, str]) -> subprocess.Popen[bytes]:
    """Begin the process; it ends when its standard input does, however the service ends.

    What it prints for people who start it by hand has the token in it, and goes nowhere.
    """
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        env={**os.environ, **tokens},
        start_new_session=True,
    )


class ConsoleProcess:
    """Keeps the console of a site going, as the site file says now.

    Args:
        store: Folder of all runs.
        tell: Told what happens.
        begin: Begins a process.
    """

    def __init__(self, store: Path, tell: Tell, begin: Begin = begun) -> None:
        self._store, self._tell, self._begin = store, tell, begin
        self._process: subprocess.Popen[bytes] | None = None
        self._wanted: SiteConsole | None = None
        self._backoff, self._begun_at, self._due = Backoff(), 0.0, 0.0

    def turn(self, supervisor: SiteSupervisor, now: float) -> None:
        """Begin it, begin it again, or end it; waits for nothing but its end."""
        if self._wanted != supervisor.console:
            self.close()
            self._wanted, self._backoff, self._due = supervisor.console, Backoff(), now
        if self._process is not None and (code := self._process.poll()) is not None:
            self._ended(code, now)
        if self._wanted is not None and self._process is None and now >= self._due:
            self._start(self._wanted, now)

    def close(self) -> None:
        """End it."""
        process, self._process = self._process, None
        if process is None:
            return
        process.terminate()
        try:
            process.wait(CLOSING_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        _free(process)

    def _start(self, console: SiteConsole, now: float) -> None:
        host, port = console.listen
        address = f"http://{f'[{host}]' if ':' in host else host}:{port}/"
        try:
            self._process = self._begin(
                console_command(console, self._store), console_environment(console)
            )
        except OSError as fault:
            self._again(f"the console cannot be started ({fault.strerror or fault})", 0.0, now)
            return
        self._begun_at = now
        self._tell(SITE, f"the console is at {address}", SiteEvent.CONSOLE, address=address)

    def _ended(self, code: int, now: float) -> None:
        process, self._process = self._process, None
        if process is not None:
            _free(process)
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        self._again(f"the console ended ({how})", now - self._begun_at, now)

    def _again(self, what: str, ran_s: float, now: float) -> None:
        self._backoff = self._backoff.after(ran_s)
        wait = self._backoff.wait_s
        self._due = now + wait
        told = f"{what}; restarting in {wait:g} s"
        self._tell(SITE, told, SiteEvent.CONSOLE_ENDED, wait_s=wait)


def _free(process: subprocess.Popen[bytes]) -> None:
    if process.stdin:
        with suppress(OSError):
            process.stdin.close()
