"""Re-identification: objects that get another region, when found again or seen whole.

A new region where a missing object should be is that object, which keeps its id. Where a larger region
appears around an object that came over no border and never left its place, only a part of that object was
seen before: the object takes over the larger region.
"""

from __future__ import annotations

from dataclasses import replace

from visup.agent import ObjectBelief, Presence
from visup.rules.geometry.regions import box_intersection, box_iou, expanded
from visup.rules.presence.association import delete_objects, reassign_region
from visup.rules.presence.fragments import share_within
from visup.rules.presence.lifecycle import demote
from visup.rules.presence.object_tracks import border_sides, new_track, predicted_box, sides_of
from visup.rules.presence.step_context import StepContext

PART_AREA_SHARE = 0.7
"""Greatest area of an object that may be a part of a region, as a share of the region's."""

PART_HULL_SHARE = 0.5
"""Least share of such an object's outline inside the region's convex hull."""


def reidentify(context: StepContext) -> None:
    """Assign new regions to the missing objects that they show."""
    for new in context.seen():
        if new.confirmed:
            continue
        scored = [
            (_match_score(context, new, b), b) for b in context.missing() if b.id in context.tracks
        ]
        score, old = max(scored, key=lambda s: (s[0], -s[1].id), default=(0.0, new))
        if score <= 0.0:
            continue
        _take_region(context, new, old)
        taken = replace(old, region=new.region, last_seen=context.now)
        context.store(taken, merged_with=None, changed_at=context.now)


def parts_of(context: StepContext, whole: ObjectBelief) -> list[ObjectBelief]:
    """The confirmed objects that turn out to be parts of a new, larger region; sorted by id."""
    others = (b for b in context.seen() if b.confirmed and b.id not in context.recognised)
    return [b for b in others if _was_part(context, b, whole)]


def absorb_parts(context: StepContext, whole: ObjectBelief, parts: list[ObjectBelief]) -> None:
    """Let the oldest of the objects that are parts of a new region take it over.

    The others become tentative, and are suspected to be fragments until they have been clearly apart.

    Args:
        context: The step.
        whole: The tentative object of the new region; it is deleted.
        parts: From `parts_of`, at least one.
    """
    oldest = parts[0]
    _take_region(context, whole, oldest)
    context.tracks[oldest.id] = new_track(whole.region, context.now)
    context.mind = context.mind.with_objects(replace(oldest, region=whole.region))
    for other in parts[1:]:
        demote(context, other)


def _take_region(context: StepContext, new: ObjectBelief, old: ObjectBelief) -> None:
    """Transfer the region of a new object to an old one; the new one is deleted."""
    mind = delete_objects(context.mind, frozenset({new.id}))
    context.mind = reassign_region(mind, new.region.id, old.id)


def _was_part(context: StepContext, part: ObjectBelief, whole: ObjectBelief) -> bool:
    track, size = context.tracks[part.id], context.mind.frame_size
    if part.region.area > PART_AREA_SHARE * whole.region.area or sides_of(track.first_box, size):
        return False
    width, height = track.first_box[2:]
    x, y, w, h = expanded(track.first_box, round(max(width, height) / 2))
    stayed = x <= part.region.centroid[0] < x + w and y <= part.region.centroid[1] < y + h
    return stayed and share_within(part.region, whole.region) >= PART_HULL_SHARE


def _match_score(context: StepContext, new: ObjectBelief, old: ObjectBelief) -> float:
    """Match score of a new region and a missing object, 0 to 1; 0 for no match."""
    track = context.tracks[old.id]
    named = bool(new.candidates and old.candidates) and new.name == old.name
    if named and new.id in context.recognised and old.confidence > 0.9:
        return 1.0  # a taught name denotes a single object
    if track.merged_with is not None:
        iou = box_iou(new.region.bbox, old.region.bbox)
        return iou if iou > 0.3 else 0.0
    if (
        old.presence is Presence.HIDDEN
        and context.now - new.first_seen < context.settings.reidentify_s
    ):
        return 0.0
    coming = _share_border_side(context, new, old)
    ratio = new.region.area / max(track.reference_area, 1.0)
    if (ratio > 1.8 and not coming) or (old.presence is Presence.SEEN and ratio < 0.3):
        return 0.0
    # The search area grows with the time out of view.
    away = min(context.now - track.whole_at, 3.0)
    place = expanded(predicted_box(track, context.now), round(4 + 8 * away))
    area = new.region.bbox[2] * new.region.bbox[3]
    area = min(area, place[2] * place[3]) if coming else area
    within = box_intersection(new.region.bbox, place) / max(1, area)
    return min(within, 1.0) if within >= 0.5 and _names_agree(new, old) else 0.0


def _share_border_side(context: StepContext, new: ObjectBelief, old: ObjectBelief) -> bool:
    """Whether both reach the same side of the image, as while an object is coming in."""
    size = context.mind.frame_size
    return bool(border_sides(new.region, size) & border_sides(old.region, size))


def _names_agree(new: ObjectBelief, old: ObjectBelief) -> bool:
    """Whether two beliefs may be of one object: not when both have clear and different names."""
    if not new.candidates or not old.candidates:
        return True
    sure = min(new.confidence, old.confidence) > 0.9
    return not sure or new.name == old.name
