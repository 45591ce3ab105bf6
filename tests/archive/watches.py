"""Scripted functions for watching that take no time; some clips fail or kill their worker.

Workers import these, so that they stand in a module.
"""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from pathlib import Path

from tests.archive.recordings import meeting, record
from visup.agent.model.errors import SourceError
from visup.archive.filling.clips import Clip
from visup.runs.settings import WatchSettings


def scripted(settings: WatchSettings, folder: Path) -> None:
    """A meeting whose place follows from the clip's content; `bad` fails, `fault` and `deadly` are worse."""
    text = Path(settings.source).read_text()
    if text.startswith("bad"):
        raise SourceError("this is not a video", where=settings.source)
    if text.startswith("fault"):
        raise RuntimeError("the fuse blew")
    if text.startswith("deadly"):
        os.kill(os.getpid(), signal.SIGKILL)
    record(folder, meeting(12, shift=float(text)), replace(settings))


def clips(folder: Path, *texts: str) -> list[Clip]:
    """Clips with some content."""
    folder.mkdir(exist_ok=True)
    clip_list = []
    for number, text in enumerate(texts):
        path = folder / f"clip-{number}.mp4"
        path.write_text(text)
        clip_list.append(Clip(path, taken=1e9))
    return clip_list
