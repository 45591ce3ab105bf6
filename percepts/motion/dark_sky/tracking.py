"""Following bodies before a dark sky from frame to frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.dark_sky.body import Point, SkyBody, centre_of, look_at, pasted
from visup.percepts.motion.dark_sky.sky import Components, Mask
from visup.percepts.motion.dark_sky.splitting import placed, split

SHARED = 0.25  # share of the smaller of a body and a component from which they belong together
GROWS = 1.5  # growth of an area from one frame to the next from which something else has joined
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
    linked = _links(bodies, frame)
    out = [b for k, b in enumerate(bodies) if not linked[k].any()]
    for members, components in _groups(linked):
        union = frame.found.bright & np.isin(frame.found.labels, components)
        cut = bool(frame.found.cut[components].any())
        out += _followed([bodies[k] for k in members], union, cut, frame)
    out = [b for b in out if frame.now - b.seen <= FORGOTTEN_S]
    last = max((b.key for b in bodies), default=0)
    new = [c for c in range(1, len(frame.found.areas)) if not linked[:, c].any()]
    return (*sorted(out, key=_key), *(_new(last + 1 + i, c, frame) for i, c in enumerate(new)))


def _key(body: SkyBody) -> int:
    return body.key


def _links(bodies: Bodies, frame: SkyFrame) -> Mask:
    """(bodies, components + 1) bool: what belongs together."""
    areas, labels = frame.found.areas, frame.found.labels
    linked = np.zeros((len(bodies), len(areas)), bool)
    for k, body in enumerate(bodies):
        expected = pasted(body.look, body.expected(frame.now), (labels.shape[0], labels.shape[1]))
        both = np.bincount(labels[expected & frame.found.bright], minlength=len(areas))
        linked[k] = both > SHARED * np.minimum(areas, body.area)
    linked[:, 0] = False
    return linked


def _groups(linked: Mask) -> Iterator[tuple[list[int], list[int]]]:
    """Bodies and components that hang together, at least one of each."""
    left = set(np.flatnonzero(linked.any(axis=1)).tolist())
    while left:
        members, known = {left.pop()}, 0
        while len(members) > known:
            known = len(members)
            components = linked[sorted(members)].any(axis=0)
            members |= set(np.flatnonzero(linked[:, components].any(axis=1)).tolist())
        left -= members
        yield sorted(members), np.flatnonzero(components).tolist()


def _followed(
    bodies: Sequence[SkyBody], union: Mask, cut: bool, frame: SkyFrame
) -> Iterator[SkyBody]:
    """Bodies that share some components, in this frame."""
    one = bodies[0]
    grows = np.count_nonzero(union) > GROWS * one.area and not (one.cut and cut)
    if len(bodies) == 1 and not grows:
        yield _alone(one, union, cut, frame)
        return
    corners = [placed(frame.tone, b, frame.now) for b in bodies]
    masks = split(frame.tone, union, bodies, corners)
    for body, corner in zip(bodies, corners, strict=True):
        yield _touching(body, corner, masks[body.key], frame) if masks[body.key].any() else body


def _alone(body: SkyBody, mask: Mask, cut: bool, frame: SkyFrame) -> SkyBody:
    """A body that is a component of its own: it looks as it looks now."""
    look, corner = look_at(mask, frame.tone)
    moved = body.moved_to(frame.now, centre_of(mask), frame.ground, alone=True)
    return replace(moved, look=look, corner=corner, visible=mask, cut=cut)


def _touching(
    body: SkyBody, corner: tuple[int, int], mask: Mask, frame: SkyFrame
) -> SkyBody:
    """A body that touches others: what the border cuts looks as it looks now, another one as it looked alone."""
    if body.cut:
        look, corner = look_at(mask, frame.tone)
        moved = body.moved_to(frame.now, centre_of(mask), frame.ground, alone=False)
        return replace(moved, look=look, corner=corner, visible=mask)
    centre = centre_of(body.look.mask, corner)
    moved = body.moved_to(frame.now, centre, frame.ground, alone=False)
    return replace(moved, corner=corner, visible=mask)


def _new(key: int, component: int, frame: SkyFrame) -> SkyBody:
    """A body that was not known."""
    mask = frame.found.bright & (frame.found.labels == component)
    look, corner = look_at(mask, frame.tone)
    cut = bool(frame.found.cut[component])
    body = SkyBody(key, look, corner, mask, frame.now, alone=True, cut=cut)
    return body.moved_to(frame.now, centre_of(mask), frame.ground, alone=True)
