"""Parts of a taught object that are joined outside of the image: an arm whose elbow is out of view.

Motion segmentation reports the other part as a region of its own. It belongs to the object if the same
border of the image cuts both, no farther apart than they are long, and if it has the object's colours. The
price: of two bodies of the same colours that leave the image side by side, one of them not taught, the other
is taken for a part of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from visup.agent import Region
from visup.agent.model.fast_replace import replace
from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.moving_body import colour_similarity
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.output.unexplained_regions import moving_body
from visup.percepts.motion.outlines.region_outline import describe_mask

MIN_EXCESS = 0.3  # least excess of the object's colours in the region over those around it
MIN_SHARED = 0.3  # least intersection of the colour histograms of region and object
MIN_SUPPORT = 3  # frames in which a region must appear to belong to an object
MAX_SUPPORT = 2 * MIN_SUPPORT  # most such frames that are counted

Interval = tuple[int, int]
Support = Mapping[tuple[int, int], int]
"""(id of an object, id of a region) -> frames in which the region appeared to belong to the object, less
those in which it did not."""


def update_support(
    before: Support,
    objects: Sequence[tuple[Region, Appearance]],
    others: Sequence[Region],
    scene: Scene,
) -> dict[tuple[int, int], int]:
    """How often each region has appeared to belong to each object.

    Args:
        before: The same at the last frame.
        objects: The objects in view with their appearances.
        others: The other regions.
        scene: The frame.
    """
    found = {pair: count for pair, count in before.items() if any(r.id == pair[1] for r in others)}
    for region in others:
        for taught, appearance in objects:
            if not _meet_outside(taught, region, scene):
                continue
            pair = taught.id, region.id
            alike = _has_colours_of(appearance, region, scene)
            count = min(found.get(pair, 0) + (1 if alike else -1), MAX_SUPPORT)
            if count > 0:
                found[pair] = count
            else:
                found.pop(pair, None)
    return found


def joined(support: Support) -> list[tuple[int, int]]:
    """The pairs of an object and a region that belong together, the best supported last."""
    sure = ((count, pair) for pair, count in support.items() if count >= MIN_SUPPORT)
    return [pair for _, pair in sorted(sure)]


def cut_ends(region: Region, size: tuple[int, int]) -> dict[str, Interval]:
    """Where the border of the image cuts a region.

    Args:
        region: Any region.
        size: (width, height) of the frame.

    Returns:
        For each side that it touches the first and last pixel along that side.
    """
    if not region.cut:
        return {}
    x, y, w, h = region.bbox
    mask = region.mask
    sides = {
        "top": (y <= 0, mask[0], x),
        "bottom": (y + h >= size[1], mask[-1], x),
        "left": (x <= 0, mask[:, 0], y),
        "right": (x + w >= size[0], mask[:, -1], y),
    }
    return {
        side: (int(line.argmax()) + at, len(line) - 1 - int(line[::-1].argmax()) + at)
        for side, (cut, line, at) in sides.items()
        if cut
    }


def with_parts(taught: Region, parts: Iterable[Region], size: tuple[int, int]) -> Region:
    """An object and its severed parts as one region.

    Args:
        taught: The object's own region.
        parts: Its other parts.
        size: (width, height) of the frame.

    Returns:
        The region, with the mean velocity of its pixels; without an affine motion, since the parts turn
        about joints.
    """
    regions = [taught, *parts]
    if len(regions) == 1:
        return taught
    boxes = np.array([r.bbox for r in regions])
    left, top = boxes[:, :2].min(axis=0).tolist()
    right, bottom = (boxes[:, :2] + boxes[:, 2:]).max(axis=0).tolist()
    mask = np.zeros((bottom - top, right - left), dtype=bool)
    for r in regions:
        x, y, w, h = r.bbox
        mask[y - top : y - top + h, x - left : x - left + w] |= r.mask
    areas = [r.area for r in regions]
    vx, vy = np.average([r.velocity for r in regions], axis=0, weights=areas).tolist()
    sigma = max(r.velocity_sigma for r in regions)
    whole = describe_mask(mask, (left, top), size).applied_to(taught)
    return replace(whole, velocity=(vx, vy), velocity_sigma=sigma, motion=None)


def _meet_outside(taught: Region, region: Region, scene: Scene) -> bool:
    """Whether the same border cuts both, no farther apart along it than the longer one is long."""
    reach = max(*taught.bbox[2:], *region.bbox[2:])
    ends, other = cut_ends(region, scene.frame_size), cut_ends(taught, scene.frame_size)
    gaps = [
        max(ends[side][0] - other[side][1], other[side][0] - ends[side][1])
        for side in ends.keys() & other.keys()
    ]
    return bool(gaps) and min(gaps) <= reach


def _has_colours_of(appearance: Appearance, region: Region, scene: Scene) -> bool:
    excess, shared = colour_similarity(scene, appearance, moving_body(region, scene).blob)
    return excess > MIN_EXCESS and shared > MIN_SHARED
