"""Continues a chunk beyond its end from its last state."""

from __future__ import annotations

import math

from visup.agent.storage.journal_reader import Recording
from visup.runs.resume import interrupted_run
from visup.runs.runner import supervise
from visup.runs.settings import RunOptions, WatchSettings

KEEP_LAST_STATE = math.inf
"""Seconds between saved states: only the last is saved."""


def chunk_options(begin: int, end: int | None) -> RunOptions:
    """How a chunk is recorded: only its journal, and its last state, from which it can be continued."""
    return RunOptions(video=False, report=False, state_every_s=KEEP_LAST_STATE, span=(begin, end))


def extend_chunk(settings: WatchSettings, chunk: Recording, end: int) -> None:
    """Continue a chunk.

    Args:
        settings: Settings of the run, which name any code of the user.
        chunk: Its recording, which is appended to.
        end: The frame before which it stops.

    Raises:
        VisupError: It cannot be continued.
    """
    folder, ends = chunk.path.parent, chunk.first_and_last()
    past = interrupted_run(folder, settings.behaviours, settings.plugins)
    begin = ends[0] if ends else 0
    supervise(past.settings, folder, options=chunk_options(begin, end), past=past)
