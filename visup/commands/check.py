"""`visup check`: whether a run could begin, and come to anything, before its first frame."""

from __future__ import annotations

from typing import Annotated

import typer

from visup.commands.options import Given, SettingsFile, takes
from visup.commands.watch import watch_settings
from visup.runs.settings import WatchSettings


@takes(WatchSettings)
def check(
    setting: Given,
    source: Annotated[
        str, typer.Argument(help="Video file, folder of images, camera index or URL.")
    ],
    settings_file: SettingsFile = None,
) -> None:
    """Say beforehand whether `visup watch` with the same options can begin, and lead to anything.

    The source is opened and its first frame read; tasks, rules, zones, models and behaviours are loaded;
    and the actors of each task are looked for among the models. Exit code: 0 when a run can begin, 2 when it
    cannot.
    """
    from visup.runs.inputs.preflight import preflight
    from visup.terminal.console import echo

    for line in preflight(watch_settings(source, setting, settings_file)):
        echo(line)
    echo("A run can begin.")
