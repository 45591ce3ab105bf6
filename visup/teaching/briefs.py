"""Briefs: outlines in a file, each with the clip and the frame in which it was drawn.

    {"teach":       {"part": {"clip": "first_clip", "frame": 0, "polygon": [[459, 257], ...]}},
     "teach_own":   {"part": ...},
     "teach_extra": {"hand": ...}}

`teach` outlines what plays a part in the task, where its family of clips was first filmed; `teach_own` does
so in this clip itself, and takes its place where it is given; `teach_extra` outlines things that play none.
A clip is a folder beside the brief's own that holds the video.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.teaching.outlines import DrawnOutline

VIDEOS = ("clip.mp4", "video.mp4")
"""Names of a clip's video in its folder."""

EXPECTED = '{"teach": {NAME: {"clip": FOLDER, "frame": N, "polygon": [[x, y], ...]}}}'


@dataclass(frozen=True, slots=True)
class Showing:
    """An outline, and where it was drawn.

    Attributes:
        outline: The outline.
        video: The clip's file.
        frame: Number of the frame, from 0.
    """

    outline: DrawnOutline
    video: Path
    frame: int


def read_showings(brief: Path) -> tuple[Showing, ...]:
    """All that a brief shows.

    Args:
        brief: The file, or the folder that holds it as `brief.json`.

    Raises:
        SettingsError: It is missing or not as it should be, or a clip that it names is not there.
    """
    path = brief / "brief.json" if brief.is_dir() else brief
    told = _read(path)
    shown: list[Showing] = []
    own, extra = told.get("teach_own", {}), told.get("teach_extra", {})
    for key, part in (("teach", told.get("teach", {})), ("teach_own", own), ("teach_extra", extra)):
        if not isinstance(part, Mapping):
            raise _unusable(path, f'"{key}" is no mapping of names')
        kept = {k: v for k, v in part.items() if key != "teach" or k not in own}
        shown += _showings(path, key, kept)
    if not shown:
        raise _unusable(path, "it teaches nothing")
    return tuple(shown)


def _read(path: Path) -> Mapping[str, Any]:
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
    except OSError as e:
        raise SettingsError(
            f"the brief cannot be read ({e.strerror or e})", where=str(path), expected=EXPECTED
        ) from e
    except ValueError as e:
        raise _unusable(path, f"it is not JSON: {e}") from e
    if not isinstance(told, Mapping):
        raise _unusable(path, "it is no mapping")
    return told


def _showings(path: Path, key: str, part: Mapping[str, Any]) -> Iterator[Showing]:
    for name, shown in part.items():
        try:
            corners = tuple((float(x), float(y)) for x, y in shown["polygon"])
            frame = int(shown.get("frame", 0))
            clip = str(shown.get("clip", path.parent.name))
        except (KeyError, TypeError, ValueError, AttributeError) as e:
            fault = f"no {e}" if isinstance(e, KeyError) else str(e)
            raise _unusable(path, f"\"{key}\" of '{name}': {fault}") from e
        yield Showing(DrawnOutline(str(name), corners), _video(path, clip), frame)


def _video(path: Path, clip: str) -> Path:
    folder = path.resolve().parent.parent / clip
    for name in VIDEOS:
        if (folder / name).is_file():
            return folder / name
    raise SettingsError(
        f"the clip '{clip}' is not there",
        where=str(path),
        expected=" or ".join(str(folder / name) for name in VIDEOS),
    )


def _unusable(path: Path, what: str) -> SettingsError:
    return SettingsError(f"this brief cannot be used: {what}", where=str(path), expected=EXPECTED)
