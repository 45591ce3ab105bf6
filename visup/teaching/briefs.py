"""Briefs: outlines in a file, each with the clip and the frame in which it was drawn.

    {"teach":       {"part": {"clip": "first_clip", "frame": 0, "polygon": [[459, 257], ...]}},
     "teach_own":   {"part": ...},
     "teach_extra": {"hand": ...}}

`teach` outlines what plays a part in the task, where its family of clips was first filmed; `teach_own`
outlines some or all of it in this clip itself, and takes its place name by name; `teach_extra` outlines
things that play no part. A clip is a folder beside the brief's own that holds the video.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.agent.storage.text_file import read_text_file
from visup.teaching.outlines import DrawnOutline

VIDEOS = ("clip.mp4", "video.mp4")
"""Names of a clip's video in its folder."""

MAX_BRIEF_BYTES = 16 * 2**20

EXPECTED = '{"teach": {NAME: {"clip": FOLDER, "frame": N, "polygon": [[x, y], ...]}}}'


@dataclass(frozen=True, slots=True)
class ClipOutline:
    """An outline, and where it was drawn.

    Attributes:
        outline: The outline.
        video: The clip's file.
        frame: Number of the frame, from 0.
        in_task: Whether it plays a part in the task; `teach_extra` does not.
    """

    outline: DrawnOutline
    video: Path
    frame: int
    in_task: bool = True

    @property
    def name(self) -> str:
        """Of the thing."""
        return self.outline.name


def read_clip_outlines(brief: Path) -> tuple[ClipOutline, ...]:
    """All that a brief shows.

    Args:
        brief: The file, or the folder that holds it as `brief.json`.

    Raises:
        SettingsError: It is missing or not as it should be, or a clip that it names is not there.
    """
    path = brief / "brief.json" if brief.is_dir() else brief
    document = _read(path)
    shared, own = (
        _outlines_by_name(path, document, "teach"),
        _outlines_by_name(path, document, "teach_own"),
    )
    extra = _outlines_by_name(path, document, "teach_extra")
    outlines = (*(shared | own).values(), *(replace(s, in_task=False) for s in extra.values()))
    if not outlines:
        raise _unusable(path, "it teaches nothing")
    return outlines


def clip_video(folder: Path) -> Path:
    """The video of a clip that has a folder of its own.

    Raises:
        SettingsError: There is none.
    """
    for name in VIDEOS:
        if (folder / name).is_file():
            return folder / name
    raise SettingsError("there is no video", where=str(folder), expected=" or ".join(VIDEOS))


def _read(path: Path) -> Mapping[str, Any]:
    try:
        document = json.loads(read_text_file(path, MAX_BRIEF_BYTES))
    except OSError as e:
        raise SettingsError(
            f"the brief cannot be read ({e.strerror or e})", where=str(path), expected=EXPECTED
        ) from e
    except ValueError as e:
        raise _unusable(path, f"it is not JSON: {e}") from e
    if not isinstance(document, Mapping):
        raise _unusable(path, "it is no mapping")
    return document


def _outlines_by_name(path: Path, document: Mapping[str, Any], key: str) -> dict[str, ClipOutline]:
    """One part of a brief, by name."""
    part = document.get(key, {})
    if not isinstance(part, Mapping):
        raise _unusable(path, f'"{key}" is no mapping of names')
    return {
        str(name): _clip_outline(path, f"\"{key}\" of '{name}'", name, part[name]) for name in part
    }


def _clip_outline(path: Path, where: str, name: str, entry: Any) -> ClipOutline:
    try:
        corners = tuple((float(x), float(y)) for x, y in entry["polygon"])
        frame = int(entry.get("frame", 0))
        clip = str(entry.get("clip", path.parent.name))
    except (KeyError, TypeError, ValueError, AttributeError) as e:
        fault = f"no {e}" if isinstance(e, KeyError) else str(e)
        raise _unusable(path, f"{where}: {fault}") from e
    return ClipOutline(DrawnOutline(str(name), corners), _named_video(path, clip), frame)


def _named_video(path: Path, clip: str) -> Path:
    """The video of a clip that a brief names: a folder beside its own."""
    folder = path.resolve().parent.parent / clip
    try:
        return clip_video(folder)
    except SettingsError as e:
        expected = " or ".join(str(folder / name) for name in VIDEOS)
        raise SettingsError(
            f"the clip '{clip}' is not there", where=str(path), expected=expected
        ) from e


def _unusable(path: Path, what: str) -> SettingsError:
    return SettingsError(f"this brief cannot be used: {what}", where=str(path), expected=EXPECTED)
