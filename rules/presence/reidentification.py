"""Objects that are given another region: found again, or seen whole after a part of them.

A new region where a missing object should be is that object, which keeps its id. And where a
larger region shows itself round an object that came over no border and never left its place, only
a part of that object was seen before: it grows into the larger region.
"""

from __future__ import annotations

from dataclasses import replace

from visup.agent import ObjectBelief, Presence
from visup.rules.geometry.regions import box_intersection, box_iou, expanded
from visup.rules.presence.association import delete_objects, reassign_region
from visup.rules.presence.fragments import share_within
from visup.rules.presence.object_tracks import border_sides, new_track, predicted_box, sides_of
from visup.rules.presence.step_context import StepContext

PART = 0.7
"""Share of a region's area up to which an object may have been a part of it."""

WITHIN = 0.5
"""Share of the object's outline inside the hull of the region by which it is within it."""


def reidentify(work: StepContext) -> None:
    """Give new regions to the missing objects that they show."""
    for new in work.seen():
        if new.confirmed:
            continue
        scored = [(_match_score(work, new, b), b) for b in work.missing() if b.id in work.of]
        score, old = max(scored, key=lambda s: (s[0], -s[1].id), default=(0.0, new))
        if score <= 0.0:
            continue
        work.mind = delete_objects(work.mind, frozenset({new.id}))
        work.mind = reassign_region(work.mind, new.region.id, old.id)
        taken = replace(old, region=new.region, last_seen=work.now)
        work.put(taken, merged_with=None, changed_at=work.now)


def absorb_parts(work: StepContext, whole: ObjectBelief) -> bool:
    """Whether known objects were parts of a new region; the oldest of them then becomes it.

    The others count as parts from now on: they have to show that they are more, as any fragment.
    """
    parts = [b for b in work.seen() if b.confirmed and _was_part(work, b, whole)]
    if not parts:
        return False
    work.mind = delete_objects(work.mind, frozenset({whole.id}))
    work.mind = reassign_region(work.mind, whole.region.id, parts[0].id)
    work.of[parts[0].id] = replace(new_track(whole.region, work.now), told="seen")
    work.mind = work.mind.with_objects(replace(parts[0], region=whole.region))
    for other in parts[1:]:
        work.put(replace(other, confirmed=False), told="")
    return True


def _was_part(work: StepContext, part: ObjectBelief, whole: ObjectBelief) -> bool:
    track, size = work.of[part.id], work.mind.frame_size
    if part.region.area > PART * whole.region.area or sides_of(track.first, size):
        return False
    width, height = track.first[2:]
    x, y, w, h = expanded(track.first, round(max(width, height) / 2))
    stayed = x <= part.region.centroid[0] < x + w and y <= part.region.centroid[1] < y + h
    return stayed and share_within(part.region, whole.region) >= WITHIN


def _match_score(work: StepContext, new: ObjectBelief, old: ObjectBelief) -> float:
    """How well a new region suits a missing object; 0 when it does not."""
    track = work.of[old.id]
    if track.merged_with is not None:
        iou = box_iou(new.region.bbox, old.region.bbox)
        return iou if iou > 0.3 else 0.0
    if old.presence is Presence.HIDDEN and work.now - new.first_seen < work.settings.adopt_s:
        return 0.0
    coming = _share_border_side(work, new, old)
    ratio = new.region.area / max(track.reference, 1.0)
    if (ratio > 1.8 and not coming) or (track.told == "seen" and ratio < 0.3):
        return 0.0
    # The longer it was out of sight, the less is known of where it is.
    away = min(work.now - track.whole_at, 3.0)
    place = expanded(predicted_box(track, work.now), round(4 + 8 * away))
    area = new.region.bbox[2] * new.region.bbox[3]
    area = min(area, place[2] * place[3]) if coming else area
    within = box_intersection(new.region.bbox, place) / max(1, area)
    if within < 0.5 or not _names_agree(new, old):
        return 0.0
    return min(within, 1.0)


def _share_border_side(work: StepContext, new: ObjectBelief, old: ObjectBelief) -> bool:
    """Whether both are cut by one side of the image: of what comes in, ever more shows."""
    size = work.mind.frame_size
    return bool(border_sides(new.region, size) & border_sides(old.region, size))


def _names_agree(new: ObjectBelief, old: ObjectBelief) -> bool:
    """Whether two beliefs may be of one thing: not when both have a clear and different name."""
    if not new.candidates or not old.candidates:
        return True
    sure = min(new.confidence, old.confidence) > 0.9
    return not sure or new.name == old.name
