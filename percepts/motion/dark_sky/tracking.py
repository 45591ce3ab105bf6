"""Tracking of bodies in front of a dark sky: association with bright components, merges and splits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.body import (
    Corner,
    Point,
    SkyBody,
    sides_of,
    template_from_mask,
    template_overlap,
    updated_template,
)
from visup.percepts.motion.dark_sky.sky import Components, Mask
from visup.percepts.motion.dark_sky.splitting import ComponentShare, locate, split_component

MIN_OVERLAP = 0.25  # least overlap of a body and its component, as a share of the smaller
JOINED_GROWTH = 1.5
"""Growth of a component's area over its body's from which something else has joined."""
# When a body that touches others gets a new template: it is visible enough and has moved, or is larger.
VISIBLE_SHARE = 0.5  # least visible share of its template
MOVED_PX = 3  # least displacement along either axis since the template was taken, pixels
LARGER_SHARE = 1.03  # visible area, in areas of the template, that suffices by itself
MIN_VISIBLE_SHARE = 0.05  # visible share of its template below which a body is hidden
PART_SHARE = 0.5
"""Area, as a share of the largest body's, up to which a new body may be a part of it."""
NEW_S = 2.0  # age up to which a body has just come into view, seconds
ALIKE_VELOCITY = 0.5
"""Difference of velocities, as a share of the greater, up to which two move alike."""
MIN_SPEED = 5.0  # speed from which two bodies can be said to move alike, pixels per second
FORGOTTEN_S = 0.5  # how long the track of a body without a component is kept, seconds
HIDDEN_S = 10.0  # the same while another body may hide it

Bodies = tuple[SkyBody, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SkyFrame:
    """The measurements of one frame.

    Attributes:
        tone: (H, W) uint8, brightness of the frame.
        components: Its bright components.
        now: Time of the frame, seconds.
        ground: (x, y) displacement of the ground since the first frame, frame pixels.
    """

    tone: NDArray[np.uint8]
    components: Components
    now: float
    ground: Point


def track_bodies(bodies: Bodies, frame: SkyFrame, first: int) -> Bodies:
    """Update the tracks of bodies with a frame: continue, drop, and initiate tracks.

    Args:
        bodies: Tracks of the previous frame.
        frame: The frame.
        first: Key of the first new track; greater than all keys used before.

    Returns:
        The tracks, sorted by key.
    """
    component_of = [_component(b, frame) for b in bodies]
    now = frame.now
    tracks = [
        b
        for b, c in zip(bodies, component_of, strict=True)
        if not c and now - b.last_seen <= FORGOTTEN_S
    ]
    for component in sorted({*component_of} - {0}):
        tracks += _update_component(
            [b for b, c in zip(bodies, component_of, strict=True) if c == component],
            component,
            frame,
        )
    tracks = [b for b in tracks if now - b.last_seen <= HIDDEN_S]
    first_seen = now if bodies else -inf
    new = [c for c in range(1, len(frame.components.areas)) if c not in component_of]
    return (
        *sorted(tracks, key=_key),
        *(_initiate(first + i, c, frame, first_seen) for i, c in enumerate(new)),
    )


def _key(body: SkyBody) -> int:
    return body.key


def _component(body: SkyBody, frame: SkyFrame) -> int:
    """The component that a body belongs to: the one with the most common pixels; 0 for none.

    A body that the border cuts prefers components that the border cuts.
    """
    areas, labels = frame.components.areas, frame.components.labels
    inside, part = template_overlap(
        body.template, body.predicted_corner(frame.now), (labels.shape[0], labels.shape[1])
    )
    mine = labels[inside][body.template.mask[part] & frame.components.bright[inside]]
    both = np.bincount(mine, minlength=len(areas)).astype(float)
    both[0] = 0
    both[both <= MIN_OVERLAP * np.minimum(areas, body.area)] = 0
    if body.cut and both[frame.components.cut].any():
        both[~frame.components.cut] = 0
    return int(both.argmax())


def _update_component(
    bodies: Sequence[SkyBody], component: int, frame: SkyFrame
) -> Iterator[SkyBody]:
    """The updated tracks of the bodies that share a component; tracks of mere parts of others are dropped."""
    joined = _merge_parts(_without_fragments(bodies), frame.now)
    merged, bodies = len(joined) < len(bodies), joined
    one, cut = bodies[0], bool(frame.components.cut[component])
    union = frame.components.bright & (frame.components.labels == component)
    grows = frame.components.areas[component] > JOINED_GROWTH * one.area and not (one.cut and cut)
    if len(bodies) == 1 and (merged or not grows):
        yield _update_separate(one, union, frame)
        return
    places = [locate(frame.tone, b, frame.now) for b in bodies]
    shares = split_component(frame.tone, union, bodies, [at for at, _ in places])
    for body, (corner, fits), share in zip(bodies, places, shares, strict=True):
        yield _update_touching(body, corner, share, frame, fits=fits)


def _without_fragments(bodies: Sequence[SkyBody]) -> Sequence[SkyBody]:
    """The bodies without small ones that have never been alone for long: those are parts of the others."""
    least = PART_SHARE * max(b.area for b in bodies)
    return [b for b in bodies if b.id or b.cut or b.is_separate or b.area > least]


def _merge_parts(bodies: Sequence[SkyBody], now: float) -> Sequence[SkyBody]:
    """The bodies, with the parts of one body that comes into view merged into the largest part.

    Two bodies are parts of one if neither was ever seen whole, and both have just come into view or move
    alike.
    """
    kept: list[SkyBody] = []
    for body in sorted(bodies, key=lambda b: (not b.id, -b.area, b.key)):
        if not any(_are_parts_of_one(body, k, now) for k in kept):
            kept.append(body)
    return sorted(kept, key=_key)


def _are_parts_of_one(a: SkyBody, b: SkyBody, now: float) -> bool:
    if a.whole or b.whole:
        return False
    if max(now - a.first_seen, now - b.first_seen) < NEW_S:
        return True
    fast = max(float(np.hypot(*v)) for v in (a.velocity, b.velocity))
    apart = float(np.hypot(a.velocity[0] - b.velocity[0], a.velocity[1] - b.velocity[1]))
    return fast > MIN_SPEED and apart < ALIKE_VELOCITY * fast


def _update_separate(body: SkyBody, mask: Mask, frame: SkyFrame) -> SkyBody:
    """The track of a body that is a component of its own: its template is taken from this frame."""
    known = replace(body, visible=mask)
    return known.with_template(
        template_from_mask(mask, frame.tone), frame.ground, frame.now, alone=True
    )


def _update_touching(
    body: SkyBody, corner: Corner, share: ComponentShare, frame: SkyFrame, *, fits: bool
) -> SkyBody:
    """The track of a body that touches others: its template is kept, at least where the body is hidden.

    Args:
        body: The track of the previous frame.
        corner: (x, y) of its box, from `locate`.
        share: Its part of the component, from `split_component`.
        frame: The frame.
        fits: Whether its template matches at the corner.
    """
    if np.count_nonzero(share.mask) < MIN_VISIBLE_SHARE * body.area:
        return body
    known = replace(body, visible=share.mask, occludes=share.occludes)
    if body.cut or (fits and _needs_new_template(body, corner, int(np.count_nonzero(share.mask)))):
        template = updated_template(
            body.template, corner, share.mask, frame.tone, frame.components.bright
        )
        return known.with_template(template, frame.ground, frame.now, alone=False)
    moved = replace(known, alone=False)
    return moved.with_position(corner, frame.ground, frame.now, continues=not body.alone)


def _needs_new_template(body: SkyBody, corner: Corner, visible: int) -> bool:
    """Whether a body has moved since its template was taken, or is larger than that."""
    (x, y), seen = body.template.corner, visible / body.area
    way = max(abs(corner[0] - x), abs(corner[1] - y))
    return seen > LARGER_SHARE or (seen > VISIBLE_SHARE and way >= MOVED_PX)


def _initiate(key: int, component: int, frame: SkyFrame, first_seen: float) -> SkyBody:
    """The initial track of a component that belongs to no known body."""
    mask = frame.components.bright & (frame.components.labels == component)
    template = template_from_mask(mask, frame.tone)
    sides = sides_of(template, mask.shape)
    body = SkyBody(
        key,
        template,
        template.corner,
        mask,
        frame.now,
        alone=True,
        sides=sides,
        first_seen=first_seen,
    )
    return body.with_position(template.corner, frame.ground, frame.now, continues=False)
