"""`visup.teach`: store objects that a user outlines in one picture, and report on it."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.database.taught_records import checked_name
from visup.percepts.taught.taught_view import TaughtView, taught_view, taught_view_from_mask
from visup.percepts.video.source import to_bgr
from visup.teaching.briefs import ClipOutline, read_clip_outlines
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.outlines import DrawnOutline

MIN_SIDE = 16
"""An object whose longer side has fewer pixels may be hard to recognise."""

Corners = Sequence[Sequence[float]]
OutlineLike = Corners | NDArray[np.bool_] | NDArray[np.number]
"""Corners (x, y) in pixels, also as an array (N, 2), or a mask (H, W) bool over the whole picture."""


@dataclass(frozen=True, slots=True)
class TeachingResult:
    """The result of teaching.

    Attributes:
        database: As it is now.
        views: The new views, in order.
        messages: A sentence or two about each, and one about the database.
    """

    database: ModelDatabase
    views: tuple[TaughtView, ...]
    messages: tuple[str, ...]


def teach(
    source: str | os.PathLike[str] | NDArray[np.uint8],
    outlines: Mapping[str, OutlineLike],
    *,
    models: str | os.PathLike[str] | ModelDatabase,
    frame: int = 0,
) -> ModelDatabase:
    """Teach objects: they are recognised from then on, wherever the model database is used.

    Views accumulate: teaching an existing name adds a view.

    Example:
        ```python
        models = visup.teach(
            "clip.mp4",
            {"part": [(459, 257), (528, 322), (441, 315)], "tray": [(318, 184), (412, 185), (365, 232)]},
            models="cell.models",
        )
        run = visup.watch("clip.mp4", task="pick.task", models=models)
        ```

    Args:
        source: A video, a folder of images, a picture file, or a picture (H, W, 3) uint8, BGR.
        outlines: Name -> corners (x, y) in pixels of the picture, y down; or a mask (H, W) bool.
        models: The model database; one that does not exist yet is created.
        frame: Number of the frame in which they are outlined, from 0.

    Returns:
        The updated database.

    Raises:
        VisupError: The source has no such frame, an outline shows nothing, or the database cannot
            be written; nothing is stored then.
    """
    if isinstance(source, np.ndarray):
        picture = to_bgr(source)
    else:
        with ClipFrames(os.fspath(source)) as frames:
            picture = frames.at(frame)
    views = [_view(name, picture, drawn) for name, drawn in outlines.items()]
    path = models.path if isinstance(models, ModelDatabase) else Path(models)
    return store(path, views).database


def teach_outlines(
    frames: ClipFrames, drawn: Sequence[tuple[int, DrawnOutline]], models: Path
) -> TeachingResult:
    """Store outlines drawn in frames of a clip.

    Args:
        frames: The clip.
        drawn: Number of a frame, and what was outlined in it.
        models: The database.

    Raises:
        VisupError: As `teach`.
    """
    views = [
        taught_view(outline.name, frames.at(number), outline.corners)
        for number, outline in sorted(drawn, key=lambda d: d[0])
    ]
    return store(models, views)


def teach_brief(brief: Path, models: Path) -> TeachingResult:
    """Store all that a brief shows; see `briefs.py`.

    Raises:
        VisupError: As `teach`, or the brief is not as it should be.
    """
    return store(models, views_of(read_clip_outlines(brief)))


def views_of(showings: Sequence[ClipOutline]) -> list[TaughtView]:
    """The views that outlines in clips show, clip by clip.

    Raises:
        VisupError: A clip has no such frame, or an outline shows nothing.
    """
    views: dict[int, TaughtView] = {}
    for video in dict.fromkeys(s.video for s in showings):
        in_video = [k for k, s in enumerate(showings) if s.video == video]
        with ClipFrames(str(video)) as frames:
            for k in sorted(in_video, key=lambda k: showings[k].frame):
                outline = showings[k].outline
                views[k] = taught_view(outline.name, frames.at(showings[k].frame), outline.corners)
    return [views[k] for k in sorted(views)]


def store(models: Path, views: Sequence[TaughtView]) -> TeachingResult:
    """Add views to a database, all or nothing, and say so.

    Raises:
        DatabaseError: The file is no database, or cannot be written.
    """
    if not views:
        raise SettingsError("nothing was outlined", expected="at least one outline with its name")
    for view in views:
        checked_name(view.name)
    before = ModelDatabase.open_or_new(models)
    database = before.teach(views)
    view_count = len(before.taught)
    messages = [_view_message(v) for v in views]
    if len(database.taught) == view_count:
        messages.append(f"{models} already has all of this; nothing was added.")
    else:
        messages.append(_summary(database))
    return TeachingResult(database, tuple(views), tuple(messages))


def _view(name: str, picture: NDArray[np.uint8], drawn: OutlineLike) -> TaughtView:
    if isinstance(drawn, np.ndarray):
        if drawn.dtype != bool:
            return taught_view(name, picture, drawn.tolist())
        if drawn.shape != picture.shape[:2]:
            raise SettingsError(
                f"the mask of '{name}' is of shape {drawn.shape}",
                expected=f"that of the picture, {picture.shape[:2]}",
            )
        return taught_view_from_mask(name, picture, drawn.astype(bool))
    return taught_view(name, picture, drawn)


def _view_message(view: TaughtView) -> str:
    x, y, width, height = view.bbox
    message = f"{view.name}: {width} x {height} pixels at ({x}, {y})"
    if min(x, y) == 0 or x + width == view.frame_size[0] or y + height == view.frame_size[1]:
        message += ", cut by the picture's border"
    if max(width, height) < MIN_SIDE:
        message += "; an object this small may be hard to find again"
    return message + "."


def _summary(database: ModelDatabase) -> str:
    counts = Counter(v.name for v in database.taught)
    listed = ", ".join(f"{n} ({c} view{'s' if c > 1 else ''})" for n, c in counts.items())
    return f"{database.path} has outlines of: {listed}."
