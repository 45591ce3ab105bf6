"""`visup eval motion`: all sequences below a folder, or the left-out ones of folds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from visup.commands.eval.evaluation import FOLDER, LIMIT, EvaluationCommand, count, flag
from visup.commands.options import Setting
from visup.runs.settings import Option

Figures = Mapping[str, Any]
Progress = Callable[[str], None]


def motion(folder: Path, folds: int | None, progress: Progress, **options: Any) -> Figures:
    """Evaluate segmentation and tracking, on all sequences or by folds.

    Raises:
        SettingsError: An option that belongs to folds is given without them.
    """
    if folds is not None:
        from visup.evaluation.cross_validation.runner import FoldPlan, evaluate_folds

        options |= {name: options[name] or () for name in ("tries", "also")}
        return evaluate_folds(folder, FoldPlan(folds, **options), progress)
    from visup.agent.model.errors import SettingsError
    from visup.evaluation.motion.runner import evaluate_motion

    fold_options = {"--try": "tries", "--stability": "stability", "--against": "against"}
    for option, name in (fold_options | {"--train": "train", "--also": "also"}).items():
        if options[name]:
            raise SettingsError(
                f"{option} has no effect without folds", expected="--folds N with it"
            )
    return evaluate_motion(folder, limit=options["limit"], progress=progress)


def motion_settings(options: dict[str, Any]) -> dict[str, Any]:
    """The options of `visup eval motion` that affect its figures."""
    fold_options = (
        ("folds", "tries", "stability", "train", "also", "seed")
        if options["folds"] is not None
        else ()
    )
    return {k: options[k] for k in ("limit", *fold_options)}


def motion_closing(figures: Figures) -> Iterator[str]:
    """The uncertainty of the mean over left-out sequences, and whether to adopt the tried settings."""
    total = figures["total"]
    if "spread" not in total:
        return
    yield (
        f"J {total['J']:.3f} +- {total['spread']:.3f} over {total['sequences']} sequences of "
        f"{total['families']} families; {total['weak']} below 0.25"
    )
    if "gain" in total:
        significant = total["gain"] > total["gain_spread"]
        yield (
            f"gain {total['gain']:+.3f} +- {total['gain_spread']:.3f}: "
            f"{'more' if significant else 'no more'} than its spread"
        )
    if "unstable" in total:
        yield (
            f"between variants J moves by {total['moved']:.3f} in the mean, "
            f"by more than 0.05 in {total['unstable']} sequences"
        )
    if len(set(figures["choice"].values())) > 1 or "gain" in total:
        for fold, settings in figures["choice"].items():
            yield f"fold {fold} is scored with {settings}"


MOTION = EvaluationCommand(
    "motion",
    """Segmentation and tracking: J, F, F-measure of pixels, ghosts, id switches, MOTA, IDF1, time.

    With --folds each family of sequences is scored with settings that were chosen on the others.
    """,
    "visup.commands.eval.motion:motion",
    "segmenting",
    (
        *("fold", "J", "F", "f_measure", "J_object", "ghost", "id_switches", "mota", "idf1"),
        *("gain", "moved", "most", "ms", "ratio"),
    ),
    (
        LIMIT,
        count(
            "folds",
            None,
            "Number of folds of families: settings are chosen on the others, and scored on each.",
        ),
        Setting(
            "tries",
            list[str] | None,
            None,
            Option("Settings to choose from, such as confirm_s=0.3,evidence=0.8.", "--try"),
        ),
        flag(
            "stability",
            "Also score variants: mirrored, half the frames, smaller, compressed.",
        ),
        Setting("against", Path | None, None, Option("Figures of an earlier run to compare with.")),
        flag("train", "Train the foreground model anew for each fold, on all others."),
        Setting(
            "also", list[Path] | None, None, Option("Further folder to train on, for each fold.")
        ),
        count("seed", 0, "Seed of the training.", 0),
        Setting(
            "cache", Path, Path("runs/folds"), Option("Folder for intermediate results of folds.")
        ),
    ),
    FOLDER,
    motion_closing,
    recorded=motion_settings,
)
