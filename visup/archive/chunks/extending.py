"""A chunk that is watched on beyond its end, from the state in which it ended."""

from __future__ import annotations

import math

from visup.agent.storage.journal_reader import Recording
from visup.runs.resume import interrupted_run
from visup.runs.runner import supervise
from visup.runs.settings import RunOptions, WatchSettings

KEEP_LAST_STATE = math.inf
"""Seconds between states: none but the last."""


def chunk_options(begin: int, end: int | None) -> RunOptions:
    """How a chunk is recorded: its journal alone, and its last state, from which it can go on."""
    return RunOptions(video=False, report=False, state_every_s=KEEP_LAST_STATE, span=(begin, end))


def extend_chunk(settings: WatchSettings, chunk: Recording, end: int) -> None:
    """Watch a chunk on.

    Args:
        settings: Those of the run: whatever code of the user's own it has is named by them.
        chunk: Its recording, which grows.
        end: The first frame that it no longer looks at.

    Raises:
        VisupError: It cannot be watched on.
    """
    folder, ends = chunk.path.parent, chunk.first_and_last()
    past = interrupted_run(folder, settings.behaviours, settings.plugins)
    begin = ends[0] if ends else 0
    supervise(past.settings, folder, options=chunk_options(begin, end), past=past)
