"""Certainty that a region is an object of its own, and that its identity is known.

Motion segmentation splits machines and includes shadows. A small, hardly visible region, or one close to a
larger one, may be a part of that; alarms that call for a person, or end a task, require more.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import ObjectBelief, Region
from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.geometry.regions import Box, image_diagonal
from visup.rules.predicates._snapshot_jit import GAP
from visup.rules.predicates.motion import moving
from visup.rules.predicates.roles import is_actor
from visup.rules.predicates.snapshot import Codes, Snapshot, code
from visup.rules.presence.fragments import FragmentSettings
from visup.rules.presence.object_tracks import presence_memory
from visup.rules.presence.settings import PresenceSettings
from visup.rules.wording.sentences import is_of_kind

FRAGMENT_SETTINGS = FragmentSettings()
MIN_SHARE = 2 * PresenceSettings().least_share
"""Least share of the image of an object of its own, unless it is far away."""
MIN_CONFIDENCE = 0.5
START_S = PresenceSettings().start_s
ENTRY_DISTANCE = 0.5
"""Greatest distance from the border of the first sighting of an object that came over it, in its sizes."""
LINK_SPEED = 2.0
"""Greatest speed of a part of a machine, in speeds of the next part on the way to the actor."""
LINK_DISTANCE = 0.5
"""Greatest gap between two visible parts of a machine, in sizes of the part: what is between them may not be
seen."""
ENTRY_ADVANCE = 0.25
"""How far its far side must have moved away from that border since, in its sizes."""
MIN_VISIBLE = 0.5
"""Least visible share of the area of an object that came in."""
KEEP_OUT = "keep_out"
"""Prefix of the names of zones forbidden to all."""


def standalone(facts: Snapshot) -> Codes:
    """Whether an object is certainly one of its own: not a speck, well visible, away from larger ones.

    Nor does it move as one with a larger one.

    An object cut by the image border may be attached to something outside, unless it is identified: it
    may be an arm whose hand is known.
    """
    beliefs = facts.beliefs
    if not beliefs:
        return facts.codes_of_ids(())
    width, height = facts.mind.frame_size
    area = np.array([b.region.area for b in beliefs], dtype=float)
    certain = np.array([b.region.confidence for b in beliefs]) >= MIN_CONFIDENCE
    certain &= area >= MIN_SHARE * width * height
    certain &= (whole(facts) == YES) | (identified(facts) == YES)
    clearance = np.maximum(
        FRAGMENT_SETTINGS.apart * image_diagonal(facts.mind.frame_size),
        FRAGMENT_SETTINGS.apart_size * np.sqrt(area),
    )
    gap = facts.pair_intervals(GAP)
    near_others = np.isfinite(gap[1]) & (gap[0] <= clearance[:, None])
    larger = area[:, None] <= FRAGMENT_SETTINGS.part * area[None]
    near_others |= facts.relation_codes("moving_together") == YES
    separate = certain & ~(near_others & larger).any(axis=1)
    return facts.codes_of_ids(
        {
            b.id
            for b, standing_alone in zip(beliefs, separate.tolist(), strict=True)
            if standing_alone
        }
    )


def near_moving_actor(facts: Snapshot) -> Codes:
    """Whether an object is near an actor that moves, or near another object that is, and not much faster.

    It may be a link of the machine that moves the actor: an upper arm, whose forearm may not be seen. A link
    is seldom faster than what it moves; who passes by may be.
    """
    beliefs = facts.beliefs
    if not beliefs:
        return facts.codes_of_ids(())
    reach = LINK_DISTANCE * np.array([max(b.region.bbox[2:]) for b in beliefs], dtype=float)
    gap = facts.pair_intervals(GAP)
    near = np.isfinite(gap[1]) & (gap[0] <= reach[:, None])
    speed = facts.one("speed")
    as_slow = speed[:, None] <= LINK_SPEED * speed
    start = (is_actor(facts) == YES) & (moving(facts) == YES)
    near_it = _reached((near | near.T) & as_slow, start).tolist()
    return facts.codes_of_ids(
        {b.id for b, is_near in zip(beliefs, near_it, strict=True) if is_near}
    )


def _reached(near: NDArray[np.bool_], start: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(N,) bool: objects that are reached from the first ones by steps between neighbours.

    Args:
        near: (N, N) bool, whether each object is reached from each other one.
        start: (N,) bool, the first objects.
    """
    reached, further = start, start
    while further.any():
        further = near[:, further].any(axis=1) & ~reached
        reached = reached | further
    return reached


def whole(facts: Snapshot) -> Codes:
    """Whether an object is clear of the image border."""

    def clear(region: Region) -> bool:
        return not region.cut and _is_inside(region.bbox, facts.mind.frame_size)

    return facts.codes_of_objects(lambda b: code(clear(b.region)))


def _is_inside(box: Box, size: tuple[int, int]) -> bool:
    """Whether a box is clear of the border of an image of that (width, height)."""
    x, y, w, h = box
    return x > 0 and y > 0 and x + w < size[0] and y + h < size[1]


def came_in(facts: Snapshot) -> Codes:
    """Whether an object came over the border of the image, by where it was first seen and has gone since.

    An object that starts inside the picture was there before, is attached to something that was, or is its
    shadow. A fast one is first seen a little inside. An object that is first seen at the border and stays
    there may be attached to something outside, even if its region no longer reaches the border. And a
    region that leaps, or shrinks to a remainder of itself, is hardly one object. What was whole when the
    video began was there before.
    """
    memory, size = presence_memory(facts.mind), facts.mind.frame_size
    begun = (memory.start or 0.0) + START_S

    def evaluate(b: ObjectBelief) -> int:
        if b.id not in memory.tracks:
            return MAYBE
        track = memory.tracks[b.id]
        mostly_visible = track.visible_share >= MIN_VISIBLE
        if b.first_seen <= begun and _is_inside(track.first_box, size):
            return NO
        return code(mostly_visible and _crossed_border(track.coherent_box, b.region.bbox, size))

    return facts.codes_of_objects(evaluate)


def _crossed_border(first: Box, now: Box, size: tuple[int, int]) -> bool:
    x, y, w, h = first
    left, top, width, height = now
    gaps = (x, y, size[0] - x - w, size[1] - y - h)
    advances = (left + width - x - w, top + height - y - h, x - left, y - top)
    near, least = ENTRY_DISTANCE * max(w, h), ENTRY_ADVANCE * max(width, height)
    return any(g <= near and a >= least for g, a in zip(gaps, advances, strict=True))


def identified(facts: Snapshot) -> Codes:
    """Whether an object is likelier one of the models than none of them, or has been named."""

    def evaluate(b: ObjectBelief) -> int:
        likely = bool(b.candidates) and b.candidates[0].confidence > b.unknown
        return code(likely or b.id in facts.mind.answers)

    return facts.codes_of_objects(evaluate)


def of_kind(facts: Snapshot) -> Codes:
    """Whether only the class of an object is known: from a detector, without a role in a task."""
    return facts.codes_of_objects(lambda b: code(is_of_kind(facts.mind, b.id)))


def at_home(facts: Snapshot) -> Codes:
    """Whether an object was in a forbidden zone when the video began: the zone is then its home."""
    zones = [z.polygon for z in facts.mind.zones if z.name.startswith(KEEP_OUT)]
    memory = presence_memory(facts.mind)
    if not zones or memory.start is None:
        return facts.codes_of_ids(())
    early = [b for b in facts.beliefs if b.first_seen - memory.start <= START_S]
    boxes = {b.id: memory.tracks[b.id].first_box for b in early if b.id in memory.tracks}
    return facts.codes_of_ids(
        {i for i, box in boxes.items() if any(_begins_in(box, z) for z in zones)}
    )


def _begins_in(box: tuple[int, int, int, int], polygon: Sequence[tuple[float, float]]) -> bool:
    x, y, w, h = box
    corners = np.asarray(polygon, dtype=np.float32).reshape(-1, 1, 2)
    return cv2.pointPolygonTest(corners, (x + w / 2, y + h / 2), measureDist=False) >= 0
