"""`visup step`: step an agent in the terminal and inspect its mind, live or on a recorded run."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.commands.options import REPLAY_SETTINGS, OptionValues, SettingsFile, flags_of, takes
from visup.commands.watch import watch_settings
from visup.runs.settings import WatchSettings

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from visup.agent.cycle.agent import Agent
    from visup.stepping import ObservationSource

STEP_SETTINGS = (
    *("tasks", "models", "rules", "actors", "every", "behaviours", "plugins", "fps"),
    *("fov_vertical_deg", "zones", "plugin_settings", "isolate", "attention", "preset"),
    *("detections", "motion"),
)
"""Settings that matter when stepping, where no frame is late and nothing is recorded."""


@takes(WatchSettings, only=STEP_SETTINGS)
def step(
    options: OptionValues,
    source: Annotated[
        str, typer.Argument(help="Video file, folder of images, camera, URL, or a run folder.")
    ],
    settings_file: SettingsFile = None,
) -> None:
    """Step back and forth through a video or a recorded run, and inspect what visup believes.

    Commands are read from the terminal or a pipe, one per line; type `help` for a list. Exit code: 0;
    2 if a command from a pipe could not be carried out.
    """
    from visup.agent.storage.journal_reader import is_run
    from visup.terminal.prompt import read_commands
    from visup.terminal.session import Session

    with ExitStack() as stack:
        if is_run(source):
            agent, frames, video = _recorded(Path(source), options, settings_file)
        else:
            settings = watch_settings(source, options, settings_file)
            (agent, frames), video = _live(settings, stack), settings.source
        session = Session(agent, frames, picture=_pictures(video, stack))
        interactive = sys.stdin.isatty()
        code = session.run(read_commands(session))
    # At a prompt the user sees a mistake and corrects it; in a pipe only the exit code shows it.
    raise typer.Exit(0 if interactive else code)


def _live(settings: WatchSettings, stack: ExitStack) -> tuple[Agent, Any]:
    from visup.percepts.video.realtime import in_real_time
    from visup.runs.monotonic_clock import MonotonicFrames
    from visup.runs.wiring import build_agent, open_video

    agent = build_agent(settings)
    stack.callback(agent.close)
    video = stack.enter_context(open_video(settings))
    if not video.live:
        return agent, video
    # A camera continues while the user inspects a step; the next step should show the newest frame.
    newest = in_real_time(video, video)
    stack.callback(newest.close)
    return agent, MonotonicFrames(newest, video.fps)


def _pictures(source: str, stack: ExitStack) -> Callable[[int], NDArray[np.uint8]] | None:
    """Frames by index, of a source that can be read again; None for cameras and missing files."""
    from visup.teaching.clip_frames import ClipFrames

    if not Path(source).exists() or Path(source).is_char_device():
        return None
    opened: list[ClipFrames] = []

    def picture(number: int) -> NDArray[np.uint8]:
        if not opened:
            opened.append(stack.enter_context(ClipFrames(source)))
        return opened[0].at(number)

    return picture


def _recorded(
    run: Path, options: OptionValues, settings_file: Path | None
) -> tuple[Agent, ObservationSource, str]:
    from visup.agent.model.errors import SettingsError
    from visup.agent.storage.journal_reader import Recording
    from visup.runs.replay import settings_for
    from visup.runs.wiring import reasoning_agent
    from visup.stepping import RecordedObservations

    unsupported = flags_of(WatchSettings, [name for name in options if name not in REPLAY_SETTINGS])
    unsupported += ["--settings"] if settings_file else []
    if unsupported:
        raise SettingsError(
            f"perception is not repeated on a recorded run: {', '.join(unsupported)} cannot be changed",
            expected="--task, --rules, --actor or --zones",
        )
    recording = Recording.open(run)
    settings = settings_for(recording, **options)
    return reasoning_agent(settings), RecordedObservations(recording), settings.source
