"""`visup train motion`: trains the model file of the segmenter on folders of labelled sequences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import OutputError, SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.motion.runner import LabelledSequence, find_sequences
from visup.evaluation.training.closed_loop import train
from visup.evaluation.training.examples import Example, load_examples
from visup.percepts.motion.foreground.perceptron import write_model

MAX_FRAMES = 250  # training frames per sequence


@dataclass(frozen=True, slots=True)
class TrainingPlan:
    """The plan of a training.

    Attributes:
        cache: Folder for the cues of sequences; created if missing.
        seed: Random seed.
        limit: Maximum frames of each sequence.
    """

    cache: Path
    seed: int = 0
    limit: int = MAX_FRAMES


def train_motion(
    folders: Sequence[Path], out: Path, plan: TrainingPlan, progress: Progress = silent
) -> None:
    """Train on all sequences with masks below some folders.

    Args:
        folders: Folders of sequences as for `visup eval motion`.
        out: The model file to write.
        plan: The plan.
        progress: Shows what is being done.

    Raises:
        SettingsError: There are no training data.
        OutputError: The file cannot be written.
    """
    examples = require_ground_truth(collect_examples(sequences_below(folders), plan, progress))
    provenance = {"sequences": sorted(examples), "seed": plan.seed, "limit": plan.limit}
    model = train(examples, plan.seed, progress)
    try:
        write_model(model, out, provenance)
    except OSError as error:
        raise OutputError(f"cannot write: {error.strerror}", where=str(out)) from error


def sequences_below(folders: Sequence[Path]) -> dict[str, LabelledSequence]:
    """Sequences with masks below folders, by the names of folder and sequence.

    Raises:
        SettingsError: There is nothing below one of them.
    """
    return {
        f"{folder.absolute().name}/{s.name}": s
        for folder in folders
        for s in find_sequences(folder)
        if s.masks
    }


def collect_examples(
    sequences: Mapping[str, LabelledSequence], plan: TrainingPlan, progress: Progress = silent
) -> dict[str, Sequence[Example]]:
    """The examples of sequences by name."""
    examples: dict[str, Sequence[Example]] = {}
    for name, sequence in sequences.items():
        progress(name)
        examples[name] = load_examples(sequence, plan.limit, plan.cache)
    return examples


def require_ground_truth(
    examples: Mapping[str, Sequence[Example]],
) -> dict[str, Sequence[Example]]:
    """The sequences with ground truth.

    Raises:
        SettingsError: There are none.
    """
    labelled = {
        n: frames for n, frames in examples.items() if any(e.truth is not None for e in frames)
    }
    if not labelled:
        raise SettingsError(
            "there is nothing to learn from", expected="sequences of two frames or more with masks"
        )
    return labelled
