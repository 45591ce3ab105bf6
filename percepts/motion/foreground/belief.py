"""The probability that each superpixel moves independently, filtered from frame to frame.

Each frame's cues are classified twice: alone, then in context, with the neighbours' cues, the belief carried
along the flow, and whether the tone is that of past foreground or background. The context classifier is
trained in the loop: on beliefs that the model itself produced.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features.tone_histograms import smoothed_histogram
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground._cues_jit import neighbour_means, smooth_untextured
from visup.percepts.motion.foreground.cues import BINS, NAMES, FrameCues
from visup.percepts.motion.foreground.perceptron import ForegroundModel

HISTOGRAM_DECAY = 0.92  # weight of the tones of all earlier frames
FEWEST_PIXELS = 200.0  # foreground pixels below which tones are uninformative
TONE_FLOOR = 2e-4  # floor of a tone's share in either histogram
SHARE_FLOOR = 0.003  # share of the image added before taking a logarithm
BELIEF_MARGIN = 0.02  # distance that a carried belief keeps from 0 and 1
PRIOR_BELIEF = 0.1  # belief where there is no previous frame
PEAK_RANK = 50  # one cell in 50 is above the frame's peak log odds
ALONE_NEAR, PAST, TOGETHER = (len(NAMES) + k for k in (1, 4, 10))  # columns of the cues in context
CUES_IN_CONTEXT = len(NAMES) + 17
TEXTURE = NAMES.index("texture")
CALM = 8.0  # texture, grey levels per pixel, at which the flow is half trusted
TRUST = 1.0  # weight of a fully trusted value, relative to affinities
SWEEPS = 8
MAX_LOG_ODDS = 12.0  # log odds are clipped here


@dataclass(frozen=True, slots=True, eq=False)
class Belief:
    """The belief after a frame.

    Attributes:
        share: (count,) float32, probability that each superpixel moves independently.
        alone: (count,) float32, the same by the cues of each superpixel alone.
        moving: (BINS ** 3,) float64, tone histogram of the foreground; older frames fade.
        rest: (BINS ** 3,) float64, tone histogram of the background.
    """

    share: Floats
    alone: Floats
    moving: NDArray[np.float64]
    rest: NDArray[np.float64]


def initial_belief() -> Belief:
    """The belief before the first frame."""
    none = np.zeros(BINS**3)
    nowhere = np.zeros(0, np.float32)
    return Belief(nowhere, nowhere, none, none)


def update_belief(belief: Belief, cues: FrameCues, model: ForegroundModel) -> Belief:
    """The belief after a frame.

    Args:
        belief: After the previous frame, whose cells are those that `cues` come from.
        cues: The cues of the frame.
        model: The trained model.
    """
    alone = model.alone.log_odds(cues.values)
    context = context_cues(belief, cues, alone)
    return belief_from_log_odds(belief, cues, alone, model.context.log_odds(context))


def belief_from_log_odds(
    belief: Belief, cues: FrameCues, alone: Floats, log_odds: Floats
) -> Belief:
    """The belief given each superpixel's log odds alone and in context, (count,) each."""
    share = _probability(log_odds)
    pixels = cues.area.astype(np.float64)
    return Belief(
        share.astype(np.float32),
        _probability(alone).astype(np.float32),
        HISTOGRAM_DECAY * belief.moving + np.bincount(cues.tone, share * pixels, BINS**3),
        HISTOGRAM_DECAY * belief.rest + np.bincount(cues.tone, (1 - share) * pixels, BINS**3),
    )


def context_cues(belief: Belief, cues: FrameCues, alone: Floats) -> Floats:
    """A frame's cues extended by those of its context, (count, CUES_IN_CONTEXT) float32.

    Args:
        belief: After the previous frame.
        cues: The cues of the frame.
        alone: (count,) float32, log odds by the cues of each superpixel alone.
    """
    before, seen = _carried(belief, cues)
    tones = _tone_odds(belief, cues.tone)
    past = np.log(
        (before + BELIEF_MARGIN)
        / (np.maximum(seen - before, 0) + BELIEF_MARGIN + 0.3 * (seen < 0.5))
    )
    near = _neighbour_means(cues, np.column_stack([alone, past, tones]))
    even = _smoothed_values(cues, np.column_stack([alone, past]))
    next_ = _neighbour_means(cues, near[:, :1])
    far = _neighbour_means(cues, _neighbour_means(cues, next_))
    share = _probability(alone)
    most = np.partition(alone, -max(len(alone) // PEAK_RANK, 1))[-max(len(alone) // PEAK_RANK, 1)]
    frame_values = _extent(before, cues.area), _extent(share, cues.area), most
    whole = [np.full(len(alone), value) for value in frame_values]
    columns = [
        cues.values,
        alone,
        *(near[:, 0], next_[:, 0], far[:, 0]),
        *(past, near[:, 1]),
        *(tones, near[:, 2]),
        *even.T,
        *_same_motion_means(cues, np.column_stack([alone, past])).T,
        *whole,
        seen,
    ]
    return np.column_stack(columns).astype(np.float32)


def _probability(log_odds: Floats) -> NDArray[Any]:
    return 1 / (1 + np.exp(-np.clip(log_odds, -MAX_LOG_ODDS, MAX_LOG_ODDS)))


def _carried(belief: Belief, cues: FrameCues) -> tuple[Floats, Floats]:
    """Belief carried along the flow to each cell, and the share of it that was in view, (count,) each."""
    count = len(cues.area)
    if not len(cues.here):
        return np.full(count, PRIOR_BELIEF, np.float32), np.zeros(count, np.float32)
    known = np.column_stack([belief.share, np.ones_like(belief.share)])
    before, seen = cues.carried(known).T
    return before, seen


def _tone_odds(belief: Belief, tone: NDArray[np.int64]) -> Floats:
    """Log odds that each cell's tone is foreground, (count,) float32; 0 while there is little data."""
    moving, rest = belief.moving.sum(), belief.rest.sum()
    if moving < FEWEST_PIXELS or rest < FEWEST_PIXELS:
        return np.zeros(len(tone), np.float32)
    foreground = smoothed_histogram(belief.moving)[tone] / moving + TONE_FLOOR
    background = smoothed_histogram(belief.rest)[tone] / rest + TONE_FLOOR
    return np.asarray(np.log(foreground / background), dtype=np.float32)


def _smoothed_values(cues: FrameCues, values: NDArray[Any]) -> Floats:
    """Values (count, K), smoothed over neighbours where a superpixel lacks texture."""
    texture = np.expm1(cues.values[:, TEXTURE : TEXTURE + 1])
    trust = np.broadcast_to(TRUST * texture / (texture + CALM), values.shape)
    return smooth_untextured(
        cues.ends,
        cues.neighbours,
        cues.affinity,
        np.ascontiguousarray(values, dtype=np.float32),
        np.ascontiguousarray(trust, dtype=np.float32),
        SWEEPS,
    )


def _same_motion_means(cues: FrameCues, values: NDArray[Any]) -> Floats:
    """Means of values (count, K) over all cells of the same motion, and its extent, (count, K + 1)."""
    areas = np.bincount(cues.part, cues.area)
    sums = [np.bincount(cues.part, cues.area * v) / np.maximum(areas, 1) for v in values.T]
    extent = np.log(SHARE_FLOOR + areas / cues.area.sum())
    return np.column_stack([*sums, extent])[cues.part].astype(np.float32)


def _neighbour_means(cues: FrameCues, values: Floats) -> Floats:
    some = np.ascontiguousarray(values, dtype=np.float32)
    return neighbour_means(cues.ends, cues.neighbours, cues.affinity, some)


def _extent(share: NDArray[Any], area: Floats) -> float:
    """Logarithm of the share of the image believed to move."""
    return float(np.log(SHARE_FLOOR + float(share @ area) / float(area.sum())))
