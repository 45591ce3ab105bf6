"""Quantities of objects from the image and beliefs: position, size, depth, direction, number."""

from __future__ import annotations

import numpy as np

from visup.agent import Presence
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.snapshot import SIGMAS, Floats, Snapshot, exact, interval_between
from visup.rules.wording.sentences import believed_name


def _seen(facts: Snapshot, values: list[float]) -> Floats:
    """(2, n) intervals of a measured quantity; unknown for objects out of view."""
    shown = [b.presence is Presence.SEEN for b in facts.beliefs]
    return exact(np.array([v if s else np.nan for v, s in zip(values, shown, strict=True)]))


def horizontal_position(facts: Snapshot) -> Floats:
    """The centre of each object from the left of the image, pixels."""
    return _seen(facts, [b.region.centroid[0] for b in facts.beliefs])


def vertical_position(facts: Snapshot) -> Floats:
    """The centre of each object from the top of the image, pixels."""
    return _seen(facts, [b.region.centroid[1] for b in facts.beliefs])


def width(facts: Snapshot) -> Floats:
    """The width of each object's box, pixels."""
    return _seen(facts, [float(b.region.bbox[2]) for b in facts.beliefs])


def height(facts: Snapshot) -> Floats:
    """The height of each object's box, pixels."""
    return _seen(facts, [float(b.region.bbox[3]) for b in facts.beliefs])


def area_share(facts: Snapshot) -> Floats:
    """The share of the image that each object covers."""
    image_area = float(np.prod(facts.mind.frame_size)) or 1.0
    return _seen(facts, [b.region.area / image_area for b in facts.beliefs])


def depth(facts: Snapshot) -> Floats:
    """Depth of each visible object, in the unit of its model, with its standard deviation."""
    known = [
        b if b.presence is Presence.SEEN and b.depth is not None else None for b in facts.beliefs
    ]
    depths = np.array([np.nan if b is None else b.depth for b in known], dtype=float)
    margins = np.array([0.0 if b is None else SIGMAS * (b.depth_sigma or 0.0) for b in known])
    return interval_between(np.maximum(depths - margins, 0.0), depths + margins)


def depth_difference(facts: Snapshot) -> Floats:
    """Difference of depth as a share of the smaller one, with standard deviations."""
    depth = facts.one("depth")
    if all(d != d for d in depth.tolist()):  # NaN is not equal to itself
        return facts.unknown(2)
    spread = np.array([SIGMAS * (b.depth_sigma or 0.0) for b in facts.beliefs])
    difference, margins = (
        np.abs(depth[:, None] - depth[None]),
        np.hypot(spread[:, None], spread[None]),
    )
    least = np.minimum(depth[:, None], depth[None])
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(least > 0, 1.0 / least, np.nan)
        return interval_between(
            np.maximum(difference - margins, 0.0) * share, (difference + margins) * share
        )


def confidence(facts: Snapshot) -> Floats:
    """Confidence of the identity of each object, 0 to 1; also of those out of view."""
    return exact(np.array([b.confidence for b in facts.beliefs], dtype=float))


def heading(facts: Snapshot) -> Floats:
    """Direction of motion of each object in the image, degrees: 0 to the right, 90 up; unknown at rest."""
    still_speed = facts.relation_settings.still_speed * image_diagonal(facts.mind.frame_size)
    found = []
    for belief in facts.beliefs:
        x, y = belief.region.velocity
        moves = np.hypot(x, y) > still_speed
        found.append(float(np.degrees(np.arctan2(-y, x)) % 360.0) if moves else np.nan)
    return _seen(facts, found)


def centre_distance(facts: Snapshot) -> Floats:
    """Distance between the centres of all pairs, pixels; unknown if one is out of view."""
    x, y = horizontal_position(facts), vertical_position(facts)
    known = np.isfinite(x[0])
    distance = np.hypot(
        np.where(known, x[0], 0.0)[:, None] - np.where(known, x[0], 0.0)[None],
        np.where(known, y[0], 0.0)[:, None] - np.where(known, y[0], 0.0)[None],
    )
    return _of_known_pairs(distance, known)


def box_overlap(facts: Snapshot) -> Floats:
    """Intersection over union of the boxes of all pairs, 0 to 1; unknown if one is out of view."""
    boxes = np.array([b.region.bbox for b in facts.beliefs], dtype=float).reshape(-1, 4)
    low, high = boxes[:, :2], boxes[:, :2] + boxes[:, 2:]
    sides = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    shared = np.maximum(sides, 0.0).prod(axis=2)
    area = boxes[:, 2:].prod(axis=1)
    union = np.maximum(area[:, None] + area[None] - shared, 1e-9)
    known = np.array([b.presence is Presence.SEEN for b in facts.beliefs], dtype=bool)
    return _of_known_pairs(shared / union, known)


def _of_known_pairs(
    values: Floats, known: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
) -> Floats:
    both = known[:, None] & known[None]
    return np.array((np.where(both, values, -np.inf), np.where(both, values, np.inf)))


def number_of_objects(facts: Snapshot) -> Floats:
    """Number of visible objects."""
    count = float(sum(b.presence is Presence.SEEN for b in facts.beliefs))
    return np.array((count, count))


def number_of_kind(facts: Snapshot, name: str) -> Floats:
    """Number of visible objects of a name; an interval, since unidentified ones may be."""
    seen = [b for b in facts.beliefs if b.presence is Presence.SEEN]
    surely = float(sum(name in (b.name, believed_name(facts.mind, b.id)) for b in seen))
    possibly = surely + sum(not b.candidates for b in seen)
    return np.array((surely, float(possibly)))
