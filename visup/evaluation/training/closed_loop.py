"""Trains both perceptrons, the second in closed loop on contexts from the model's own beliefs.

A model is overconfident on its training data, and context made of such beliefs would teach it to trust them
too much; so the beliefs for training are those of models fitted to other families of sequences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from visup.evaluation.figures import Progress, silent
from visup.evaluation.motion.folds import dealt
from visup.evaluation.training.examples import Example
from visup.evaluation.training.fitting import Rows, fit_ensemble
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground.belief import (
    ALONE_NEAR,
    PAST,
    belief_from_log_odds,
    context_cues,
    initial_belief,
)
from visup.percepts.motion.foreground.perceptron import ForegroundModel, Perceptron

Sequences = Mapping[str, Sequence[Example]]
FOLDS = 3
ROUNDS = 2
MOST = 4000  # training superpixels per sequence
RARE = 0.03  # share of moving superpixels below which their weight is not increased further
GAIN = 0.35  # exponent of its share by which it does: at 0.5 the best J was had by believing 0.6
WHOLE = 0.7  # share of a superpixel that must have ground truth


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Training cues of all frames of a sequence, (count, D) each."""

    cues: Sequence[Floats]
    examples: Sequence[Example]


def train(sequences: Sequences, seed: int, progress: Progress = silent) -> ForegroundModel:
    """Train a model on examples.

    Args:
        sequences: Examples by name of sequence; families are derived from the names.
        seed: Random seed.
        progress: Shows what is being done.
    """
    names = sorted(sequences)
    fold = dealt(names, FOLDS)
    plain = {n: Judged([e.cues.values for e in sequences[n]], sequences[n]) for n in names}
    progress("cues alone")
    alone = fit_ensemble(_rows(plain, names, seed), seed)
    others = _crossed(plain, fold, seed)
    contexts = {
        n: _contexts(
            sequences[n], others[fold[n]], lambda c: 0.6 * c[:, ALONE_NEAR] + 0.4 * c[:, PAST]
        )
        for n in names
    }
    for number in range(ROUNDS):
        progress(f"context, round {number + 1} of {ROUNDS}")
        judges = _crossed(contexts, fold, seed)
        contexts = {
            n: _contexts(sequences[n], others[fold[n]], judges[fold[n]].log_odds) for n in names
        }
    progress("context")
    return ForegroundModel(alone, fit_ensemble(_rows(contexts, names, seed), seed))


def _crossed(
    judged: Mapping[str, Judged], fold: Mapping[str, int], seed: int
) -> dict[int, Perceptron]:
    """For each fold a perceptron fitted to all other folds, or to all if there are no others."""
    out = {}
    for number in sorted(set(fold.values())):
        rest = [n for n in judged if fold[n] != number] or list(judged)
        out[number] = fit_ensemble(_rows(judged, rest, seed), seed)
    return out


def _contexts(
    examples: Sequence[Example], alone: Perceptron, judge: Callable[[Floats], Floats]
) -> Judged:
    """The context cues of a sequence with beliefs by a classifier."""
    belief, out = initial_belief(), []
    for e in examples:
        odds = alone.log_odds(e.cues.values)
        context = context_cues(belief, e.cues, odds)
        belief = belief_from_log_odds(belief, e.cues, odds, judge(context))
        out.append(context)
    return Judged(out, examples)


def _rows(judged: Mapping[str, Judged], names: Sequence[str], seed: int) -> Rows:
    """Superpixels sampled from sequences.

    All sequences have equal weight; moving superpixels, which determine J and are rare, have more than their
    share.
    """
    rng = np.random.default_rng(seed)
    parts = [p for p in (_drawn(judged[n], rng) for n in names) if p is not None]
    return Rows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _drawn(judged: Judged, rng: np.random.Generator) -> tuple[Floats, Floats, Floats] | None:
    known = [
        (c, e.truth, e.scored, e.cues.area)
        for c, e in zip(judged.cues, judged.examples, strict=True)
        if e.truth is not None
    ]
    if not known:
        return None
    cues, truth, scored, area = (np.concatenate(column) for column in zip(*known, strict=True))
    use = np.flatnonzero(scored > WHOLE)
    if len(use) > MOST:
        use = rng.choice(use, MOST, replace=False)
    moves = truth[use] > 0.5
    weight = area[use] / area[use].sum()
    weight = weight * np.where(moves, max(float(weight[moves].sum()), RARE) ** -GAIN, 1.0)
    weight = np.asarray(weight / weight.sum(), dtype=np.float32)
    return cues[use], moves.astype(np.float32), weight
