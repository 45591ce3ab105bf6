"""Reporting: one region for each body, with the body's outline in place of those of its moving regions."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from visup.agent import Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.body import SkyBody
from visup.percepts.motion.dark_sky.sky import Mask, joining_gap, square
from visup.percepts.motion.dark_sky.tracking import Bodies
from visup.percepts.motion.outlines.region_outline import clean_mask, describe_mask
from visup.percepts.motion.tracks.id_allocator import IdAllocator

MIN_OVERLAP = 0.5
"""Share of a region's bright pixels that must be a body's for the region to belong to it."""
BRIGHT = 0.3  # share of a region that must be brighter than the sky
COVERED = 0.6  # share of a body cut by the border that must move; otherwise it is background
SIGMA = 1.0  # standard deviation of a velocity measured on a body's path, pixels per second
CONFIDENCE = 0.9  # confidence in a body without a moving region

Regions = tuple[Region, ...]


def bodies_with_ids(
    bodies: Bodies, members: Sequence[Sequence[Region]], ids: IdAllocator, diagonal: float
) -> Bodies:
    """Give public ids to the bodies to be reported: those that move, have drifted, or stand alone.

    Args:
        bodies: The bodies.
        members: The moving regions of each, from `regions_of_bodies`; a body takes over the id of one.
        ids: Allocates new ids.
        diagonal: Of the image, frame pixels.
    """
    used = {b.id for b in bodies}
    out = []
    for body, regions in zip(bodies, members, strict=True):
        if body.id == 0 and (regions or body.has_drifted(diagonal) or body.is_fully_visible):
            free = [r.id for r in regions if r.id not in used]
            body = replace(body, id=min(free, default=0) or ids.new())
            used.add(body.id)
        out.append(body)
    return tuple(out)


def regions_of_bodies(
    bodies: Bodies, regions: Regions, bright: Mask, now: float
) -> list[list[Region]]:
    """For each body, the moving regions that lie mainly on it.

    Args:
        bodies: The bodies.
        regions: The moving regions.
        bright: (H, W) bool, pixels brighter than the sky.
        now: Time, seconds; a body that was not seen in this frame has none.
    """
    found: list[list[Region]] = [[] for _ in bodies]
    for region in regions:
        x, y, w, h = region.bbox
        part = np.s_[y : y + h, x : x + w]
        mine = region.mask & bright[part]
        lit = np.count_nonzero(mine)
        if lit < BRIGHT * region.area:
            continue
        for k, body in enumerate(bodies):
            if (
                body.last_seen == now
                and np.count_nonzero(mine & body.visible[part]) > MIN_OVERLAP * lit
            ):
                found[k].append(region)
    return [_unless_ground(b, some) for b, some in zip(bodies, found, strict=True)]


def _unless_ground(body: SkyBody, regions: list[Region]) -> list[Region]:
    """The regions of a body; none if the border cuts it and most of it rests, as the Earth's limb does."""
    if not body.cut or not regions:
        return regions
    covered = np.zeros(body.visible.shape, bool)
    for r in regions:
        x, y, w, h = r.bbox
        covered[y : y + h, x : x + w] |= r.mask
    enough = COVERED * np.count_nonzero(body.visible)
    return regions if np.count_nonzero(covered & body.visible) > enough else []


def reported_regions(
    bodies: Bodies, members: Sequence[Sequence[Region]], regions: Regions, now: float
) -> Regions:
    """The regions to report: one for each body with an id, and the moving ones that are not of a body; by id.

    A body with an id is reported even at rest, and even if the border cuts it: it got the id when most of it
    moved, or while it was in full view, so it is not background. This is an approximation: background that
    once seemed to move as a whole would be reported from then on, too.

    Args:
        bodies: The bodies, from `bodies_with_ids`.
        members: The moving regions of each, from `regions_of_bodies`.
        regions: All moving regions.
        now: Time of the frame, seconds.
    """
    kept = [(b, m) for b, m in zip(bodies, members, strict=True) if b.id and b.last_seen == now]
    taken = {r.id for _, m in kept for r in m} | {b.id for b, _ in kept}
    others = [r for r in regions if r.id not in taken]
    return tuple(sorted([*others, *(_region(b, m) for b, m in kept)], key=lambda r: r.id))


def _region(body: SkyBody, members: Sequence[Region]) -> Region:
    height, width = body.visible.shape
    gap = joining_gap(body.visible.shape)
    x, y, w, h = cv2.boundingRect(body.visible.view(np.uint8))
    left, top = max(x - gap, 0), max(y - gap, 0)
    around = np.ascontiguousarray(body.visible[top : y + h + gap, left : x + w + gap])
    outline = describe_mask(_whole(around, gap), (left, top), (width, height))
    if not members:
        return outline.region(body.id, body.velocity, SIGMA, CONFIDENCE)
    main = replace(outline.applied_to(max(members, key=lambda r: r.area)), id=body.id)
    # In full view, the velocity measured on the path is the most accurate one. When the border cuts the body,
    # the path is that of its end, which may bend.
    if body.cut or not body.has_speed:
        return main
    return replace(main, velocity=body.velocity, velocity_sigma=SIGMA)


def _whole(mask: Mask, gap: int) -> Mask:
    """A mask without small holes, and without gaps of up to `gap` pixels between its parts."""
    clean = clean_mask(mask, 1)
    if clean is None:
        return mask
    if cv2.connectedComponents(clean.view(np.uint8), connectivity=4)[0] <= 2:
        return clean
    joined = cv2.morphologyEx(clean.view(np.uint8), cv2.MORPH_CLOSE, square(gap))
    found = clean_mask(np.asarray(joined, np.uint8).view(bool), 1)
    return clean if found is None else found
