"""Compiled loop of `templates`: the search for the best shift."""

from __future__ import annotations

from math import hypot

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

MOST = 60.0  # greatest cost of a pixel, grey levels
ROUNDING = 1e-6  # tolerance for rounding when a partial cost is compared with a bound


@compiled
def best_shift(
    image: Floats,
    free: Floats,
    shape: NDArray[np.bool_],
    tone: Floats,
    corner: tuple[int, int],
    reach: int,
    step: int,
) -> tuple[float, int, int]:
    """The shift of a template with the least cost.

    Args:
        image: (h, w, 3) float32.
        free: (h, w) float32, weight of each pixel, 0 to 1: 0 outside the blob, less where already claimed.
        shape: (m, n) bool, silhouette of the template.
        tone: (m, n, 3) float32, its tones.
        corner: (x, y) of the unshifted template.
        reach: Greatest shift along either axis, pixels.
        step: Stride of the compared rows and columns.

    Returns:
        (cost, dx, dy): mean cost per compared pixel, grey levels, with a penalty of half a level per pixel of
        shift, and the shift; the first one of equal costs.
    """
    numbers = np.zeros((step, step), np.int64)
    for j in range(shape.shape[0]):
        for i in range(shape.shape[1]):
            numbers[j % step, i % step] += shape[j, i]
    compared = numbers.max()
    listed = _listed(shape, tone, free.shape[1], step, numbers[0, 0])
    # The cost of shift 0 bounds the best cost from the start, so that most shifts are abandoned early.
    bound = _cost(image, free, shape, tone, corner, (step, compared, np.inf))
    best, best_x, best_y = np.inf, 0, 0
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            far, place = 0.5 * hypot(dx, dy), (corner[0] + dx, corner[1] + dy)
            limits = (step, compared, bound - far)
            if _is_within(shape, place, free):
                cost = far + _listed_cost(image, free, listed, place, (compared, bound - far))
            else:
                cost = far + _cost(image, free, shape, tone, place, limits)
            if cost < best:
                best, best_x, best_y = cost, dx, dy
                bound = min(bound, best)
    return best, best_x, best_y


@compiled
def _is_within(shape: NDArray[np.bool_], corner: tuple[int, int], free: Floats) -> bool:
    """Whether a template lies wholly in the image."""
    left, top = corner
    right, bottom = left + shape.shape[1], top + shape.shape[0]
    return bool(min(left, top) >= 0 and right <= free.shape[1] and bottom <= free.shape[0])


@compiled
def _listed(
    shape: NDArray[np.bool_], tone: Floats, width: int, step: int, count: int
) -> tuple[NDArray[np.uint64], Floats, NDArray[np.int64]]:
    """The compared pixels of a template as flat lists, for places where it lies wholly in the image.

    Args:
        shape: (m, n) bool, silhouette of the template.
        tone: (m, n, 3) float32, its tones.
        width: Width of the image, pixels.
        step: Stride of the compared rows and columns.
        count: Number N of compared pixels.

    Returns:
        (N,) uint64 offset of each pixel from the template's corner in the flattened image; (N, 3) float32
        tones; (M,) int64 end of each of the M compared rows in these lists.
    """
    away, tones = np.empty(count, np.uint64), np.empty((count, 3), np.float32)
    ends, n = np.empty((shape.shape[0] + step - 1) // step, np.int64), 0
    for row in range(len(ends)):
        j = row * step
        for i in range(0, shape.shape[1], step):
            if shape[j, i]:
                away[n], tones[n] = j * width + i, tone[j, i]
                n += 1
        ends[row] = n
    return away, tones, ends


@compiled
def _listed_cost(
    image: Floats,
    free: Floats,
    listed: tuple[NDArray[np.uint64], Floats, NDArray[np.int64]],
    corner: tuple[int, int],
    limits: tuple[int, float],
) -> float:
    """`_cost`, with the same result, of a template that lies wholly in the image; twice as fast.

    Args:
        image: As in `best_shift`.
        free: As in `best_shift`.
        listed: From `_listed`.
        corner: (x, y) of the template in the image.
        limits: As in `_cost`, without the stride.
    """
    away, tones, ends = listed
    compared, bound = limits
    flat, open_ = image.reshape(-1, 3), free.reshape(-1)
    begin = np.uint64(corner[1] * free.shape[1] + corner[0])
    total, n = 0.0, 0
    for row in range(len(ends)):
        while n < ends[row]:
            p = begin + away[n]
            gap = abs(flat[p, 0] - tones[n, 0])
            gap += abs(flat[p, 1] - tones[n, 1])
            gap += abs(flat[p, 2] - tones[n, 2])
            total += MOST - (MOST - min(gap / 3, MOST)) * open_[p]
            n += 1
        if total > (bound + ROUNDING) * compared:
            return np.inf
    return total / n if n else np.inf


@compiled
def _cost(
    image: Floats,
    free: Floats,
    shape: NDArray[np.bool_],
    tone: Floats,
    corner: tuple[int, int],
    limits: tuple[int, int, float],
) -> float:
    """Mean cost of the pixels of a template in one place; infinite when it has none in the image.

    Args:
        image: As in `best_shift`.
        free: As in `best_shift`.
        shape: As in `best_shift`.
        tone: As in `best_shift`.
        corner: (x, y) of the template in the image.
        limits: (stride, greatest number of compared pixels, bound): once the cost is certain to exceed the
            bound, infinity is returned.
    """
    step, compared, bound = limits
    height, width = free.shape
    left, top = corner
    total, number = 0.0, 0
    for j in range(max(-top, 0), min(shape.shape[0], height - top), step):
        for i in range(max(-left, 0), min(shape.shape[1], width - left), step):
            if not shape[j, i]:
                continue
            y, x = top + j, left + i
            gap = abs(image[y, x, 0] - tone[j, i, 0])
            gap += abs(image[y, x, 1] - tone[j, i, 1])
            gap += abs(image[y, x, 2] - tone[j, i, 2])
            total += MOST - (MOST - min(gap / 3, MOST)) * free[y, x]
            number += 1
        if total > (bound + ROUNDING) * compared:
            return np.inf
    return total / number if number else np.inf
