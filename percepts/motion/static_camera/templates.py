"""Template matching: divides a shared blob among its objects, and locates partly occluded ones.

The template of an object is its silhouette and tones from when it was last isolated.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.static_camera._templates_jit import best_shift
from visup.percepts.motion.static_camera.blob_track import (
    BlobTrack,
    Foreground,
    Mask,
    crop,
    template_window,
)

SEARCH = 3  # least search range around the prediction, pixels
ENOUGH = 1200  # approximate number of template pixels that are compared
TAKEN = 0.3  # factor on the weight of a pixel that a better fitting object has claimed


def split_blob(
    blob: int, rivals: Sequence[tuple[int, BlobTrack]], view: Foreground
) -> list[tuple[int, Mask]]:
    """Divide a blob among its claimants.

    Args:
        blob: Number of the blob in `view.labels`.
        rivals: The claimants, each with an index of the caller's.
        view: The foreground of the frame.

    Returns:
        For each claimant its index and an (h, w) bool mask of its pixels.
    """
    whole = view.labels == blob
    if len(rivals) < 2:
        return [(i, whole) for i, _ in rivals]
    x, y, w, h = cv2.boundingRect(whole.view(np.uint8))
    ys, xs = np.nonzero(whole[y : y + h, x : x + w])
    ys, xs = ys + y, xs + x
    tones = view.image[ys, xs]
    costs = [np.empty(0, np.float32)] * len(rivals)
    for n, dx, dy in _placed_templates([s for _, s in rivals], whole, view):
        costs[n] = _pixel_costs(rivals[n][1], dx, dy, xs, ys, tones)
    winner = np.argmin(costs, axis=0)
    out = []
    for n, (i, _) in enumerate(rivals):
        mask = np.zeros_like(whole)
        mask[ys[winner == n], xs[winner == n]] = True
        out.append((i, mask))
    return out


def _placed_templates(
    rivals: Sequence[BlobTrack], blob: Mask, view: Foreground
) -> list[tuple[int, int, int]]:
    """(index, dx, dy) of each object in a blob, best fit first; its pixels then weigh less for the others."""
    free, left, out = blob.astype(np.float32), list(range(len(rivals))), []
    while left:
        fits = [(best_template_shift(rivals[n], free, view), n) for n in left]
        (_, dx, dy), n = min(fits)
        left.remove(n)
        out.append((n, dx, dy))
        where, own = template_window(rivals[n], blob.shape, dx, dy)
        crop(free, where)[crop(rivals[n].shape, own)] *= TAKEN
    return out


def best_template_shift(s: BlobTrack, blob: Floats, view: Foreground) -> tuple[float, int, int]:
    """The shift from its prediction at which a template fits a blob best.

    Args:
        s: The object.
        blob: (h, w) float32, weight of each pixel, 0 to 1: 0 outside the blob, less where already claimed.
        view: The foreground of the frame.

    Returns:
        (cost, dx, dy): the cost in grey levels, and the shift in whole pixels.
    """
    # Large templates are subsampled.
    step = max(1, int(np.sqrt(np.count_nonzero(s.shape) / ENOUGH)))
    reach = min(8, SEARCH + round(0.3 * float(np.hypot(*s.velocity)) * view.seconds))
    corner = round(s.corner[0]), round(s.corner[1])
    # Contiguous, since for another memory layout the loop would be compiled again in the middle of a run.
    shape, tone = np.ascontiguousarray(s.shape), np.ascontiguousarray(s.tone)
    return best_shift(view.image, blob, shape, tone, corner, reach, step)


def _pixel_costs(
    s: BlobTrack, dx: int, dy: int, xs: NDArray[np.int64], ys: NDArray[np.int64], tones: Floats
) -> Floats:
    """Cost of assigning each of N pixels to an object, grey levels, (N,) float32."""
    pad = 30
    outer = cv2.copyMakeBorder(
        (~s.shape).astype(np.uint8), pad, pad, pad, pad, cv2.BORDER_CONSTANT, value=1
    )
    far = cv2.distanceTransform(outer, cv2.DIST_L2, 3)
    x = np.clip(xs - round(s.corner[0]) - dx + pad, 0, far.shape[1] - 1)
    y = np.clip(ys - round(s.corner[1]) - dy + pad, 0, far.shape[0] - 1)
    away = far[y, x]
    h, w = s.shape.shape
    tone = s.tone[np.clip(y - pad, 0, h - 1), np.clip(x - pad, 0, w - 1)]
    gap = np.minimum(np.abs(tones - tone).mean(axis=1), 60.0)
    return np.asarray(np.where(away > 0, 60.0 + 5 * away, gap), dtype=np.float32)
