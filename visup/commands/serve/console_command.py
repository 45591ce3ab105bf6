"""`visup console RUN...`: recorded and running runs in the browser."""

from __future__ import annotations

import os
import signal
import webbrowser
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, Annotated

import typer

from visup.agent.model.errors import ExtraMissingError, SettingsError
from visup.terminal.console import make_console

if TYPE_CHECKING:
    from visup.console.access import Access

OPERATOR_VARIABLE = "VISUP_CONSOLE_TOKEN"
VIEWER_VARIABLE = "VISUP_CONSOLE_VIEWER_TOKEN"
PARENT_VARIABLE = "VISUP_CONSOLE_WITH_PARENT"
"""Set by a process that starts the console, which then ends with that process and runs at low priority."""

MIN_TOKEN_LENGTH = 16

SaveTo = Annotated[
    Path | None,
    typer.Option(help="Folder in which operators may save tasks, rules and zones."),
]


def console(
    paths: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Run folders, or folders of them.")
    ],
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0 for any free one.")] = 8086,
    name: Annotated[
        list[str] | None,
        typer.Option(help="Another host name under which the console is reached; repeatable."),
    ] = None,
    save_to: SaveTo = None,
    open_browser: Annotated[
        bool, typer.Option("--open", help="Open the console in the browser.")
    ] = False,
) -> None:
    """Browse runs in the browser: video, timeline, beliefs, and the reason for every statement.

    Live runs are followed. The printed address contains a token that grants access to whoever has it;
    VISUP_CONSOLE_TOKEN sets your own, VISUP_CONSOLE_VIEWER_TOKEN one for read-only access.
    Exit code: 0 when stopped, 2 for bad input.
    """
    try:
        from visup.console.access import LOOPBACK
        from visup.console.library import RunLibrary
        from visup.console.server import serve_console
        from visup.console.state import ConsoleState
    except ModuleNotFoundError as error:
        raise ExtraMissingError("the console", "console") from error
    _check_host(host)
    if save_to is not None and not save_to.is_dir():
        raise SettingsError("the folder to save to does not exist", where=str(save_to))
    state = ConsoleState(RunLibrary(paths), save_to)
    access = _access((*LOOPBACK, host, *(name or ())))
    out = make_console(soft_wrap=True)
    if os.environ.get(PARENT_VARIABLE):
        _end_with_parent()

    def ready(address: str) -> None:
        out.print(f"Console: {address}", markup=False, highlight=False)
        out.print("Press Ctrl-C to stop.", style="dim")
        if open_browser:
            webbrowser.open(address)

    serve_console(state, access, host, port, ready)


def _end_with_parent() -> None:
    """End when standard input closes, and run at low priority."""

    def wait() -> None:
        while os.read(0, 4096):
            continue
        os.kill(os.getpid(), signal.SIGTERM)

    Thread(target=wait, name="parent", daemon=True).start()
    if hasattr(os, "nice"):
        os.nice(5)


def _check_host(host: str) -> None:
    """Refuse a host that others can reach unless the user has set a token."""
    from visup.console.access import LOOPBACK

    if host not in LOOPBACK and OPERATOR_VARIABLE not in os.environ:
        raise SettingsError(
            f"others can reach the console at {host}",
            expected=f"a token of your own in {OPERATOR_VARIABLE}",
            hint="put it behind a TLS proxy as well, as docs/console.md describes",
        )


def _access(hosts: tuple[str, ...]) -> Access:
    """Access rights, from the tokens in the environment."""
    from visup.console.access import Access

    operator, viewer = (_token(name) for name in (OPERATOR_VARIABLE, VIEWER_VARIABLE))
    hosts = tuple(dict.fromkeys(hosts))
    if operator is None:
        return Access(viewer=viewer, hosts=hosts)
    return Access(operator, viewer, hosts)


def _token(name: str) -> str | None:
    token = os.environ.get(name)
    if token is not None and (len(token) < MIN_TOKEN_LENGTH or not token.isascii()):
        raise SettingsError(
            f"the token in {name} is too short, or not plain ASCII",
            expected=f"at least {MIN_TOKEN_LENGTH} letters and digits",
        )
    return token
