"""`visup step`: step the agent in the terminal and look into its mind."""

from __future__ import annotations

import typer

from visup.commands.watch import (
    Actors,
    Behaviours,
    Every,
    Fov,
    Fps,
    Isolate,
    Models,
    Plugins,
    Rules,
    Set,
    SettingsFile,
    Source,
    Tasks,
    Zones,
    settings_of,
)


def step(
    source: Source,
    task: Tasks = None,
    models: Models = None,
    rules: Rules = None,
    actor: Actors = None,
    every: Every = 1,
    behaviour: Behaviours = None,
    plugin: Plugins = None,
    fps: Fps = None,
    fov: Fov = None,
    zones: Zones = None,
    setting: Set = None,
    settings_file: SettingsFile = None,
    isolate: Isolate = None,
) -> None:
    """Step through a video and look into the agent's mind."""
    from visup.session import Session, read_commands
    from visup.supervisor import build_agent, open_video

    settings = settings_of(
        source,
        task,
        models,
        rules,
        actor,
        every,
        behaviour,
        plugin,
        fps,
        fov,
        zones,
        setting,
        settings_file,
        isolate,
    )
    with open_video(settings) as video:
        session = Session(build_agent(settings), video)
        code = session.run(read_commands(session.words()))
    raise typer.Exit(code)
