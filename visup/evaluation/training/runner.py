"""`visup train motion`: from folders of labelled sequences to the file that the segmenter reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import OutputError, SettingsError
from visup.evaluation.figures import Progress, silent
from visup.evaluation.motion.runner import LabelledSequence, find_sequences
from visup.evaluation.training.closed_loop import train
from visup.evaluation.training.examples import Example, collected
from visup.percepts.motion.foreground.perceptron import write_model

LIMIT = 250  # frames of a sequence that are learnt from


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
    examples = known_or_error(gathered(found_below(folders), plan, progress))
    made = {"sequences": sorted(examples), "seed": plan.seed, "limit": plan.limit}
    model = train(examples, plan.seed, progress)
    try:
        write_model(model, out, made)
    except OSError as fault:
        raise OutputError(f"cannot write: {fault.strerror}", where=str(out)) from fault


def found_below(folders: Sequence[Path]) -> dict[str, LabelledSequence]:
    """Sequences with masks below some folders, by the name of the folder and their own.

    Raises:
        SettingsError: There is nothing below one of them.
    """
    return {
        f"{folder.absolute().name}/{s.name}": s
        for folder in folders
        for s in find_sequences(folder)
        if s.masks
    }


def gathered(
    sequences: Mapping[str, LabelledSequence], plan: TrainingPlan, progress: Progress = silent
) -> dict[str, Sequence[Example]]:
    """The examples of sequences, by the same names."""
    out: dict[str, Sequence[Example]] = {}
    for name, sequence in sequences.items():
        progress(name)
        out[name] = collected(sequence, plan.limit, plan.cache)
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
