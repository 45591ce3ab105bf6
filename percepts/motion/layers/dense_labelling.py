"""The dense posterior of every superpixel over the layers.

Evidence exists where the image has structure; between edges a random walk (a linear system) spreads it over
similar neighbours, so the flat inside of an object takes the label of its outline while a dark sky, larger
than its borders with objects, stays background. Cells without evidence keep a mixed posterior.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features._partition_jit import may_be_foreground
from visup.percepts.motion.features._superpixels_jit import bayes_shares, sum_point_evidence
from visup.percepts.motion.features.diffusion import solve_symmetric, weighted_laplacian
from visup.percepts.motion.features.motion_constraints import Points
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.tone_histograms import tone_likelihood
from visup.percepts.motion.features.work_image import Floats

REACH = 2.0  # pixels on either side of a point: an edge may belong to either of its sides
CLIP = 5.0
REST_WEIGHT = 4.0  # weight of the previous posterior where an object rests
STILL_DISCARDED = 0.9  # share of the motion evidence discarded there
UNCERTAIN_WEIGHT = 0.03
"""Weight of evidence for anything but background from which a cell is uncertain."""
UNCERTAIN_STEPS = 3  # only cells this near to uncertain ones are solved for; the rest is background
LEAST = 0.03  # floor of the prior: no label is impossible before there is evidence


@dataclass(frozen=True, slots=True, eq=False)
class PointEvidence:
    """Evidence for the labels from the motion of points.

    Attributes:
        points: N points.
        likelihood: (N, K) float32, log likelihood of each label.
        informative: (N,) bool, whether a point is evidence for what is visible there: a corner whose motion
            was measured.
    """

    points: Points
    likelihood: Floats
    informative: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class LabelPrior:
    """The prior of the labels before the evidence of a frame.

    Attributes:
        shares: (count, K) float32, from the predicted positions of the tracks.
        by_appearance: (count, K) float32, the same after the tones of the superpixels.
        stationary: (count,) bool, where an object rests: motion is no evidence there.
    """

    shares: Floats
    by_appearance: Floats
    stationary: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Labelling:
    """The labels of the superpixels: 0 is the background, k the k-th track, the last unknown motion.

    Attributes:
        posterior: (count, K) float32; rows sum to 1.
        winner: (count,) int64, the likeliest label of each.
    """

    posterior: Floats
    winner: NDArray[np.int64]


def cell_evidence(
    cells: Superpixels, evidence: PointEvidence, dense: Floats, prior: Floats
) -> tuple[Floats, Floats]:
    """Bayes' rule in each superpixel: the prior times the likelihood of its constraints.

    Args:
        cells: The superpixels.
        evidence: Evidence of the points.
        dense: (count, K) float32, log likelihood by dense comparison.
        prior: (count, K) float32 label shares before.

    Returns:
        (count, K) float32 label shares, and (count,) float32 the weight of the evidence, 0 to 1.
    """
    points, has = evidence.points, evidence.informative
    totals, number = sum_point_evidence(
        cells.labels,
        points.xy[has],
        points.normal[has],
        evidence.likelihood[has],
        REACH,
        cells.count,
    )
    return bayes_shares(totals, number, dense, prior, LEAST, CLIP)


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
        prior: (count, K) posterior carried from the previous frame.
        persistence: (count,) weight of that prior.
        bias: (count,) weight of the belief that it is background.

    Returns:
        (count, K) float32 posterior; rows sum to 1.
    """
    # Far from any cell that may not be background the answer is background: only the rest is solved
    # for, with those cells as its boundary.
    uncertain = may_be_foreground(share, weight, prior, persistence, UNCERTAIN_WEIGHT)
    inside = np.flatnonzero(cells.dilated(uncertain[:, None], UNCERTAIN_STEPS)[:, 0])
    out = np.zeros(share.shape, np.float32)
    out[:, 0] = 1.0
    if not len(inside):
        return out
    right = share[inside] * weight[inside, None] + prior[inside] * persistence[inside, None]
    right = right.astype(np.float64)
    own = (weight + persistence + bias)[inside].astype(np.float64)
    system, beyond = weighted_laplacian(cells.link, inside, own)
    right[:, 0] += bias[inside] + beyond
    found = solve_symmetric(system, right)
    found = np.maximum(found, 0)
    out[inside] = found / found.sum(axis=1, keepdims=True)
    return out


def appearance_prior(cells: Superpixels, prior: Floats) -> Floats:
    """Shares of the labels (count, K) expected, weighted by the tones of the superpixels."""
    out = prior * tone_likelihood(cells, prior)
    return np.asarray(out / np.maximum(out.sum(axis=1, keepdims=True), 1e-6))


def label_cells(
    cells: Superpixels,
    evidence: PointEvidence,
    dense: Floats,
    prior: LabelPrior,
    settings: MotionSettings,
) -> Labelling:
    """The labels of the superpixels by motion, appearance and the previous frame.

    Args:
        cells: The superpixels.
        evidence: Evidence of the points.
        dense: (count, K) float32, log likelihood by dense comparison.
        prior: The prior.
        settings: Weights.
    """
    stay = prior.stationary
    share, weight = cell_evidence(cells, evidence, dense, prior.shares)
    trust = np.full(cells.count, settings.persistence, dtype=np.float32)
    bias = np.full(cells.count, settings.background_bias, dtype=np.float32)
    bias[_border(cells.labels)] *= 10
    bias *= np.where(prior.shares[:, 1:-1].max(axis=1, initial=0) > 0.5, 0.25, 1.0)
    trust[stay], bias[stay] = REST_WEIGHT, 0.0
    weight[stay] *= 1 - STILL_DISCARDED
    posterior = random_walk(
        cells, share, settings.evidence * weight, prior.by_appearance, trust, bias
    )
    return Labelling(posterior, posterior.argmax(axis=1))


def _border(labels: NDArray[np.int32]) -> NDArray[np.int32]:
    """Superpixels at the border of the image, which are more often background."""
    return np.unique(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]))
