"""Recorded objects in the formats of other tools: MOT, COCO, FiftyOne, CSV."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.storage.atomic import write_atomically
from visup.api.recorded import RecordedObject, RecordedRun, open_run

COLUMNS = (
    "frame_index",
    "time",
    "id",
    "name",
    "share",
    "presence",
    "confirmed",
    "x",
    "y",
    "width",
    "height",
    "area",
)


def export(
    run: RecordedRun | str | os.PathLike[str], form: str, target: str | os.PathLike[str]
) -> int:
    """Write the objects of a run for other tools.

    Args:
        run: A run, or its folder.
        form: `mot` (MOT Challenge: one line per box, frames from 1), `coco` (COCO JSON with `track_id`),
            `fiftyone` (labels of a video for FiftyOne: boxes as shares of the picture, frames from 1) or
            `csv` (all beliefs, also about hidden and unconfirmed objects).
        target: The file.

    Returns:
        Number of boxes of objects in view; the same for every form.

    Raises:
        SettingsError: There is no such form.
        OutputError: The run cannot be read, or the file cannot be written.
    """
    if form not in FORMS:
        raise SettingsError(f"there is no form '{form}'", expected=f"one of: {', '.join(FORMS)}")
    recorded = run if isinstance(run, RecordedRun) else open_run(run)
    text, count = FORMS[form](recorded)
    try:
        write_atomically(Path(target), text.encode("utf-8"))
    except OSError as error:
        what = f"the file cannot be written ({error.strerror})"
        raise OutputError(what, where=str(target)) from error
    return count


def _objects_in_view(run: RecordedRun) -> Iterator[RecordedObject]:
    """Confirmed objects in view."""
    return filter(_in_view, run.objects)


def _in_view(o: RecordedObject) -> bool:
    return o.confirmed and o.presence == "seen"


def _mot(run: RecordedRun) -> tuple[str, int]:
    lines = [
        f"{o.frame_index + 1},{o.id},{','.join(map(str, o.bbox))},{o.share or 1.0:.3f},-1,-1,-1"
        for o in _objects_in_view(run)
    ]
    return "".join(f"{line}\n" for line in lines), len(lines)


def _coco(run: RecordedRun) -> tuple[str, int]:
    width, height = run.facts.get("size") or (0, 0)
    source = str(run.facts.get("source", ""))
    objects = list(_objects_in_view(run))
    names = {name: n for n, name in enumerate(sorted({o.name for o in objects}), start=1)}
    images = [
        {
            "id": s.frame_index,
            "file_name": f"{source}#{s.frame_index}",
            "width": width,
            "height": height,
        }
        for s in run.steps
    ]
    annotations = [
        {
            "id": number,
            "image_id": o.frame_index,
            "category_id": names[o.name],
            "bbox": list(o.bbox),
            "area": o.area,
            "iscrowd": 0,
            "track_id": o.id,
            "score": o.share or 1.0,
        }
        for number, o in enumerate(objects, start=1)
    ]
    document: dict[str, Any] = {
        "info": {"description": f"visup run of {source}"},
        "images": images,
        "categories": [{"id": n, "name": name} for name, n in names.items()],
        "annotations": annotations,
    }
    return json.dumps(document) + "\n", len(annotations)


def _fiftyone(run: RecordedRun) -> tuple[str, int]:
    width, height = run.facts.get("size") or (1, 1)
    frames: dict[str, dict[str, Any]] = {}
    count = 0
    for o in _objects_in_view(run):
        count += 1
        number = o.frame_index + 1
        frame = frames.setdefault(str(number), {"frame_number": number, "objects": {"objects": []}})
        frame["objects"]["objects"].append(
            {
                "label": o.name,
                "confidence": o.share or 1.0,
                "index": o.id,
                "bounding_box": _corners(o.bbox, width, height),
            }
        )
    return json.dumps({"frames": frames}) + "\n", count


def _corners(box: Sequence[int], width: int, height: int) -> dict[str, dict[str, float]]:
    x, y, w, h = box
    return {
        "top_left": {"x": x / width, "y": y / height},
        "bottom_right": {"x": (x + w) / width, "y": (y + h) / height},
    }


def _csv(run: RecordedRun) -> tuple[str, int]:
    out = StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    count = 0
    for o in run.objects:
        beliefs = (o.name, o.share, o.presence, o.confirmed)
        writer.writerow((o.frame_index, o.time, o.id, *beliefs, *o.bbox, o.area))
        count += _in_view(o)
    return out.getvalue(), count


FORMS: Mapping[str, Callable[[RecordedRun], tuple[str, int]]] = MappingProxyType(
    {"mot": _mot, "coco": _coco, "fiftyone": _fiftyone, "csv": _csv}
)
"""Form -> function of a run that returns the text of the file and its number of boxes."""
