"""Multi-object tracking of foreground blobs before a static background.

One blob may show several objects, and one object may appear as several blobs. Each object has a template of
its silhouette and tones from when it was last isolated (did not share a blob). Matching the template gives
the object's part of a shared blob, and its position while others occlude it.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines.region_outline import label_areas
from visup.percepts.motion.static_camera.blob_track import (
    BlobTrack,
    BlobTracks,
    Box,
    Foreground,
    Mask,
    at_border,
    crop,
    crop_mask,
    template_window,
    tone_histogram,
)
from visup.percepts.motion.static_camera.side_by_side import (
    APART,
    are_side_by_side,
    person_width,
    split_people,
)
from visup.percepts.motion.static_camera.templates import best_template_shift, split_blob

MIN_CLAIM = 0.25  # least overlap for a claim, as a share of the smaller of object and blob
VISIBLE_SHARE = 0.2  # visible share of its template below which an object is hidden
FRAGMENT = 0.2  # largest gap between fragments of one object, as a share of its length
FOLLOW = 0.35  # weight of a newly measured velocity
PASSED_SHARE = 0.6
"""Displacement, in lengths, after which the pieces of an object are several objects."""
PIECE = 0.35  # least area of a piece that may be an object, as a share of the largest
GROWN = 1.3  # visible area, in areas of the template, from which the template is outdated


def track_blobs(known: BlobTracks, view: Foreground, last_key: int) -> tuple[BlobTracks, int]:
    """Update the tracks with a frame, and initiate new ones.

    Args:
        known: Tracks of the previous frame.
        view: The foreground of the frame.
        last_key: The greatest key assigned so far.

    Returns:
        All tracks, including hidden ones; the greatest key assigned.
    """
    ahead = [_predicted(s, view.seconds) for s in known]
    slender = person_width(ahead)
    view = split_people(view, ahead, slender)
    claims = _claims(ahead, view)
    out: list[BlobTrack] = []
    taken = np.zeros(view.count + 1, dtype=bool)
    rivals = [_claimants(b, claims, ahead) for b in range(view.count + 1)]
    claims = [[b for b in c if i in rivals[b]] for i, c in enumerate(claims)]
    parts: list[list[Mask]] = [[] for _ in ahead]
    for b in range(1, view.count + 1):
        for i, mask in split_blob(b, [(i, ahead[i]) for i in rivals[b]], view):
            parts[i].append(mask)
            taken[b] = True
    left = []
    for i, s in enumerate(ahead):
        alone = all(len(rivals[b]) == 1 for b in claims[i])
        whole, others = _merged_parts(s, parts[i], alone, slender)
        left += others
        pieces = (
            alone
            and sum(_is_large_part(p, max(parts[i], key=np.count_nonzero)) for p in parts[i]) > 1
            and not others
        )
        out.append(_updated(s, known[i], whole, alone, view, pieces=pieces))
    fresh = [view.labels == b for b in range(1, view.count + 1) if not taken[b]] + left
    for mask in fresh:
        last_key += 1
        out.append(_initiated(mask, view, last_key))
    return tuple(out), last_key


def _predicted(s: BlobTrack, seconds: float) -> BlobTrack:
    x, y = s.corner
    return replace(s, corner=(x + s.velocity[0] * seconds, y + s.velocity[1] * seconds))


def _claims(ahead: Sequence[BlobTrack], view: Foreground) -> list[list[int]]:
    """The blobs that each object claims by its prediction; otherwise a free one by assignment."""
    areas = label_areas(view.labels, view.count + 1)
    claims: list[list[int]] = []
    for s in ahead:
        at, own = template_window(s, view.labels.shape)
        common = np.bincount(crop(view.labels, at)[crop(s.shape, own)], minlength=view.count + 1)
        least = MIN_CLAIM * np.minimum(areas, np.count_nonzero(s.shape))
        claims.append([b for b in range(1, view.count + 1) if common[b] > least[b]])
    _assign_unclaimed(ahead, view, claims, areas)
    return claims


def _claimants(blob: int, claims: Sequence[Sequence[int]], ahead: Sequence[BlobTrack]) -> list[int]:
    """Indices of the objects that share a blob.

    Those that have hardly been isolated yet are left out, unless all are: then the first one has the blob.
    """
    all_ = [i for i, c in enumerate(claims) if blob in c]
    known = [i for i in all_ if ahead[i].isolated_frames >= APART]
    return known or all_[:1]


def _assign_unclaimed(
    ahead: Sequence[BlobTrack], view: Foreground, claims: list[list[int]], areas: NDArray[np.int64]
) -> None:
    """Assign nearby free blobs to objects without a claim, at the least total cost."""
    free = sorted(set(range(1, view.count + 1)) - {b for c in claims for b in c})
    lost = [i for i, c in enumerate(claims) if not c]
    if not free or not lost:
        return
    cost = np.full((len(lost), len(free)), 1e3)
    appearances = [_blob_appearance(view.labels == b, view) for b in free]
    for row, i in enumerate(lost):
        s = ahead[i]
        size = float(np.hypot(*s.shape.shape))
        waited = view.time - s.last_seen
        allowed = (
            0.6 * size + 0.5 * float(np.hypot(*s.velocity)) * waited + 0.2 * size * min(waited, 3)
        )
        for col, (b, (centre, histogram)) in enumerate(zip(free, appearances, strict=True)):
            far = np.hypot(centre[0] - s.centre[0], centre[1] - s.centre[1]) / allowed
            unlike = 1 - float(np.sqrt(histogram * s.histogram).sum())
            ratio = areas[b] / max(np.count_nonzero(s.shape), 1)
            if far < 1 and unlike < 0.45 and 0.3 < ratio < 3:
                cost[row, col] = far + 2 * unlike
    for row, col in zip(*linear_sum_assignment(cost), strict=True):
        if cost[row, col] < 1e3:
            claims[lost[row]].append(free[col])


def _blob_appearance(mask: Mask, view: Foreground) -> tuple[tuple[float, float], Floats]:
    ys, xs = np.nonzero(mask)
    centre = (
        (float(xs.min()) + float(xs.max()) + 1) / 2,
        (float(ys.min()) + float(ys.max()) + 1) / 2,
    )
    return centre, tone_histogram(view.image[ys, xs])


def _merged_parts(
    s: BlobTrack, parts: Sequence[Mask], alone: bool, slender: float
) -> tuple[Mask | None, list[Mask]]:
    """The parts that make up an object as one mask, and those that do not belong to it.

    Args:
        s: The predicted track.
        parts: (h, w) bool masks assigned to the object.
        alone: Whether it shares no blob.
        slender: Width of a body as a share of its height.
    """
    if not parts:
        return None, []
    order = sorted(parts, key=lambda m: -int(np.count_nonzero(m)))
    whole, others = order[0], []
    reach = max(3, round(FRAGMENT * max(s.shape.shape)))
    # A static occluder, such as a post, splits an object only until the object has passed it.
    two = s.split_px > PASSED_SHARE * max(s.shape.shape)
    for part in order[1:]:
        bodies = s.split_px > 0 and are_side_by_side(_box(whole), _box(part), slender)
        if (two or bodies) and _is_large_part(part, whole):
            others.append(part)
            continue
        near = cv2.dilate(whole.astype(np.uint8), np.ones((2 * reach + 1, 2 * reach + 1), np.uint8))
        if not alone or (near.astype(bool) & part).any():
            whole = whole | part
        else:
            others.append(part)
    return whole, others


def _box(mask: Mask) -> tuple[int, int, int, int]:
    x, y, w, h = cv2.boundingRect(mask.view(np.uint8))
    return x, y, w, h


def _is_large_part(part: Mask, whole: Mask) -> bool:
    return int(np.count_nonzero(part)) > PIECE * int(np.count_nonzero(whole))


def _initiated(mask: Mask, view: Foreground, key: int) -> BlobTrack:
    box, shape = crop_mask(mask)
    tone = crop(view.image, box)
    histogram = tone_histogram(tone[shape])
    corner = (float(box[0]), float(box[1]))
    now = (box, shape)
    t = view.time
    start = np.array(box, dtype=np.float32)
    return BlobTrack(
        key,
        0,
        t,
        t,
        1,
        corner,
        (0.0, 0.0),
        shape,
        tone,
        histogram,
        start,
        0 * start,
        1,
        now,
        cut=at_border(box, view),
    )


def _updated(
    s: BlobTrack,
    before: BlobTrack,
    mask: Mask | None,
    alone: bool,
    view: Foreground,
    *,
    pieces: bool,
) -> BlobTrack:
    """A track updated with its pixels in a frame.

    Args:
        s: The predicted track.
        before: The track of the previous frame.
        mask: Its pixels; None when it is hidden.
        alone: Whether it shares no blob.
        view: The foreground of the frame.
        pieces: Whether it is visible in several large pieces.
    """
    full = np.count_nonzero(s.shape)
    if mask is None or np.count_nonzero(mask) < VISIBLE_SHARE * full:
        return replace(s, visible=None, merged=not alone)
    box, shape = crop_mask(mask)
    if not alone and np.count_nonzero(mask) < GROWN * full:
        moved = _shifted(s, mask, view)
    else:
        moved = _measured_anew(s, before, box, shape, view)
    gone = np.abs(moved.sides - before.sides)
    return replace(
        moved,
        last_seen=view.time,
        frames=s.frames + 1,
        path_length=s.path_length + gone,
        isolated_frames=s.isolated_frames + int(alone),
        visible=(box, shape),
        merged=not alone,
        cut=s.cut or at_border(box, view),
        split_px=before.split_px + float(gone.mean()) if pieces else 0.0,
    )


def _shifted(s: BlobTrack, mask: Mask, view: Foreground) -> BlobTrack:
    """Update of a partly hidden object, from the shift of its template alone."""
    _, dx, dy = best_template_shift(s, mask.astype(np.float32), view)
    gain = 0.3 * FOLLOW
    corner = (s.corner[0] + dx, s.corner[1] + dy)
    velocity = (
        s.velocity[0] + gain * dx / view.seconds,
        s.velocity[1] + gain * dy / view.seconds,
    )
    return replace(s, corner=corner, velocity=velocity)


def _measured_anew(
    s: BlobTrack, before: BlobTrack, box: Box, shape: Mask, view: Foreground
) -> BlobTrack:
    """Update of a fully visible object: box, velocity, template and tones are measured anew."""
    elapsed = max(view.time - before.last_seen, view.seconds, 1e-3)
    old = before.centre
    new = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
    gain = max(FOLLOW, 1 / (s.frames + 0.0))
    velocity = (
        s.velocity[0] + gain * ((new[0] - old[0]) / elapsed - s.velocity[0]),
        s.velocity[1] + gain * ((new[1] - old[1]) / elapsed - s.velocity[1]),
    )
    tone = crop(view.image, box)
    histogram = 0.8 * s.histogram + 0.2 * tone_histogram(tone[shape])
    corner = (float(box[0]), float(box[1]))
    return replace(s, corner=corner, velocity=velocity, shape=shape, tone=tone, histogram=histogram)
