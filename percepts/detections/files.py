"""Boxes from files: MOT Challenge text and COCO JSON, with or without track numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any

from visup.agent.model.errors import SettingsError
from visup.agent.storage.text_file import check_room, read_text_file
from visup.percepts.detections.boxes import Detection

EXPECTED = (
    "MOT lines `frame,id,left,top,width,height,score,...` (frames from 1), or COCO JSON whose "
    "annotations have `image_id` and `bbox` (and `track_id`, where a tracker has numbered them)"
)
MAX_BYTES = 2**27
MAX_COCO_VALUES, MAX_MOT_LINES = 12_000_000, 2_000_000
"""About one and two million boxes, which take a gigabyte."""
FARTHEST, MAX_TRACKS = 1e6, 10**9
"""Pixels from the corner, and the highest number of a track."""
SCORE = 6
"""Index of the last MOT column used, from 0."""


Frames = Mapping[int, tuple[Detection, ...]]
"""Index of a frame, from 0 -> its boxes."""


def read_detections(path: Path, images: Sequence[str] = ()) -> Frames:
    """The boxes of a file, by frame.

    Boxes carry the numbers of the tracker that wrote them, or all have none (0).

    Args:
        path: The file.
        images: Names of the watched images, in order, where the source is a folder of images; those of a
            COCO file are then matched by name.

    Raises:
        SettingsError: The file cannot be read, has neither format, refers to images that the source does
            not have, or numbers only some of its boxes.
    """
    try:
        text = read_text_file(path, MAX_BYTES)
        is_coco = text.lstrip().startswith("{")
        check_room(text.encode(), *((MAX_COCO_VALUES,) if is_coco else (MAX_MOT_LINES, b"\n")))
        rows = _coco(json.loads(text), images) if is_coco else _mot(text)
        found: dict[int, list[Detection]] = {}
        for frame, detection in rows:
            _check(frame, detection)
            found.setdefault(frame, []).append(detection)
    except OSError as fault:
        what = f"the detections cannot be read ({fault.strerror})"
        raise SettingsError(what, where=str(path)) from fault
    except (KeyError, TypeError, ValueError, IndexError, OverflowError, RecursionError) as fault:
        reason = f"no {fault}" if isinstance(fault, KeyError) else str(fault)
        what = f"the detections cannot be used: {reason}"
        raise SettingsError(what, where=str(path), expected=EXPECTED) from fault
    numbered = {d.track > 0 for boxes in found.values() for d in boxes}
    if len(numbered) > 1:
        what = (
            "the detections cannot be used: some boxes have the number of a track, others have none"
        )
        raise SettingsError(what, where=str(path), expected=EXPECTED)
    return {frame: tuple(boxes) for frame, boxes in found.items()}


def _check(frame: int, detection: Detection) -> None:
    if frame < 0:
        raise ValueError(f"there is no frame {frame}")
    if not all(abs(side) <= FARTHEST for side in detection.box):
        raise ValueError(f"a box at {detection.box}")
    if detection.track > MAX_TRACKS:
        raise ValueError("a track has a number of more than nine digits")
    if not min(detection.box[2:]) > 0:
        raise ValueError(f"a box of {detection.box[2]:g} x {detection.box[3]:g} pixels")


def _mot(text: str) -> Iterator[tuple[int, Detection]]:
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        cells = line.split(",", SCORE + 1)
        if len(cells) < 6:
            raise ValueError(f"line {number} has {len(cells)} values")
        x, y, w, h = (float(c) for c in cells[2:6])
        score = float(cells[SCORE]) if len(cells) > SCORE else 1.0
        sure = min(1.0, score) if score > 0 else 1.0
        track = max(0, int(float(cells[1])))  # -1 in the output of a detector
        yield int(float(cells[0])) - 1, Detection(track, (x, y, w, h), sure)


def _coco(data: Any, images: Sequence[str]) -> Iterator[tuple[int, Detection]]:
    names = {c["id"]: str(c["name"]) for c in data.get("categories", ())}
    order = _coco_frames({i["id"]: str(i.get("file_name", "")) for i in data["images"]}, images)
    for row in data["annotations"]:
        x, y, w, h = (float(v) for v in row["bbox"])
        score = min(1.0, max(0.0, float(row.get("score", 1.0))))
        name = names.get(row.get("category_id"))
        track = max(0, int(row.get("track_id", 0)))
        yield order[row["image_id"]], Detection(track, (x, y, w, h), score, name)


def _coco_frames(files: Mapping[Any, str], images: Sequence[str]) -> Mapping[Any, int]:
    """The frame of each image of a COCO file.

    By its frame number where visup wrote it (`clip.mp4#12`); else by its name, where images are watched;
    else by its rank among the ids.

    Args:
        files: Id of an image -> its file name, empty where there is none.
        images: Names of the watched images, in order; none for a video.

    Raises:
        ValueError: An image is not among the watched ones.
    """
    numbers = {n: re.search(r"#(\d+)$", file) for n, file in files.items()}
    if all(numbers.values()):
        return {n: int(m[1]) for n, m in numbers.items() if m}
    if not (images and all(files.values())):
        return {n: k for k, n in enumerate(sorted(files))}
    index = {PurePath(name).stem: k for k, name in enumerate(images)}
    for file in files.values():
        if PurePath(file).stem not in index:
            raise ValueError(f"the image '{file}' is none of those that are watched")
    return {n: index[PurePath(file).stem] for n, file in files.items()}
