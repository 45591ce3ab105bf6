"""Following bodies before a dark sky from frame to frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.body import (
    Corner,
    Look,
    Point,
    SkyBody,
    centre_of,
    look_at,
    overlap,
    renewed,
)
from visup.percepts.motion.dark_sky.sky import Components, Mask
from visup.percepts.motion.dark_sky.splitting import placed, split

SHARED = 0.25  # share of the smaller of a body and a component from which they belong together
GROWS = 1.5  # growth of an area from one frame to the next from which something else has joined
VISIBLE = (
    0.5  # share of its look that must be visible for a body to be looked at anew beside others
)
MOVED = 3  # pixels, along either axis, from which it is
LARGER = 1.03  # the same, as a growth of its area
SETTLED_S = 1.0  # how long a body must have been alone not to be a part of what it touches, seconds
FORGOTTEN_S = 0.5  # how long a body that is not seen is looked for, seconds

Bodies = tuple[SkyBody, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SkyFrame:
    """What bodies are followed in.

    Attributes:
        tone: (H, W) uint8.
        found: Its bright components.
        now: Time, seconds.
        ground: (x, y) way of the ground since the first frame, frame pixels.
    """

    tone: NDArray[np.uint8]
    found: Components
    now: float
    ground: Point


def follow(bodies: Bodies, frame: SkyFrame) -> Bodies:
    """The bodies in the next frame, by key: those that were followed, and new ones.

    Args:
        bodies: Those of the frame before.
        frame: The frame.
    """
    within = [_component(b, frame) for b in bodies]
    out = [b for b, c in zip(bodies, within, strict=True) if not c]
    for component in sorted({*within} - {0}):
        out += _followed(
            [b for b, c in zip(bodies, within, strict=True) if c == component], component, frame
        )
    out = [b for b in out if frame.now - b.seen <= FORGOTTEN_S]
    first = max((b.key for b in bodies), default=0) + 1
    new = [c for c in range(1, len(frame.found.areas)) if c not in within]
    return (*sorted(out, key=_key), *(_new(first + i, c, frame) for i, c in enumerate(new)))


def _key(body: SkyBody) -> int:
    return body.key


def _component(body: SkyBody, frame: SkyFrame) -> int:
    """The component that a body belongs to; 0 for none.

    It shares most with it; what the border cuts belongs to one that the border cuts, if there is any.
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
    """Bodies that share a component, in this frame."""
    bodies = _settled(bodies)
    one, cut = bodies[0], bool(frame.found.cut[component])
    union = frame.found.bright & (frame.found.labels == component)
    grows = frame.found.areas[component] > GROWS * one.area and not (one.cut and cut)
    if len(bodies) == 1 and not grows:
        yield _alone(one, union, cut, frame)
        return
    places = [placed(frame.tone, b, frame.now) for b in bodies]
    masks = split(frame.tone, union, bodies, [at for at, _ in places])
    for body, (corner, fits) in zip(bodies, places, strict=True):
        mask = masks[body.key]
        yield _touching(body, corner, mask, frame, fits=fits) if mask.any() else body


def _settled(bodies: Sequence[SkyBody]) -> Sequence[SkyBody]:
    """The bodies without those that were alone too shortly, which are parts of the others."""
    return [b for b in bodies if b.id or b.cut or b.span >= SETTLED_S] or bodies[:1]


def _alone(body: SkyBody, mask: Mask, cut: bool, frame: SkyFrame) -> SkyBody:
    """A body that is a component of its own: it looks as it looks now."""
    look = look_at(mask, frame.tone)
    moved = body.moved_to(frame.now, centre_of(mask), frame.ground, alone=True)
    return replace(moved, look=look, corner=look.corner, visible=mask, cut=cut)


def _touching(body: SkyBody, corner: Corner, mask: Mask, frame: SkyFrame, *, fits: bool) -> SkyBody:
    """A body that touches others.

    What the border cuts looks as it looks now; another one as well, but where it is hidden as it did before.
    """
    centre = centre_of(body.look.mask, corner)
    moved = body.moved_to(frame.now, centre, frame.ground, alone=False)
    if body.cut:
        look = look_at(mask, frame.tone)
        cut = _at_border(look, mask.shape)
        return replace(moved, look=look, corner=look.corner, visible=mask, cut=cut)
    if fits and _changed(body, corner, np.count_nonzero(mask)):
        look = renewed(body.look, corner, mask, frame.tone, frame.found.bright)
        return replace(moved, look=look, corner=look.corner, visible=mask)
    return replace(moved, corner=corner, visible=mask)


def _changed(body: SkyBody, corner: Corner, visible: int) -> bool:
    """Whether a body is at another place than when it was looked at, or larger."""
    (x, y), seen = body.look.corner, visible / body.area
    way = max(abs(corner[0] - x), abs(corner[1] - y))
    return seen > LARGER or (seen > VISIBLE and way >= MOVED)


def _at_border(look: Look, shape: tuple[int, ...]) -> bool:
    (x, y), (h, w) = look.corner, look.mask.shape
    return x == 0 or y == 0 or x + w == shape[1] or y + h == shape[0]


def _new(key: int, component: int, frame: SkyFrame) -> SkyBody:
    """A body that was not known."""
    mask = frame.found.bright & (frame.found.labels == component)
    look = look_at(mask, frame.tone)
    cut = bool(frame.found.cut[component])
    body = SkyBody(key, look, look.corner, mask, frame.now, alone=True, cut=cut)
    return body.moved_to(frame.now, centre_of(mask), frame.ground, alone=True)
