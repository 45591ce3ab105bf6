"""Conversion from and to `supervision.Detections`, which trackers, annotators and counters share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from visup.agent import Mind, Presence
from visup.agent.model.errors import SettingsError
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.percepts.detections.boxes import Detection

if TYPE_CHECKING:
    from collections.abc import Mapping


class SupervisionDetections(Protocol):
    """The part of `supervision.Detections` in use: rows of one length, None where unknown."""

    @property
    def xyxy(self) -> Any: ...  # noqa: D102

    @property
    def confidence(self) -> Any: ...  # noqa: D102

    @property
    def class_id(self) -> Any: ...  # noqa: D102

    @property
    def tracker_id(self) -> Any: ...  # noqa: D102

    @property
    def data(self) -> Mapping[str, Any]: ...  # noqa: D102


def from_supervision(found: SupervisionDetections) -> tuple[Detection, ...]:
    """Boxes of one frame.

    Args:
        found: `supervision.Detections`; the numbers of a tracker are kept (from 0 there, from 1 here).


    Returns:
        The boxes, in the same order, with names where `data["class_name"]` has them.
    """
    rows = np.asarray(found.xyxy, float).reshape(-1, 4)
    empty = [None] * len(rows)
    scores = empty if found.confidence is None else list(found.confidence)
    tracks = empty if found.tracker_id is None else list(found.tracker_id)
    names = list(found.data.get("class_name", empty))
    return tuple(
        Detection(
            0 if track is None or track < 0 else int(track) + 1,
            (float(x1), float(y1), float(x2 - x1), float(y2 - y1)),
            1.0 if score is None else min(1.0, max(0.0, float(score))),
            None if name is None else str(name),
        )
        for (x1, y1, x2, y2), score, track, name in zip(rows, scores, tracks, names, strict=True)
        if x2 > x1 and y2 > y1
    )


def to_supervision(mind: Mind) -> Any:
    """The visible objects, as `supervision.Detections` for its annotators, counters and zones.

    Args:
        mind: The mind after a step (`step.mind`).

    Returns:
        Boxes with masks, `tracker_id` (the ids of the objects), `confidence` (of the name) and
        `data["class_name"]`; `class_id` numbers the names alphabetically.

    Raises:
        SettingsError: supervision is not installed.
    """
    try:
        import supervision
    except ModuleNotFoundError as missing:
        raise SettingsError(
            "objects as supervision.Detections need the library supervision, which is not installed",
            hint="pip install supervision",
        ) from missing
    seen = [b for b in mind.present() if b.presence is Presence.SEEN]
    names = [b.name or UNKNOWN_OBJECT for b in seen]
    classes = {name: n for n, name in enumerate(sorted(set(names)))}
    boxes = np.array([b.region.bbox for b in seen], np.float32).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    width, height = mind.frame_size
    masks = np.zeros((len(seen), height, width), bool)
    for mask, belief in zip(masks, seen, strict=True):
        x, y, w, h = belief.region.bbox
        mask[y : y + h, x : x + w] = belief.region.mask
    return supervision.Detections(
        xyxy=boxes,
        mask=masks,
        confidence=np.array([b.confidence for b in seen], np.float32),
        class_id=np.array([classes[n] for n in names], int),
        tracker_id=np.array([b.id for b in seen], int),
        data={"class_name": np.array(names)},
    )
