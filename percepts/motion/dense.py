"""The dense posterior: which layer each superpixel belongs to, and how surely.

Evidence comes where the image has structure; between edges it is spread over alike neighbours by a
random walk (a linear system), so the flat inside of an object takes the label of its outline while
a dark sky, which is larger than its borders with objects, stays background. What is not settled by
evidence stays between the labels.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from visup.percepts.motion.constraints import Points
from visup.percepts.motion.image import Floats
from visup.percepts.motion.superpixels import Superpixels

REACH = 2.0  # pixels on either side of a point: an edge may belong to either of its sides
CLIP = 5.0
LEAST = 0.03  # no label is ever quite impossible before there is evidence


def flow_back(new: NDArray[np.uint8], old: NDArray[np.uint8], engine: cv2.DISOpticalFlow) -> Floats:
    """Dense flow from the newest image back to the old one, (h, w, 2) float32 pixels."""
    return np.asarray(engine.calc(new, old, None), dtype=np.float32)


def gather(
    cells: Superpixels, points: Points, likelihood: Floats, has: NDArray[np.bool_], prior: Floats
) -> tuple[Floats, Floats]:
    """Bayes' rule in each superpixel: the prior times the likelihood of its constraints.

    Args:
        cells: The superpixels.
        points: N points.
        likelihood: (N, K) float32 log likelihood of each label.
        has: (N,) bool, whether a point has a constraint.
        prior: (count, K) float32 label shares before.

    Returns:
        (count, K) float32 label shares, and (count,) float32 the weight of the evidence, 0 to 1.
    """
    height, width = cells.labels.shape
    totals = np.zeros((cells.count, likelihood.shape[1]), dtype=np.float64)
    number = np.zeros(cells.count)
    for side in (-REACH, REACH):
        at = np.rint(points.xy[has] + side * points.normal[has]).astype(np.int64)
        x, y = np.clip(at[:, 0], 0, width - 1), np.clip(at[:, 1], 0, height - 1)
        where = cells.labels[y, x]
        number += np.bincount(where, minlength=cells.count)
        for k in range(likelihood.shape[1]):
            totals[:, k] += np.bincount(where, weights=likelihood[has, k], minlength=cells.count)
    totals /= np.maximum(np.sqrt(number), 1)[:, None]
    totals -= totals.max(axis=1, keepdims=True)
    sure = np.minimum(-totals.min(axis=1), CLIP) / CLIP
    share = (prior + LEAST) * np.exp(np.maximum(totals, -2 * CLIP))
    share /= share.sum(axis=1, keepdims=True)
    return share.astype(np.float32), (sure * (number > 0)).astype(np.float32)


def spread(
    cells: Superpixels,
    share: Floats,
    weight: Floats,
    prior: Floats,
    persistence: Floats,
    bias: Floats,
) -> Floats:
    """Solve for the posterior of every superpixel.

    Args:
        cells: The superpixels.
        share: (count, K) label shares by evidence; label 0 is the background.
        weight: (count,) weight of the evidence.
        prior: (count, K) posterior carried from the frame before.
        persistence: (count,) weight of that prior.
        bias: (count,) weight of the belief that it is background.

    Returns:
        (count, K) float32 posterior; rows sum to 1.
    """
    right = share * weight[:, None] + prior * persistence[:, None]
    right[:, 0] += bias
    degree = np.asarray(cells.link.sum(axis=1)).ravel()
    diagonal = degree + weight + persistence + bias
    system = sparse.diags(diagonal).astype(np.float64) - cells.link
    out = splu(system.tocsc(), permc_spec="MMD_AT_PLUS_A").solve(right.astype(np.float64))
    out = np.maximum(out, 0)
    return np.asarray(out / out.sum(axis=1, keepdims=True), dtype=np.float32)
