"""Clips of machines on disk: the brief for the supervisor, and the ground truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.evaluation.machines.scores import Interval, MachineTruth, TrueBoxes
from visup.evaluation.missions.files import read_json
from visup.evaluation.missions.scores import TrueStage
from visup.teaching.briefs import ClipOutline, clip_video, read_clip_outlines

MIN_TOLERANCE_S = 0.7
"""Least tolerance of annotated times, seconds."""


@dataclass(frozen=True, slots=True)
class Brief:
    """The input of a supervisor for a clip.

    Attributes:
        folder: Folder of the clip.
        video: Its video file.
        family: Identifies clips of one scene.
        task: A file in the folder, or the name of a shipped task.
        actors: Outlines of the actors of the task.
        others: Outlines of other things.
        fov_vertical_deg: Vertical field of view, if known.
    """

    folder: Path
    video: Path
    family: str
    task: str
    actors: tuple[ClipOutline, ...]
    others: tuple[ClipOutline, ...] = ()
    fov_vertical_deg: float | None = None

    @property
    def outlines(self) -> tuple[ClipOutline, ...]:
        """All outlines, actors first."""
        return (*self.actors, *self.others)


def clip_folders(folder: Path) -> list[Path]:
    """All folders with a brief, searched recursively, by path.

    Raises:
        SettingsError: There is none.
    """
    folders = sorted(p.parent for p in folder.rglob("brief.json"))
    if not folders:
        raise SettingsError(
            "no clip here has a brief",
            where=str(folder),
            expected="folders with brief.json, truth.json and clip.mp4 or video.mp4",
        )
    return folders


def read_brief(folder: Path) -> Brief:
    """Read the brief of a clip.

    Raises:
        SettingsError: The brief or a video is missing, or the brief is not valid.
    """
    path = folder / "brief.json"
    outlines, document = read_clip_outlines(path), read_json(path)
    if "task" not in document:
        raise SettingsError(
            'this brief cannot be used: it names no "task"',
            where=str(path),
            expected="a file in the folder, or the name of a shipped task",
        )
    task = str(document["task"])
    return Brief(
        folder,
        clip_video(folder),
        str(document.get("family", folder.name)),
        str(folder / task) if (folder / task).is_file() else task,
        tuple(outline for outline in outlines if outline.in_task),
        tuple(outline for outline in outlines if not outline.in_task),
        document.get("fov_vertical_deg"),
    )


def read_truth(folder: Path) -> MachineTruth:
    """Read the truth of a clip.

    Raises:
        SettingsError: It is missing or not valid.
    """
    path = folder / "truth.json"
    document = read_json(path)
    try:
        return parse_truth(document)
    except (KeyError, TypeError, ValueError) as error:
        raise SettingsError(
            f"this truth cannot be used: {type(error).__name__}: {error}", where=str(path)
        ) from error


def parse_truth(document: Mapping[str, Any]) -> MachineTruth:
    """Parse a `truth.json`; missing parts are not scored."""
    stages = tuple(
        TrueStage(str(s["stage"]), float(s["from_s"]), float(s["to_s"]), str(s["outcome"]))
        for s in document.get("stages", ())
    )
    accepted = document.get("accept") or ([document["verdict"]] if "verdict" in document else [])
    contacts, moves = document.get("contacts"), document.get("moves")
    return MachineTruth(
        stages,
        frozenset(map(str, accepted)),
        max(MIN_TOLERANCE_S, float(document.get("tolerance_s", 0.0))),
        tuple(_true_boxes(document.get("boxes", ()))),
        None if contacts is None else tuple(_contact(c) for c in contacts),
        None if moves is None else tuple(_interval((str(m["what"]),), m) for m in moves),
    )


def _true_boxes(rows: Any) -> Iterator[TrueBoxes]:
    """Boxes by frame; objects that are out of view, hidden or not annotated have none."""
    for row in rows:
        boxes = {n: tuple(map(float, b)) for n, b in row.items() if n != "frame" and _is_box(b)}
        yield TrueBoxes(int(row["frame"]), boxes)


def _is_box(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 4 and min(value[2:]) > 0


def _contact(entry: Mapping[str, Any]) -> Interval:
    return _interval(tuple(sorted((str(entry["a"]), str(entry["b"])))), entry)


def _interval(names: tuple[str, ...], entry: Mapping[str, Any]) -> Interval:
    return Interval(names, float(entry["from_s"]), float(entry["to_s"]))
