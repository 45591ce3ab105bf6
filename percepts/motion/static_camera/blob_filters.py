"""Which blobs are objects: neither what has not left its place, nor limbs, nor ghosts."""

from __future__ import annotations

import cv2
import numpy as np

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.static_camera.background_model import edge_strength
from visup.percepts.motion.static_camera.blob_track import BlobTrack, BlobTracks, crop

LIMB = 0.35  # how large, as a share of its object, a part may be that is taken for a limb
LEAST_GONE = 3.0  # pixels that a side must have gone before an object is reported
LEAST_SHARE = 0.25  # the same as a share of its size
FOLLOWED = 0.5  # how far the opposite side must have gone too, as a share
STRAIGHT = 0.6  # net way as a share of the way
DIMMED = (0.3, 0.65)  # brightness in a deep shadow, as a share of that at rest
EVENLY = 1.5  # how much brighter, relative to the background, the brightest part of a shadow may be
SAME_HUE = 0.035  # how far colour may differ in it, as a share of brightness
GHOST = 0.6  # edges in the image, as a share of those at background, below which nothing is there
FRAGMENT = 0.2  # gap between a part and its object, as a share of its length


def is_salient_blob(s: BlobTrack) -> bool:
    """Whether a side of an object's box has left its place and kept a course while it did.

    The opposite side must have followed it, unless the border of the image cuts the object. Shadows do so
    too, and are none.
    """
    if s.shadow:
        return False
    gone = s.displacement()
    least = max(LEAST_GONE, LEAST_SHARE * float(np.sqrt(np.count_nonzero(s.shape))))
    left = (gone > least) & (gone > STRAIGHT * s.path_length)
    if not s.cut:
        # What stays and only grows or shrinks, as a shadow on a thing at background, moves one side alone.
        ways = s.sides - s.initial_sides
        left = left & (np.roll(ways, 2) * np.sign(ways) >= FOLLOWED * gone)
    return s.frames >= 3 and bool(left.any())


def merge_parts(known: BlobTracks) -> BlobTracks:
    """Give small parts that were initiated beside an object, and go with it, to that object."""
    out = list(known)
    for s in known:
        if s.visible is None:
            continue
        for i, host in enumerate(out):
            if host.key >= s.key or host.visible is None or s.cut or not _moves_with(s, host):
                continue
            out[i] = _with_part(host, s)
            out = [o for o in out if o.key != s.key]
            break
    return tuple(out)


def _moves_with(s: BlobTrack, host: BlobTrack) -> bool:
    if np.count_nonzero(s.shape) > LIMB * np.count_nonzero(host.shape) or s.frames < 3:
        return False
    a, b = s.sides, host.sides
    gap = max(a[0] - b[2], b[0] - a[2], a[1] - b[3], b[1] - a[3])
    off = np.hypot(*np.subtract(s.velocity, host.velocity))
    speed = float(np.hypot(*host.velocity))
    return bool(gap <= max(3, FRAGMENT * max(host.shape.shape)) and off < 0.5 * speed + 3.0)


def _with_part(host: BlobTrack, s: BlobTrack) -> BlobTrack:
    assert host.visible is not None
    assert s.visible is not None
    (a, shape), (b, part) = host.visible, s.visible
    box = (min(a[0], b[0]), min(a[1], b[1]), max(a[2], b[2]), max(a[3], b[3]))
    mask = np.zeros((box[3] - box[1], box[2] - box[0]), dtype=bool)
    tone = np.zeros((*mask.shape, 3), dtype=np.float32)
    for (x0, y0, x1, y1), m, t in ((a, shape, host.tone), (b, part, s.tone)):
        where = (slice(y0 - box[1], y1 - box[1]), slice(x0 - box[0], x1 - box[0]))
        mask[where] |= m
        if t.shape[:2] == m.shape:
            tone[where] = t
    corner = (float(box[0]), float(box[1]))
    return replace(
        host, id=host.id or s.id, visible=(box, mask), shape=mask, tone=tone, corner=corner
    )


def is_deep_shadow(s: BlobTrack, image: Floats, background: Floats) -> bool:
    """Whether an outline shows the background, dimmed by one factor all over: what is cast, not what casts.

    Objects differ from what they hide by more in one place than in another.

    Args:
        s: The object.
        image: (h, w, 3) float32.
        background: (h, w, 3) float32, the background at the exposure of the image.
    """
    if s.visible is None or s.merged:
        return False
    box, shape = s.visible
    now, before = crop(image, box)[shape], crop(background, box)[shape]
    power = np.einsum("ij,ij->i", before, before) + 1.0
    bright = np.einsum("ij,ij->i", now, before) / power
    gap = now - bright[:, None] * before
    hue = np.sqrt(np.einsum("ij,ij->i", gap, gap) / power)
    low, high = np.quantile(bright, [0.1, 0.9])
    dim = low > DIMMED[0] and high < min(DIMMED[1], EVENLY * low)
    return bool(dim and np.quantile(hue, 0.9) <= SAME_HUE)


def is_ghost(s: BlobTrack, now: Floats, background: Floats) -> bool:
    """Whether an outline has its edges in the background model: it shows where something left.

    A shadow dims the edges of what it falls on, and nothing has left; what is so thin that it has
    no inside is not surely one.

    Args:
        s: The object.
        now: (h, w, 3) float32 image.
        background: (h, w, 3) float32 background.
    """
    if s.visible is None or s.merged:
        return False
    box, shape = s.visible
    inner = cv2.erode(np.pad(shape, 1).astype(np.uint8), np.ones((3, 3), np.uint8))[1:-1, 1:-1]
    if s.shadow and inner.any():
        return False
    rim = shape & (inner == 0)
    return float(edge_strength(now, box)[rim].mean()) < GHOST * float(
        edge_strength(background, box)[rim].mean()
    )
