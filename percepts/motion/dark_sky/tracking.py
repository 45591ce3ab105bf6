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
    look_at,
    overlap,
    renewed,
    sides_of,
)
from visup.percepts.motion.dark_sky.sky import Components, Mask
from visup.percepts.motion.dark_sky.splitting import Share, placed, split

SHARED = 0.25  # least overlap of a body and its component, as a share of the smaller
GROWS = 1.5  # growth of a component's area over its body's from which something else has joined
# When a body that touches others gets a new template: it is visible enough and has moved, or is larger.
VISIBLE = 0.5  # least visible share of its template
MOVED = 3  # least displacement along either axis since the template was taken, pixels
LARGER = 1.03  # visible area, in areas of the template, that suffices by itself
LEAST_SEEN = 0.05  # visible share of its template below which a body is hidden
PART = 0.5  # area, as a share of the largest body's, up to which a new body may be a part of it
COMING_S = 2.0  # age up to which a body has just come into view, seconds
SAME_WAY = 0.5  # difference of velocities, as a share of the greater, up to which two move alike
SLOWEST = 5.0  # speed from which two bodies can be said to move alike, pixels per second
FORGOTTEN_S = 0.5  # how long the track of a body without a component is kept, seconds
HIDDEN_S = 10.0  # the same while another body may hide it

Bodies = tuple[SkyBody, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SkyFrame:
    """The measurements of one frame.

    Attributes:
        tone: (H, W) uint8, brightness of the frame.
        found: Its bright components.
        now: Time of the frame, seconds.
        ground: (x, y) displacement of the ground since the first frame, frame pixels.
    """

    tone: NDArray[np.uint8]
    found: Components
    now: float
    ground: Point


def follow(bodies: Bodies, frame: SkyFrame, first: int) -> Bodies:
    """Update the tracks of bodies with a frame: continue, drop, and initiate tracks.

    Args:
        bodies: Tracks of the previous frame.
        frame: The frame.
        first: Key of the first new track; greater than all keys used before.

    Returns:
        The tracks, sorted by key.
    """
    within = [_component(b, frame) for b in bodies]
    now = frame.now
    out = [b for b, c in zip(bodies, within, strict=True) if not c and now - b.seen <= FORGOTTEN_S]
    for component in sorted({*within} - {0}):
        out += _followed(
            [b for b, c in zip(bodies, within, strict=True) if c == component], component, frame
        )
    out = [b for b in out if now - b.seen <= HIDDEN_S]
    born = now if bodies else -inf
    new = [c for c in range(1, len(frame.found.areas)) if c not in within]
    return (*sorted(out, key=_key), *(_new(first + i, c, frame, born) for i, c in enumerate(new)))


def _key(body: SkyBody) -> int:
    return body.key


def _component(body: SkyBody, frame: SkyFrame) -> int:
    """The component that a body belongs to: the one with the most common pixels; 0 for none.

    A body that the border cuts prefers components that the border cuts.
    """
    areas, labels = frame.found.areas, frame.found.labels
    inside, part = overlap(body.look, body.expected(frame.now), (labels.shape[0], labels.shape[1]))
    mine = labels[inside][body.look.mask[part] & frame.found.bright[inside]]
    both = np.bincount(mine, minlength=len(areas)).astype(float)
    both[0] = 0
    both[both <= SHARED * np.minimum(areas, body.area)] = 0
    if body.cut and both[frame.found.cut].any():
        both[~frame.found.cut] = 0
    return int(both.argmax())


def _followed(bodies: Sequence[SkyBody], component: int, frame: SkyFrame) -> Iterator[SkyBody]:
    """The updated tracks of the bodies that share a component; tracks of mere parts of others are dropped."""
    joined = _one_of_parts(_settled(bodies), frame.now)
    merged, bodies = len(joined) < len(bodies), joined
    one, cut = bodies[0], bool(frame.found.cut[component])
    union = frame.found.bright & (frame.found.labels == component)
    grows = frame.found.areas[component] > GROWS * one.area and not (one.cut and cut)
    if len(bodies) == 1 and (merged or not grows):
        yield _alone(one, union, frame)
        return
    places = [placed(frame.tone, b, frame.now) for b in bodies]
    shares = split(frame.tone, union, bodies, [at for at, _ in places])
    for body, (corner, fits), share in zip(bodies, places, shares, strict=True):
        yield _touching(body, corner, share, frame, fits=fits)


def _settled(bodies: Sequence[SkyBody]) -> Sequence[SkyBody]:
    """The bodies without small ones that have never been alone for long: those are parts of the others."""
    least = PART * max(b.area for b in bodies)
    return [b for b in bodies if b.id or b.cut or b.settled or b.area > least]


def _one_of_parts(bodies: Sequence[SkyBody], now: float) -> Sequence[SkyBody]:
    """The bodies, with the parts of one body that comes into view merged into the largest part.

    Two bodies are parts of one if neither was ever seen whole, and both have just come into view or move
    alike.
    """
    kept: list[SkyBody] = []
    for body in sorted(bodies, key=lambda b: (not b.id, -b.area, b.key)):
        if not any(_parts_of_one(body, k, now) for k in kept):
            kept.append(body)
    return sorted(kept, key=_key)


def _parts_of_one(a: SkyBody, b: SkyBody, now: float) -> bool:
    if a.whole or b.whole:
        return False
    if max(now - a.born, now - b.born) < COMING_S:
        return True
    fast = max(float(np.hypot(*v)) for v in (a.velocity, b.velocity))
    apart = float(np.hypot(a.velocity[0] - b.velocity[0], a.velocity[1] - b.velocity[1]))
    return fast > SLOWEST and apart < SAME_WAY * fast


def _alone(body: SkyBody, mask: Mask, frame: SkyFrame) -> SkyBody:
    """The track of a body that is a component of its own: its template is taken from this frame."""
    known = replace(body, visible=mask)
    return known.looking(look_at(mask, frame.tone), frame.ground, frame.now, alone=True)


def _touching(
    body: SkyBody, corner: Corner, share: Share, frame: SkyFrame, *, fits: bool
) -> SkyBody:
    """The track of a body that touches others: its template is kept, at least where the body is hidden.

    Args:
        body: The track of the previous frame.
        corner: (x, y) of its box, from `placed`.
        share: Its part of the component, from `split`.
        frame: The frame.
        fits: Whether its template matches at the corner.
    """
    if np.count_nonzero(share.mask) < LEAST_SEEN * body.area:
        return body
    known = replace(body, visible=share.mask, covers=share.covers)
    if body.cut or (fits and _changed(body, corner, int(np.count_nonzero(share.mask)))):
        look = renewed(body.look, corner, share.mask, frame.tone, frame.found.bright)
        return known.looking(look, frame.ground, frame.now, alone=False)
    moved = replace(known, alone=False)
    return moved.moved_to(corner, frame.ground, frame.now, follows=not body.alone)


def _changed(body: SkyBody, corner: Corner, visible: int) -> bool:
    """Whether a body has moved since its template was taken, or is larger than that."""
    (x, y), seen = body.look.corner, visible / body.area
    way = max(abs(corner[0] - x), abs(corner[1] - y))
    return seen > LARGER or (seen > VISIBLE and way >= MOVED)


def _new(key: int, component: int, frame: SkyFrame, born: float) -> SkyBody:
    """The initial track of a component that belongs to no known body."""
    mask = frame.found.bright & (frame.found.labels == component)
    look = look_at(mask, frame.tone)
    sides = sides_of(look, mask.shape)
    body = SkyBody(key, look, look.corner, mask, frame.now, alone=True, sides=sides, born=born)
    return body.moved_to(look.corner, frame.ground, frame.now, follows=False)
