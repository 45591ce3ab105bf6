"""`visup check`: whether a run could start and reach a verdict, checked without running it."""

from __future__ import annotations

from typing import Annotated

import typer

from visup.commands.options import OptionValues, SettingsFile, takes
from visup.commands.watch import watch_settings
from visup.runs.settings import WatchSettings


@takes(WatchSettings)
def check(
    options: OptionValues,
    source: Annotated[
        str, typer.Argument(help="Video file, folder of images, camera index or URL.")
    ],
    settings_file: SettingsFile = None,
) -> None:
    """Check whether `visup watch` with the same options could start and reach a verdict.

    Opens the source and reads its first frame, loads tasks, rules, zones, models and behaviours, and looks
    for a model for each actor of the tasks. Exit code: 0 if a run can start, 2 if it cannot.
    """
    from visup.runs.inputs.preflight import preflight
    from visup.terminal.console import echo

    for line in preflight(watch_settings(source, options, settings_file)):
        echo(line)
    echo("A run can start.")
