"""`visup step`: step the agent in the terminal and look into its mind, live or on a recorded run."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.commands.options import REPLAYED, Given, SettingsFile, flags_of, takes
from visup.commands.watch import watch_settings
from visup.runs.settings import WatchSettings

if TYPE_CHECKING:
    from visup.agent.cycle.agent import Agent
    from visup.stepping import ObservationSource

OPTIONS = (
    *("tasks", "models", "rules", "actors", "every", "behaviours", "plugins", "fps"),
    *("fov_vertical_deg", "zones", "plugin_settings", "isolate", "attention", "preset"),
)
"""Settings of a run that matter when it is stepped: nothing is late here, and nothing recorded."""


@takes(WatchSettings, only=OPTIONS)
def step(
    setting: Given,
    source: Annotated[
        str, typer.Argument(help="Video file, folder of images, camera, URL, or a run folder.")
    ],
    settings_file: SettingsFile = None,
) -> None:
    """Step through a video or a recorded run, forth and back, and look into the agent's mind.

    Commands are read from the terminal, or from a pipe: one a line, see `help`. Exit code: 0; from a pipe 2
    when a command could not be obeyed.
    """
    from visup.agent.storage.journal_reader import is_run
    from visup.terminal.prompt import read_commands
    from visup.terminal.session import Session

    with ExitStack() as stack:
        if is_run(source):
            agent, frames = _recorded(Path(source), setting, settings_file)
        else:
            agent, frames = _live(watch_settings(source, setting, settings_file), stack)
        session = Session(agent, frames)
        at_prompt = sys.stdin.isatty()
        code = session.run(read_commands(session))
    # At a prompt a slip is put right by the next line; from a pipe nobody would know of it.
    raise typer.Exit(0 if at_prompt else code)


def _live(settings: WatchSettings, stack: ExitStack) -> tuple[Agent, Any]:
    from visup.runs.wiring import build_agent, open_video

    agent = build_agent(settings)
    stack.callback(agent.close)
    return agent, stack.enter_context(open_video(settings))


def _recorded(
    run: Path, given: Given, settings_file: Path | None
) -> tuple[Agent, ObservationSource]:
    from visup.agent.model.errors import SettingsError
    from visup.agent.storage.journal_reader import Recording
    from visup.runs.replay import settings_for
    from visup.runs.wiring import reasoning_agent
    from visup.stepping import RecordedObservations

    beyond = flags_of(WatchSettings, [name for name in given if name not in REPLAYED])
    beyond += ["--settings"] if settings_file else []
    if beyond:
        raise SettingsError(
            f"a recorded run is not perceived again: {', '.join(beyond)} cannot be changed",
            expected="--task, --rules, --actor or --zones",
        )
    recording = Recording.open(run)
    return reasoning_agent(settings_for(recording, **given)), RecordedObservations(recording)
