"""Filters for blobs that are not objects: unmoved ones, limbs, shadows and ghosts."""

from __future__ import annotations

import cv2
import numpy as np

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.static_camera.background_model import edge_strength
from visup.percepts.motion.static_camera.blob_track import BlobTrack, BlobTracks, crop

LIMB = 0.35  # largest area of a limb, as a share of its object
MIN_DISPLACEMENT = 3.0  # least displacement of a side before an object is reported, pixels
MIN_SHARE = 0.25  # the same as a share of the square root of its area
FOLLOWED = 0.5  # least displacement of the opposite side, as a share of that of the first
STRAIGHT = 0.6  # least net displacement as a share of the path length
DIMMED = (0.3, 0.65)  # brightness in a deep shadow, as a share of the background's
EVENLY = 1.5  # greatest ratio of the relative brightness of a shadow's brightest and darkest parts
SAME_HUE = 0.035  # greatest difference of colour in a shadow, as a share of brightness
GHOST = 0.6  # outline contrast (see `outline_contrast`) below which a blob is a ghost
THING = 1 / GHOST  # the same, above which a blob is an object in front of a known background
FRAGMENT = 0.2  # largest gap between a part and its object, as a share of the object's length


def is_salient_blob(s: BlobTrack) -> bool:
    """Whether a blob has moved as an object does: a side of its box has moved away on a fairly straight path.

    The opposite side must have followed, unless the image border cuts the object. Shadows also move like
    that, and are excluded.
    """
    if s.shadow:
        return False
    gone = s.displacement()
    least = max(MIN_DISPLACEMENT, MIN_SHARE * float(np.sqrt(np.count_nonzero(s.shape))))
    left = (gone > least) & (gone > STRAIGHT * s.path_length)
    if not s.cut:
        # A blob that merely grows or shrinks, as a shadow on an object at rest, moves one side only.
        shifts = s.sides - s.initial_sides
        left = left & (np.roll(shifts, 2) * np.sign(shifts) >= FOLLOWED * gone)
    return s.frames >= 3 and bool(left.any())


def merge_parts(known: BlobTracks) -> BlobTracks:
    """Merge small tracks that were initiated beside an older one, and move with it, into the older one."""
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
    """Whether a blob shows the background dimmed by a uniform factor: a cast shadow.

    The ratio of an object's brightness to that of the background that it hides varies more.

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


def outline_contrast(s: BlobTrack, now: Floats, background: Floats) -> float | None:
    """Ratio of the edge strength along an outline in the image to that in the background model.

    It is high for an object, whose outline is in the image only, and low for a ghost, whose outline is in the
    background only. It says nothing about a shadow, which dims the edges that it falls on; a blob too thin to
    have an interior, however, is not certain to be a shadow.

    Args:
        s: The object.
        now: (h, w, 3) float32 image.
        background: (h, w, 3) float32 background.

    Returns:
        The ratio; None if the blob is hidden, shared with other objects, or a shadow.
    """
    if s.visible is None or s.merged:
        return None
    box, shape = s.visible
    inner = cv2.erode(np.pad(shape, 1).astype(np.uint8), np.ones((3, 3), np.uint8))[1:-1, 1:-1]
    if s.shadow and inner.any():
        return None
    rim = shape & (inner == 0)
    before = float(edge_strength(background, box)[rim].mean())
    return float(edge_strength(now, box)[rim].mean()) / max(before, 1e-6)
