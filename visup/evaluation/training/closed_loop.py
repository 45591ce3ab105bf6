"""Trains both perceptrons, the second in closed loop on contexts from the model's own beliefs.

A model is overconfident on its training data, and context made of such beliefs would teach it to trust them
too much; so the beliefs for training are those of models fitted to other families of sequences.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from visup.evaluation.figures import Progress, silent
from visup.evaluation.motion.folds import assign_folds
from visup.evaluation.training.examples import Example
from visup.evaluation.training.fitting import TrainingRows, fit_ensemble
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
MAX_SUPERPIXELS = 4000  # training superpixels per sequence
MIN_MOVING_SHARE = 0.03
"""Share of moving superpixels below which their weight is not increased further."""
BALANCE_EXPONENT = 0.35
"""Moving superpixels are weighted by their share to the power of minus this. With 0.5 probabilities were too
high: J was best when only those above 0.6 counted as moving."""
MIN_LABELLED_SHARE = 0.7  # share of a superpixel that must have ground truth


@dataclass(frozen=True, slots=True, eq=False)
class TrainingCues:
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
    fold_of = assign_folds(names, FOLDS)
    cues_by_name = {
        n: TrainingCues([e.cues.values for e in sequences[n]], sequences[n]) for n in names
    }
    progress("cues alone")
    single_frame = fit_ensemble(_rows(cues_by_name, names, seed), seed)
    cue_models = _fit_by_fold(cues_by_name, fold_of, seed)
    contexts_by_name = {
        n: _with_context(
            sequences[n],
            cue_models[fold_of[n]],
            lambda c: 0.6 * c[:, ALONE_NEAR] + 0.4 * c[:, PAST],
        )
        for n in names
    }
    for number in range(ROUNDS):
        progress(f"context, round {number + 1} of {ROUNDS}")
        context_models = _fit_by_fold(contexts_by_name, fold_of, seed)
        contexts_by_name = {
            n: _with_context(
                sequences[n], cue_models[fold_of[n]], context_models[fold_of[n]].log_odds
            )
            for n in names
        }
    progress("context")
    return ForegroundModel(single_frame, fit_ensemble(_rows(contexts_by_name, names, seed), seed))


def _fit_by_fold(
    cues_by_name: Mapping[str, TrainingCues], fold_of: Mapping[str, int], seed: int
) -> dict[int, Perceptron]:
    """For each fold a perceptron fitted to all other folds, or to all if there are no others."""
    models = {}
    for number in sorted(set(fold_of.values())):
        others = [name for name in cues_by_name if fold_of[name] != number] or list(cues_by_name)
        models[number] = fit_ensemble(_rows(cues_by_name, others, seed), seed)
    return models


def _with_context(
    examples: Sequence[Example], cue_model: Perceptron, context_log_odds: Callable[[Floats], Floats]
) -> TrainingCues:
    """The context cues of a sequence with beliefs by a classifier."""
    belief, contexts = initial_belief(), []
    for example in examples:
        cue_log_odds = cue_model.log_odds(example.cues.values)
        context = context_cues(belief, example.cues, cue_log_odds)
        belief = belief_from_log_odds(belief, example.cues, cue_log_odds, context_log_odds(context))
        contexts.append(context)
    return TrainingCues(contexts, examples)


def _rows(
    cues_by_name: Mapping[str, TrainingCues], names: Sequence[str], seed: int
) -> TrainingRows:
    """Superpixels sampled from sequences.

    All sequences have equal weight; moving superpixels, which determine J and are rare, have more than their
    share.
    """
    rng = np.random.default_rng(seed)
    parts = [p for p in (_sample_superpixels(cues_by_name[n], rng) for n in names) if p is not None]
    return TrainingRows(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _sample_superpixels(
    sequence: TrainingCues, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats] | None:
    labelled = [
        (c, e.truth, e.scored, e.cues.area)
        for c, e in zip(sequence.cues, sequence.examples, strict=True)
        if e.truth is not None
    ]
    if not labelled:
        return None
    cues, truth, scored, area = (np.concatenate(column) for column in zip(*labelled, strict=True))
    chosen = np.flatnonzero(scored > MIN_LABELLED_SHARE)
    if len(chosen) > MAX_SUPERPIXELS:
        chosen = rng.choice(chosen, MAX_SUPERPIXELS, replace=False)
    moving = truth[chosen] > 0.5
    weight = area[chosen] / area[chosen].sum()
    weight = weight * np.where(
        moving, max(float(weight[moving].sum()), MIN_MOVING_SHARE) ** -BALANCE_EXPONENT, 1.0
    )
    weight = np.asarray(weight / weight.sum(), dtype=np.float32)
    return cues[chosen], moving.astype(np.float32), weight
