"""`visup step`: step the agent in the terminal and look into its mind, live or on a recorded run."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.commands.watch import (
    Actors,
    Attention,
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
    Tasks,
    Zones,
    settings_of,
)

if TYPE_CHECKING:
    from visup.agent.cycle.agent import Agent
    from visup.runs.settings import WatchSettings
    from visup.stepping import ObservationSource


def step(
    source: Annotated[
        str, typer.Argument(help="Video file, folder of images, camera, URL, or a run folder.")
    ],
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
    attention: Attention = False,
) -> None:
    """Step through a video or a recorded run, forth and back, and look into the agent's mind.

    Commands are read from the terminal, or from a pipe: one a line, see `help`.
    """
    # All options by their names: a run folder takes those that replay takes, and refuses the rest.
    given = dict(locals())
    from visup.terminal.prompt import read_commands
    from visup.terminal.session import Session

    with ExitStack() as stack:
        agent, frames = _recorded(given) if _is_run(source) else _live(settings_of(**given), stack)
        session = Session(agent, frames)
        code = session.run(read_commands(session))
    raise typer.Exit(code)


def _is_run(source: str) -> bool:
    from visup.agent.storage.journal_reader import JOURNAL

    path = Path(source)
    return (path / JOURNAL).is_file() or (path.is_file() and path.name == JOURNAL)


def _live(settings: WatchSettings, stack: ExitStack) -> tuple[Agent, Any]:
    from visup.runs.wiring import build_agent, open_video

    agent = build_agent(settings)
    stack.callback(agent.close)
    return agent, stack.enter_context(open_video(settings))


_AGAIN = ("source", "task", "rules", "actor", "zones")
"""What a recorded run can be reasoned about again with."""


def _recorded(given: dict[str, Any]) -> tuple[Agent, ObservationSource]:
    from visup.agent.model.errors import SettingsError
    from visup.agent.storage.journal_reader import Recording
    from visup.runs.replay import settings_for
    from visup.runs.settings import parse_actors
    from visup.runs.wiring import reasoning_agent
    from visup.stepping import RecordedObservations

    beyond = [k for k, v in given.items() if k not in _AGAIN and v not in (None, [], 1, False)]
    if beyond:
        raise SettingsError(
            f"a recorded run is not seen again: {', '.join(beyond)} cannot be changed",
            expected="--task, --rules, --actor or --zones",
        )
    recording = Recording.open(Path(given["source"]))
    settings = settings_for(
        recording,
        tasks=tuple(given["task"] or ()),
        rules=tuple(given["rules"] or ()),
        actors=parse_actors(given["actor"] or ()),
        zones=given["zones"],
    )
    return reasoning_agent(settings), RecordedObservations(recording)
