"""`visup train motion`: from folders of labelled sequences to the file that the segmenter reads."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import OutputError, SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.motion.runner import LabelledSequence, find_sequences
from visup.evaluation.motion.variants import PLAIN
from visup.evaluation.training.closed_loop import train
from visup.evaluation.training.examples import Example, collected
from visup.percepts.motion.foreground.perceptron import write_model

LIMIT = 250  # frames of a sequence that are learnt from
SHOWN = (PLAIN, "half the frames")
"""Variants of each sequence that are learnt from: what moves twice as far from frame to frame as well."""


@dataclass(frozen=True, slots=True)
class TrainingPlan:
    """What is learnt from, and how.

    Attributes:
        cache: Folder for the cues of sequences; made when missing.
        seed: Of all that is drawn.
        limit: Most frames of each sequence.
    """

    cache: Path
    seed: int = 0
    limit: int = LIMIT


def train_motion(
    folders: Sequence[Path], out: Path, plan: TrainingPlan, progress: Progress = silent
) -> None:
    """Train on all sequences with masks below some folders.

    Args:
        folders: Hold sequences as `visup eval motion` reads them.
        out: The file to be written.
        plan: How.
        progress: Shows what is being done.

    Raises:
        SettingsError: There is nothing to learn from.
        OutputError: The file cannot be written.
    """
    sequences = [s for folder in folders for s in find_sequences(folder) if s.masks]
    examples = gathered(sequences, plan, progress)
    made = {
        "sequences": sorted({s.name for s in sequences}),
        "seed": plan.seed,
        "limit": plan.limit,
    }
    model = train(known_or_error(examples), plan.seed, progress)
    try:
        write_model(model, out, made)
    except OSError as fault:
        raise OutputError(f"cannot write: {fault.strerror}", where=str(out)) from fault


def gathered(
    sequences: Iterable[LabelledSequence], plan: TrainingPlan, progress: Progress = silent
) -> dict[str, Sequence[Example]]:
    """The examples of sequences and of their variants, by name."""
    out: dict[str, Sequence[Example]] = {}
    for sequence in sequences:
        for variant in SHOWN:
            progress(f"{sequence.name}, {variant}")
            name = sequence.name if variant == PLAIN else f"{sequence.name} {variant}"
            out[name] = collected(sequence, variant, plan.limit, plan.cache)
    return out


def known_or_error(
    examples: Mapping[str, Sequence[Example]],
) -> dict[str, Sequence[Example]]:
    """Those sequences of which some frame has a truth.

    Raises:
        SettingsError: None has.
    """
    known = {n: found for n, found in examples.items() if any(e.truth is not None for e in found)}
    if not known:
        raise SettingsError(
            "there is nothing to learn from", expected="sequences of two frames or more with masks"
        )
    return known
