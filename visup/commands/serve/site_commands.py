"""`visup serve SITE.toml`, `check`, `schema`: many cameras under one supervisor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from visup.runs.result import ExitCode

if TYPE_CHECKING:
    from visup.serving.site.checking import CameraCheck
    from visup.serving.site_log import SiteLog

SiteFile = Annotated[Path, typer.Argument(metavar="SITE.toml", help="The site file.")]

RUN = "run"


class SiteGroup(TyperGroup):
    """Commands about sites; any other first word is a site file to watch."""

    default_command = RUN

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Insert `run` before the name of a site file."""
        first_word = next((word for word in args if not word.startswith("-")), None)
        if first_word is not None and first_word not in self.commands:
            args = [RUN, *args]
        return super().parse_args(ctx, args)


app = typer.Typer(no_args_is_help=True, cls=SiteGroup, help="Watch many cameras as a service.")


@app.command(RUN)
def run(
    site_file: SiteFile,
    as_json: Annotated[
        bool, typer.Option("--json", help="Log as JSON, one object per line.")
    ] = False,
) -> None:
    """Watch all cameras of a site until stopped.

    Each camera has its own process, which is restarted if it dies, hangs or uses too much memory, and
    continues from its last checkpoint. SIGTERM or Ctrl-C closes all runs within 5 s; SIGHUP reloads the
    file and restarts only the cameras that changed. Exit code: 0 if it was stopped or every source ended,
    2 if the file is invalid or another service uses its store, 5 if a process did not close in time.
    """
    from visup.runs.inputs.stop_signals import stop_signals
    from visup.serving.service import serve
    from visup.serving.site.reading import read_site

    site = read_site(site_file)
    with stop_signals(at_once=False, reload=True) as stop:
        code = serve(site, _log(as_json=as_json), stop)
    raise typer.Exit(code)


def _log(*, as_json: bool) -> SiteLog:
    """The log of the service: timestamped messages (UTC) on standard error."""
    from visup.serving.site_log import SiteLog
    from visup.terminal.console import make_console

    console = make_console(stderr=True, soft_wrap=True, markup=False)
    return SiteLog(console.print, as_json=as_json)


@app.command()
def check(
    site_file: SiteFile,
    speed: Annotated[
        bool, typer.Option(help="Also measure how many frames per second can be processed.")
    ] = True,
) -> None:
    """Check that all cameras of a site can be watched, and that this machine is fast enough.

    Opens every source, loads tasks, rules, zones, models, behaviours and sinks, looks for a model for each
    actor of the tasks, and processes a few frames. Exit code: 0 if all cameras can be watched, 2 if the
    file is invalid or a camera cannot be watched.
    """
    from visup.serving.site.checking import check_camera, load_lines, store_fault
    from visup.serving.site.reading import read_site
    from visup.terminal.console import echo, print_error

    site = read_site(site_file)
    checks = []
    for camera in site.cameras:
        echo(f"camera {camera.name}")
        checks.append(check_camera(camera, speed=speed))
        _print_check(checks[-1])
    for line in load_lines(checks):
        echo(line)
    refused = [c.camera.name for c in checks if c.fault]
    if store_error := store_fault(site):
        print_error(store_error)
    if refused:
        print_error(
            f"{len(refused)} of {len(checks)} cameras cannot be watched: {', '.join(refused)}"
        )
    if refused or store_error:
        raise typer.Exit(ExitCode.BAD_INPUT)
    echo(f"All {len(checks)} cameras can be watched." if len(checks) > 1 else "It can be watched.")


def _print_check(checked: CameraCheck) -> None:
    from visup.serving.site.checking import speed_line
    from visup.terminal.console import echo, print_error

    for line in checked.lines:
        echo(f"  {line}")
    if checked.speed:
        echo(f"  {speed_line(checked.speed)}")
    if checked.fault:
        print_error(f"camera {checked.camera.name}: {checked.fault}")


@app.command()
def schema() -> None:
    """Print the JSON Schema of site files, with which editors complete and check them."""
    from visup.serving.site.form import schema_text
    from visup.terminal.console import echo

    echo(schema_text())
