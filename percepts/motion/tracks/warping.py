"""Dense comparison of the newest image with an older one warped by each layer's motion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features._superpixels_jit import half_size_means
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.layers.affine import Affine
from visup.percepts.motion.tracks._track_points_jit import hidden_before
from visup.percepts.motion.tracks.measurements import FrameMeasurements
from visup.percepts.motion.tracks.track import Track


def flow_back(new: NDArray[np.uint8], old: NDArray[np.uint8], engine: cv2.DISOpticalFlow) -> Floats:
    """Dense flow from the newest image back to the old one, (h, w, 2) float32 pixels."""
    return np.asarray(engine.calc(new, old, np.zeros((*new.shape, 2), np.float32)))


def warp_likelihood(
    new: WorkImage,
    old: WorkImage,
    models: Sequence[Affine],
    box: tuple[int, int, int, int],
    precision: Floats,
) -> Floats:
    """Log likelihood of pixels when the old image is warped by a layer's motions (best of them).

    Half the size suffices: the question is which cells fit, and each is several pixels wide.

    Args:
        new: The newest image.
        old: The older image.
        models: Displacements from old to new, working pixels; at least one.
        box: (x, y, width, height) of the part to compare, pixels at half the size.
        precision: (height, width) float32 inverse variance of grey values there.

    Returns:
        (height, width) float32, from -4.5 to 0.
    """
    x, y, w, h = box
    part = np.s_[y : y + h, x : x + w]
    gaps = [cv2.absdiff(new.half[part], _warp(old.half, model, box)) for model in models]
    off = np.square(reduce(np.minimum, gaps), dtype=np.float32)
    np.multiply(off, precision, out=off)
    np.minimum(off, 9.0, out=off)
    return np.multiply(off, np.float32(-0.5), out=off)


def grey_precision(image: WorkImage, noise: float, box: tuple[int, int, int, int]) -> Floats:
    """Expected inverse variance of a warped image's grey values, (h, w) float32.

    On a steep gradient a small motion error causes a large error of the grey value. The box is in pixels at
    half the size.
    """
    x, y, w, h = box
    every = np.s_[2 * y : 2 * (y + h) : 2, 2 * x : 2 * (x + w) : 2]
    gx, gy = image.gx[every], image.gy[every]
    slope2 = gx * gx + gy * gy
    return np.asarray(1 / ((1.5 * noise) ** 2 + 0.35**2 * slope2), dtype=np.float32)


def _warp(grey: NDArray[np.uint8], model: Affine, box: tuple[int, int, int, int]) -> NDArray[Any]:
    """An old image, at half the size, warped by a layer's motion to a part of the newest one.

    The centre of pixel u is at 2 u + 1/2 in the working image, to which motions refer.
    """
    x, y, w, h = box
    if model.bend is not None:
        ys, xs = np.mgrid[y : y + h, x : x + w]
        at = np.stack([xs, ys], axis=-1).reshape(-1, 2).astype(np.float32)
        source = (at - model.at(2 * at + np.float32(0.5)) / 2).reshape(h, w, 2)
        from_x, from_y = (np.ascontiguousarray(source[..., i]) for i in (0, 1))
        return cv2.remap(grey, from_x, from_y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    back = np.eye(2, 3)
    back[:, :2] -= model.matrix[:, :2]
    back[:, 2] -= np.asarray(model.shift((0.5, 0.5))) / 2
    back[:, 2] += back[:, :2] @ np.array([x, y])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return cv2.warpAffine(grey, back, (w, h), flags=flags, borderMode=cv2.BORDER_REPLICATE)


def dense_likelihood(
    scene: FrameMeasurements,
    tracks: Sequence[Track],
    old: WorkImage,
    near: NDArray[np.bool_],
    noise: float,
) -> Floats:
    """Dense evidence: which motion maps the older image onto the newest one.

    Args:
        scene: The frame; its longest baseline is used.
        tracks: K tracks.
        old: The image at the other end of that baseline.
        near: (count, K) bool, the cells that each track can reach.
        noise: Standard deviation of grey values.

    Returns:
        (count, K + 2) float32 log likelihood of each label in each cell.
    """
    cells, m = scene.cells, scene.measured[-1]
    c = m.constraints
    out = np.zeros((cells.count, len(tracks) + 2), dtype=np.float32)
    any_near = np.asarray(near.any(axis=1))
    if not any_near.any():
        return out
    box = _halved(cells.box(any_near), cells)
    precision = grey_precision(scene.image, noise, box)
    zero = _cell_mean(
        cells, warp_likelihood(scene.image, old, m.background.models, box, precision), box
    )
    out[any_near, 0] = zero[any_near]
    out[any_near, 1:] = -4.5
    for k, t in enumerate(tracks, 1):
        mine = np.flatnonzero(near[:, k - 1])
        if len(mine):
            models = scene.parts(t, c)
            x, y, w, h = own = _halved(cells.box(near[:, k - 1]), cells)
            there = np.s_[y - box[1] : y - box[1] + h, x - box[0] : x - box[0] + w]
            fit = warp_likelihood(scene.image, old, models, own, precision[there])
            out[mine, k] = _cell_mean(cells, fit, own)[mine]
            hid = mine[_was_hidden(scene, mine, models[0], k)]
            out[hid, 0] = np.maximum(out[hid, 0], out[hid, k])
    out[any_near, -1] = out[any_near, :-1].max(axis=1)
    return out


def _was_hidden(
    scene: FrameMeasurements, which: NDArray[np.int64], model: Affine, k: int
) -> NDArray[np.bool_]:
    """Which of some cells, were they background, the track would have hidden in the older image.

    There the background may look different now, so a poor match is no evidence against it.
    """
    cells, background = scene.cells, scene.measured[-1].background.models
    centre = cells.centre[which]
    moved, out = model.at(centre), np.zeros(len(which), dtype=bool)
    for ground in background:
        away = moved - ground.at(centre)
        out |= hidden_before(cells.labels, scene.owner, cells.centre, which, away, k)
    return out


def _halved(box: tuple[int, int, int, int], cells: Superpixels) -> tuple[int, int, int, int]:
    """A box of working pixels as one at half the size, at least one pixel wide, in the image."""
    x, y, w, h = box
    height, width = (n // 2 for n in cells.labels.shape)
    left, top = min(x // 2, width - 1), min(y // 2, height - 1)
    right, bottom = min((x + w + 1) // 2, width), min((y + h + 1) // 2, height)
    return left, top, max(right - left, 1), max(bottom - top, 1)


def _cell_mean(cells: Superpixels, values: Floats, box: tuple[int, int, int, int]) -> Floats:
    """Mean of a map of a box, at half the size, in each cell; 0 where the box has none of its pixels."""
    return half_size_means(cells.labels, np.ascontiguousarray(values), box, cells.count)
