"""`visup eval motion --folds`: settings chosen on some families of sequences are scored on the others.

Results of each (sequence, settings, variant) are cached under a digest of the perception code, the settings
and the files of the sequence.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from visup.agent.model.errors import SettingsError, SourceError
from visup.evaluation.families import family_of, mean_and_spread
from visup.evaluation.figures import Progress, mean_of, silent
from visup.evaluation.motion.code_digest import code_digest, files_digest
from visup.evaluation.motion.folds import assign_folds, gains, select_settings
from visup.evaluation.motion.runner import LabelledSequence, find_sequences, score_sequence
from visup.evaluation.motion.variants import PLAIN, VARIANTS
from visup.evaluation.training.closed_loop import train
from visup.evaluation.training.runner import (
    TrainingPlan,
    collect_examples,
    require_ground_truth,
    sequences_below,
)
from visup.evaluation.workers import each_in_processes
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.foreground.perceptron import write_model

WEAK_J = 0.25
"""J below which a sequence counts as lost."""
UNSTABLE_J = 0.05
"""Difference of J between variants above which a sequence counts as unstable."""
CACHED_KEYS = ("J", "F", "ghost")
"""Figures that are stored in the cache."""
CODE_FOLDERS = ("agent/model", "evaluation/motion", "percepts/motion", "percepts/video")
"""Code on which results depend: when it changes, cached results are not used."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One measurement of a sequence.

    Attributes:
        sequence: The sequence.
        settings: Settings of the segmenter.
        variant: Name of the variant.
        limit: Maximum frames, or None.
        cache: Folder of cached results.
    """

    sequence: LabelledSequence
    settings: MotionSettings
    variant: str
    limit: int | None
    cache: Path


@dataclass(frozen=True, slots=True)
class FoldPlan:
    """The plan of a cross-validation.

    Attributes:
        folds: Number of folds.
        cache: Folder for cached results; created if missing.
        tries: Candidate settings besides the defaults, each as 'name=value,name=value'.
        stability: Whether to measure variants of each sequence, with the default settings.
        against: Figures of an earlier evaluation (`--json`) to compare with.
        limit: Maximum frames per sequence.
        workers: Worker processes; None for one per core.
        train: Whether to retrain the motion model for each fold on all others.
        also: Folders of further training sequences for every fold.
        seed: Random seed of training.
    """

    folds: int
    cache: Path
    tries: Sequence[str] = ()
    stability: bool = False
    against: Path | None = None
    limit: int | None = None
    workers: int | None = None
    train: bool = False
    also: Sequence[Path] = ()
    seed: int = 0


def evaluate_folds(folder: Path, plan: FoldPlan, progress: Progress = silent) -> dict[str, Any]:
    """Score the segmenter on sequences that were left out when its settings were chosen.

    Args:
        folder: As for `evaluate_motion`; only sequences with masks count.
        plan: The plan.
        progress: Shows what is being done.

    Returns:
        `items` by sequence: J, F, ghost with the settings chosen without its family, `fold`, `gain` over the
        defaults or over the figures compared with, and with `stability` `moved`, the greatest difference
        of J from that of a variant, and `most`, which variant. `total`: means, `spread` and `gain_spread`
        (standard errors over families), `weak` and `unstable` sequences. `choice`: the settings of each fold.

    Raises:
        SettingsError: Nothing can be scored, or settings are unknown.
        SourceError: The figures to compare with cannot be read.
    """
    before = _read_j(plan.against) if plan.against else None
    changes: list[dict[str, Any]] = [{}, *(parse_changes(text) for text in plan.tries)]
    sequences = {s.name: s for s in find_sequences(folder) if s.masks}
    fold_of = assign_folds(sequences, plan.folds)
    models = _train_by_fold(sequences, fold_of, plan, progress) if plan.train else {}
    configurations = [(c, PLAIN) for c in changes]
    configurations += [(changes[0], v) for v in VARIANTS if plan.stability and v != PLAIN]
    trials = {
        (name, index): Trial(
            sequence,
            replace(MotionSettings(foreground=models.get(fold_of[name])), **change),
            variant,
            plan.limit,
            plan.cache,
        )
        for index, (change, variant) in enumerate(configurations)
        for name, sequence in sequences.items()
    }
    results = dict(_measure(trials, plan.workers or os.cpu_count() or 1, progress))
    names = [name for name in sequences if "J" in results[name, 0]]
    if not names:
        raise SettingsError("no sequence has masks to be scored by", where=str(folder))
    scores_by_settings = [
        {name: results[name, k]["J"] for name in names} for k in range(len(changes))
    ]
    choice = select_settings(scores_by_settings, {name: fold_of[name] for name in names})
    items = {
        name: {**results[name, choice[fold_of[name]]], "fold": fold_of[name]} for name in names
    }
    if len(changes) > 1 or before is not None:
        left_out = {name: item["J"] for name, item in items.items()}
        for name, gain in gains(
            left_out, scores_by_settings[0] if before is None else before
        ).items():
            items[name]["gain"] = gain
    if plan.stability:
        variants = {v: k for k, (_, v) in enumerate(configurations) if v != PLAIN}
        for name in names:
            j_by_variant = {
                v: results[name, k]["J"] for v, k in variants.items() if "J" in results[name, k]
            }
            items[name] |= _instability(results[name, 0]["J"], j_by_variant)
    setting_texts = ["defaults", *plan.tries]
    return {
        "total": _total(items),
        "items": items,
        "choice": {str(f): setting_texts[k] for f, k in choice.items()},
    }


def _train_by_fold(
    sequences: Mapping[str, LabelledSequence],
    fold_of: Mapping[str, int],
    plan: FoldPlan,
    progress: Progress,
) -> dict[int, Path]:
    """The model files of the folds, each trained on all other folds and the additional sequences."""
    training = TrainingPlan(plan.cache, plan.seed)
    common = collect_examples(sequences_below(plan.also), training, progress)
    examples_by_name = collect_examples(sequences, training, progress)
    models = {}
    for number in sorted(set(fold_of.values())):
        others = {n: examples for n, examples in examples_by_name.items() if fold_of[n] != number}
        examples = require_ground_truth(common | others)
        progress(f"fold {number} of {plan.folds}")
        model = train(examples, plan.seed, progress)
        models[number] = plan.cache / f"fold-{number}-of-{plan.folds}-seed-{plan.seed}.json"
        write_model(model, models[number], {"sequences": sorted(examples), "seed": plan.seed})
    return models


def parse_changes(text: str) -> dict[str, Any]:
    """Parse settings such as 'confirm_s=0.3,evidence=0.8'.

    Raises:
        SettingsError: A setting is unknown or its value is no number.
    """
    known = {f.name: f.type for f in fields(MotionSettings) if f.type in ("bool", "int", "float")}
    changes: dict[str, Any] = {}
    for part in text.split(","):
        name, _, value = (p.strip() for p in part.partition("="))
        if name not in known:
            raise SettingsError(
                f"there is no setting {name!r} to be tried",
                where="--try",
                expected=f"name=value with one of {', '.join(known)}",
            )
        try:
            changes[name] = float(value) if known[name] == "float" else int(value)
        except ValueError:
            raise SettingsError(
                f"{value!r} is not a value for {name}", where="--try", expected="a number"
            ) from None
    return changes


def _read_j(path: Path) -> dict[str, float]:
    """J by sequence of an earlier evaluation."""
    try:
        items = json.loads(path.read_text(encoding="utf-8"))["items"]
        return {name: float(item["J"]) for name, item in items.items() if "J" in item}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise SourceError(
            "these figures cannot be read",
            where=str(path),
            expected="a file that 'visup eval motion --json' wrote",
        ) from error


def _instability(unchanged_j: float, j_by_variant: Mapping[str, float]) -> dict[str, Any]:
    """The greatest difference of J between a sequence and its variants, and which variant it is."""
    if not j_by_variant:
        return {}
    worst = max(j_by_variant, key=lambda v: abs(j_by_variant[v] - unchanged_j))
    return {
        "moved": abs(j_by_variant[worst] - unchanged_j),
        "most": worst,
        "variants": dict(j_by_variant),
    }


def _total(items: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    values = list(items.values())
    total: dict[str, Any] = {k: mean_of(values, k) for k in CACHED_KEYS}
    total["spread"] = mean_and_spread({n: i["J"] for n, i in items.items()})[1]
    total["sequences"] = len(items)
    total["families"] = len({family_of(n) for n in items})
    total["weak"] = sum(i["J"] < WEAK_J for i in values)
    if gained := {n: i["gain"] for n, i in items.items() if "gain" in i}:
        total["gain"], total["gain_spread"] = mean_and_spread(gained)
    if moved := [i["moved"] for i in values if "moved" in i]:
        total["moved"] = sum(moved) / len(moved)
        total["unstable"] = sum(m > UNSTABLE_J for m in moved)
    return total


def _measure(
    trials: Mapping[Any, Trial], workers: int, progress: Progress
) -> Iterator[tuple[Any, dict[str, Any]]]:
    """The results of trials by key, in order of completion."""
    for count, (key, figures) in enumerate(_score_all(trials, workers), 1):
        progress(f"{count} of {len(trials)}")
        yield key, figures


def _score_all(trials: Mapping[Any, Trial], workers: int) -> Iterator[tuple[Any, dict[str, Any]]]:
    for (key, _), figures in each_in_processes(_score_item, tuple(trials.items()), workers):
        yield key, figures


def _score_item(trial: tuple[Any, Trial]) -> dict[str, Any]:
    return _score(trial[1])


def _score(trial: Trial) -> dict[str, Any]:
    """The result of one trial, from the cache if available."""
    file = trial.cache / f"{_digest(trial)}.json"
    if file.is_file():
        return dict(json.loads(file.read_text(encoding="utf-8")))
    figures = score_sequence(
        trial.sequence,
        limit=trial.limit,
        settings=trial.settings,
        variant=VARIANTS[trial.variant],
    )
    scores = {k: figures[k] for k in CACHED_KEYS if k in figures}
    trial.cache.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(scores), encoding="utf-8")
    return scores


def _digest(trial: Trial) -> str:
    """The cache key of a trial."""
    digest = hashlib.sha256(code_digest(CODE_FOLDERS))
    key = (asdict(trial.settings), trial.variant, trial.limit, trial.sequence.name)
    digest.update(json.dumps(key, default=str).encode())
    if trial.settings.foreground is not None:
        digest.update(trial.settings.foreground.read_bytes())
    digest.update(files_digest(trial.sequence))
    return digest.hexdigest()
