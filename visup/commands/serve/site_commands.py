"""`visup serve SITE.toml`, `check`, `schema`: many cameras under one supervisor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.runs.result import ExitCode

if TYPE_CHECKING:
    from visup.serving.site_check import CameraCheck

SiteFile = Annotated[Path, typer.Argument(metavar="SITE.toml", help="The site file.")]

app = typer.Typer(no_args_is_help=True)


@app.command()
def check(
    site_file: SiteFile,
    speed: Annotated[
        bool, typer.Option(help="Also measure how many frames a second can be looked at.")
    ] = True,
) -> None:
    """Say beforehand whether all cameras of a site can be watched, and by this machine.

    Every source is opened; tasks, rules, zones, models, behaviours and sinks are loaded; the actors of each
    task are looked for among the models; and some frames are looked at. Exit code: 0 when all can be
    watched, 2 when the file is not as it should be or a camera cannot be watched.
    """
    from visup.serving.site_check import check_camera, load_lines, store_fault
    from visup.serving.site_file import read_site
    from visup.terminal.console import complain, echo

    site = read_site(site_file)
    checks = []
    for camera in site.cameras:
        echo(f"camera {camera.name}")
        checks.append(check_camera(camera, speed=speed))
        _tell(checks[-1])
    for line in load_lines(checks):
        echo(line)
    refused = [c.camera.name for c in checks if c.fault]
    if fault := store_fault(site):
        complain(fault)
    if refused:
        complain(f"{len(refused)} of {len(checks)} cameras cannot be watched: {', '.join(refused)}")
    if refused or fault:
        raise typer.Exit(ExitCode.BAD_INPUT)
    echo(f"All {len(checks)} cameras can be watched." if len(checks) > 1 else "It can be watched.")


def _tell(checked: CameraCheck) -> None:
    from visup.serving.site_check import speed_line
    from visup.terminal.console import complain, echo

    for line in checked.lines:
        echo(f"  {line}")
    if checked.speed:
        echo(f"  {speed_line(checked.speed)}")
    if checked.fault:
        complain(f"camera {checked.camera.name}: {checked.fault}")


@app.command()
def schema() -> None:
    """Print the JSON Schema of site files, by which editors complete and check them."""
    from visup.serving.site_form import schema_text
    from visup.terminal.console import echo

    echo(schema_text())
