"""Requests of the page: facts about the clip, snapping an outline to edges, storing objects."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.teaching.clip_frames import ClipFrames
from visup.teaching.outline_teaching import TeachingResult, teach_outlines
from visup.teaching.outlines import DrawnOutline
from visup.teaching.snapping import snapped

MAX_OUTLINES = 200
MAX_CORNERS = 5000

Response = dict[str, Any]


def clip_facts(frames: ClipFrames, frame: int, models: Path) -> Response:
    """What the page shows at first: the clip, the database, and the names that it knows.

    Raises:
        DatabaseError: The database is damaged.
    """
    database = ModelDatabase.open(models) if models.exists() else None
    taught = Counter(v.name for v in database.taught) if database else Counter()
    return {
        "clip": frames.name,
        "count": frames.count,
        "frame": frame,
        "models": str(models),
        "known": {name: taught[name] for name in database.names()} if database else {},
    }


def snap(frames: ClipFrames, request: Mapping[str, Any]) -> Response:
    """The corners of an outline, snapped to the edges near it.

    Raises:
        VisupError: It is no outline, or the frame is not there.
    """
    outline = _outline({"name": "outline", **request})
    return {"corners": snapped(frames.at(_number(request)), outline).corners}


def save(frames: ClipFrames, models: Path, request: Mapping[str, Any]) -> TeachingResult:
    """Store things that were drawn, all or nothing.

    Raises:
        VisupError: One has no name, or shows nothing.
    """
    things = request.get("things")
    if not isinstance(things, Sequence) or not 0 < len(things) <= MAX_OUTLINES:
        raise SettingsError("nothing was outlined", expected="at least one outline with its name")
    return teach_outlines(frames, [(_number(t), _outline(t)) for t in things], models)


def _number(request: object) -> int:
    number = request.get("frame") if isinstance(request, Mapping) else None
    if not isinstance(number, int) or isinstance(number, bool) or not 0 <= number < 1 << 31:
        raise SettingsError(f"{number!r} is not the number of a frame")
    return number


def _outline(request: Mapping[str, Any]) -> DrawnOutline:
    name, corners = request.get("name"), request.get("corners")
    if not isinstance(name, str) or not name.strip():
        raise SettingsError("an outline has no name yet", hint="give it one in the list")
    if not isinstance(corners, list) or not 3 <= len(corners) <= MAX_CORNERS:
        raise SettingsError(f"the outline of '{name}' has too few corners", expected="at least 3")
    return DrawnOutline(name.strip(), tuple(_corner(name, c) for c in corners))


def _corner(name: str, corner: object) -> tuple[float, float]:
    is_pair = isinstance(corner, list) and len(corner) == 2
    if is_pair and all(isinstance(n, int | float) and math.isfinite(n) for n in corner):  # type: ignore[attr-defined]
        return float(corner[0]), float(corner[1])  # type: ignore[index]
    raise SettingsError(f"the outline of '{name}' has a corner that is not two numbers: {corner!r}")
