"""The dense posterior: which layer each superpixel belongs to, and how surely.

Evidence comes where the image has structure; between edges it is spread over alike neighbours by a
random walk (a linear system), so the flat inside of an object takes the label of its outline while
a dark sky, which is larger than its borders with objects, stays background. What is not settled by
evidence stays between the labels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from visup.percepts.motion.features._superpixels_jit import bayes_shares, sum_point_evidence
from visup.percepts.motion.features.motion_constraints import Points
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.tone_histograms import tone_likelihood
from visup.percepts.motion.features.work_image import Floats

REACH = 2.0  # pixels on either side of a point: an edge may belong to either of its sides
CLIP = 5.0
STAY = 4.0  # weight of what was there before where an object rests
STILL_TOLD = 0.9  # share of the evidence that is left out there
DOUBT = 0.03  # weight of evidence for anything but background from which a cell is in doubt
DOUBT_STEPS = 3  # how far it is felt: beyond, what is seen is background
LEAST = 0.03  # no label is ever quite impossible before there is evidence


def cell_evidence(
    cells: Superpixels,
    points: Points,
    likelihood: Floats,
    has: NDArray[np.bool_],
    prior: Floats,
    more: Floats,
) -> tuple[Floats, Floats]:
    """Bayes' rule in each superpixel: the prior times the likelihood of its constraints.

    Args:
        cells: The superpixels.
        points: N points.
        likelihood: (N, K) float32 log likelihood of each label.
        has: (N,) bool, whether a point says what is seen there.
        prior: (count, K) float32 label shares before.
        more: (count, K) float32 dense log likelihood.

    Returns:
        (count, K) float32 label shares, and (count,) float32 the weight of the evidence, 0 to 1.
    """
    totals, number = sum_point_evidence(
        cells.labels, points.xy[has], points.normal[has], likelihood[has], REACH, cells.count
    )
    return bayes_shares(totals, number, more, prior, LEAST, CLIP)


def random_walk(
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
    # Far from all that may not be background, nothing else can come out: the rest is solved for,
    # with those cells as its border.
    doubt = (share[:, 1:].sum(axis=1) * weight + prior[:, 1:].sum(axis=1) * persistence) > DOUBT
    inside = np.flatnonzero(cells.dilated(doubt[:, None], DOUBT_STEPS)[:, 0])
    out = np.zeros(share.shape)
    out[:, 0] = 1.0
    if not len(inside):
        return out.astype(np.float32)
    right = (share * weight[:, None] + prior * persistence[:, None])[inside].astype(np.float64)
    own = (weight + persistence + bias)[inside].astype(np.float64)
    system, beyond = _system(cells.link, inside, own)
    right[:, 0] += bias[inside] + beyond
    found = splu(
        system,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        relax=1,  # cells have so few neighbours that there is nothing to gather in dense blocks
        panel_size=1,
        options={"SymmetricMode": True},
    ).solve(right)
    found = np.maximum(found, 0)
    out[inside] = found / found.sum(axis=1, keepdims=True)
    return np.asarray(out, dtype=np.float32)


def _system(
    link: sparse.csr_matrix, inside: NDArray[np.int64], own: NDArray[np.float64]
) -> tuple[sparse.csc_matrix, NDArray[np.float64]]:
    """The weighted Laplacian of some cells, and (M,) the affinity of each to cells left out.

    Args:
        link: (count, count) affinity of neighbours, symmetric.
        inside: (M,) numbers of the cells, ascending.
        own: (M,) what else is on the diagonal.

    Returns:
        (M, M) float64, symmetric; and (M,) float64.
    """
    m = len(inside)
    number = np.full(link.shape[0], -1, dtype=np.int32)
    number[inside] = np.arange(m, dtype=np.int32)
    one, other = (
        number[np.repeat(np.arange(link.shape[0]), np.diff(link.indptr))],
        number[link.indices],
    )
    mine = one >= 0
    one, other, value = one[mine], other[mine], link.data[mine].astype(np.float64)
    degree = np.bincount(one, weights=value, minlength=m)
    within = other >= 0
    one, other, value = one[within], other[within], value[within]
    ends = np.cumsum(np.bincount(one, minlength=m) + 1)
    # The diagonal comes last in each column: nothing asks for another order.
    place = np.arange(len(one)) + one
    data, rows = np.empty(len(one) + m), np.empty(len(one) + m, dtype=np.int32)
    data[place], rows[place] = -value, other
    data[ends - 1], rows[ends - 1] = degree + own, np.arange(m)
    columns = np.concatenate([[0], ends]).astype(np.int32)
    beyond = np.asarray(degree - np.bincount(one, weights=value, minlength=m))
    return sparse.csc_matrix((data, rows, columns), shape=(m, m)), beyond


def appearance_prior(cells: Superpixels, prior: Floats) -> Floats:
    """Shares of the labels (count, K) that are expected, after the tones of the superpixels."""
    look = prior * tone_likelihood(cells, prior)
    return np.asarray(look / np.maximum(look.sum(axis=1, keepdims=True), 1e-6))


def label_cells(
    cells: Superpixels,
    points: Points,
    likelihood: Floats,
    has: NDArray[np.bool_],
    prior: Floats,
    look: Floats,
    more: Floats,
    stay: NDArray[np.bool_],
    settings: MotionSettings,
) -> Floats:
    """The posterior of each superpixel from motion, appearance and what was there before.

    Args:
        cells: The superpixels.
        points: N points.
        likelihood: (N, K) float32 log likelihood of labels at the points.
        has: (N,) bool, whether a point says what is seen there.
        prior: (count, K) float32 label shares expected.
        look: (count, K) float32, the same by what cells look like; see `appearance_prior`.
        more: (count, K) float32 dense log likelihood.
        stay: (count,) bool, where an object rests: motion tells nothing there.
        settings: Weights.

    Returns:
        (count, K) float32.
    """
    share, weight = cell_evidence(cells, points, likelihood, has, prior, more)
    trust = np.full(cells.count, settings.persistence, dtype=np.float32)
    bias = np.full(cells.count, settings.background_bias, dtype=np.float32)
    bias[_border(cells.labels)] *= 10
    bias *= np.where(prior[:, 1:-1].max(axis=1, initial=0) > 0.5, 0.25, 1.0)
    trust[stay], bias[stay] = STAY, 0.0
    weight[stay] *= 1 - STILL_TOLD
    return random_walk(cells, share, settings.evidence * weight, look, trust, bias)


def _border(labels: NDArray[np.int32]) -> NDArray[np.int32]:
    """Superpixels at the border of the image: what is seen there more often lies behind."""
    return np.unique(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]))
