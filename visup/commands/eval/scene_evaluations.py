"""Evaluations of perception and supervision."""

from __future__ import annotations

from inspect import Parameter
from pathlib import Path
from typing import Annotated

import typer

from visup.commands.eval import adapters
from visup.commands.eval.evaluation import (
    FOLDER,
    LIMIT,
    EvaluationCommand,
    count,
    flag,
    folder_argument,
)
from visup.commands.options import Setting
from visup.runs.settings import Option

_SEED = count("seed", 0, "Random seed.", 0)
_ADAPTERS = "visup.commands.eval.adapters"
_CLIP_NAMES = Parameter(
    "names",
    Parameter.KEYWORD_ONLY,
    default=None,
    annotation=Annotated[
        list[str] | None, typer.Argument(metavar="NAME", help="Which clips; all if none.")
    ],
)

SCENE_EVALUATIONS = (
    EvaluationCommand(
        "shapes",
        "Shape retrieval, leave one out: nearest neighbour, rank sums, bullseye, time.",
        "visup.evaluation.shape.retrieval:evaluate_shapes",
        "comparing",
        ("nn1", "rank_sum", "bullseye", "ms_shape", "ms_pair", "compared", "lost"),
        (LIMIT,),
        FOLDER,
        adapters.shapes_closing,
    ),
    EvaluationCommand(
        "missions",
        "Whole missions: identity, events, stages, alerts, verdicts, speed.",
        "visup.evaluation.missions.runner:evaluate_missions",
        "supervising",
        (
            *("identity", "event_precision", "event_recall", "event_f1", "stage"),
            *("failing_latency_s", "alerts_found", "alerts_expected", "false_alerts"),
            *("false_alerts_per_hour", "verdicts_right", "verdicts", "verdict"),
            *("view_deg", "spin_error", "fps"),
        ),
        (Setting("models", Path | None, None, Option("Model database.")), LIMIT),
        FOLDER,
    ),
    EvaluationCommand(
        "machines",
        """Machines at work, rendered and real: taught from a brief, watched, scored against ground truth.

        For comparison, OpenCV's CSRT tracks the taught boxes in the same run, with the same tasks and rules.
        """,
        "visup.evaluation.machines.runner:evaluate_machines",
        "watching",
        (
            *("verdict", "verdicts_right", "stage_f1", "stage_dated_f1", "actors"),
            *("contact_f1", "move_f1", "false_alerts_per_min", "ms"),
        ),
        (
            flag("eyes", "Take regions from the masks of the worlds, to score reasoning alone."),
            Setting(
                "baseline", bool, True, Option("Also run the CSRT baseline.", "--baseline/--alone")
            ),
            LIMIT,
        ),
        FOLDER,
        adapters.machines_closing,
    ),
    EvaluationCommand(
        "orbits",
        "Random missions in orbit: rendered, supervised, scored, discarded.",
        f"{_ADAPTERS}:random_orbits",
        "supervising",
        (
            "identity",
            "event_f1",
            "stage",
            "false_alerts",
            "verdicts_right",
            "view_deg",
            "spin_error",
        ),
        (
            count("count", 20, "Number of missions."),
            _SEED,
            count("width", 480, "Width of the image, pixels.", 64),
            count("workers", None, "Worker processes (default: one per core)."),
            LIMIT,
        ),
        closing=adapters.orbits_closing,
    ),
    EvaluationCommand(
        "random",
        """Random worlds: rendered, taught, watched, scored like machines, discarded.

        Kinds are spread evenly over the count; rows are kinds.
        """,
        f"{_ADAPTERS}:random_worlds",
        "rendering and watching",
        (
            *("verdicts_right", "verdicts", "stage_f1", "stage_dated_f1", "actors"),
            *("contact_f1", "move_f1", "false_alerts_per_min", "ms"),
        ),
        (
            Setting("kind", list[str] | None, None, Option("Which kinds; all by default.")),
            count("count", 60, "Number of worlds."),
            _SEED,
            flag("eyes", "Take regions from the masks, to score reasoning alone."),
            Setting(
                "baseline", bool, False, Option("Also run the CSRT baseline.", "--baseline/--alone")
            ),
            LIMIT,
            count("workers", None, "Worker processes (default: one per core)."),
        ),
        closing=adapters.random_closing,
    ),
    EvaluationCommand(
        "learning",
        """Tasks learned from a few good runs of random missions (by their masks), and tested on others.

        Rows are kinds of mission. Exit code 1 when a kind misses its bar: all good runs accepted, nine
        of ten bad ones refused.
        """,
        f"{_ADAPTERS}:learning",
        "watching and learning",
        ("accepted", "good", "refused", "bad", "unlike"),
        (
            Setting("kind", list[str] | None, None, Option("Which kinds; five by default.")),
            count("runs", 3, "Good runs to learn each task from."),
            count("count", 10, "Good runs of each kind to test on, and as many bad ones."),
            _SEED,
            count("workers", None, "Worker processes (default: one per core)."),
        ),
        closing=adapters.learning_closing,
        failed=adapters.learning_failed,
    ),
    EvaluationCommand(
        "health",
        "Camera faults injected into good video: found within 1 s, correctly named, false reports.",
        "visup.evaluation.health.runner:evaluate_health",
        "watching",
        (
            *("clips", "found", "named", "spread", "families", "latency_s", "early"),
            *("false_reports", "hours", "false_reports_per_hour", "ms"),
        ),
        (
            Setting("also", list[Path] | None, None, Option("Further folder with good video.")),
            count("faults", 100, "Number of faults to inject."),
            _SEED,
            count("limit", None, "Frames of each video to run without faults."),
        ),
        folder_argument("Folder with good video anywhere below it."),
    ),
    EvaluationCommand(
        "alarms",
        """Alarms on good footage watched without a task: how many of each kind per hour.

        Below the folder stand clips, or recorded runs, which are reasoned about again in seconds.
        """,
        "visup.evaluation.alarms.runner:evaluate_alarms",
        "watching",
        ("alarms", "clips", "per_hour", "hours", "noted", "lines_per_min"),
        (LIMIT,),
        folder_argument("Folder with good video, or recorded runs, anywhere below it."),
    ),
    EvaluationCommand(
        "feedback",
        """Precision of each kind of alert, from the feedback given in the console.""",
        "visup.evaluation.feedback:evaluate_feedback",
        "counting",
        ("alerts", "right", "false", "precision"),
        (),
        folder_argument("Folder with run folders anywhere below it."),
    ),
    EvaluationCommand(
        "clips",
        """Rendered clips of rare conditions: pan, shake, zoom, stops, eclipse ...

        Each has a bar. Exit code 1 when a clip misses its bar.
        """,
        f"{_ADAPTERS}:clips",
        "rendering and segmenting",
        (),
        (Setting("cache", Path, Path("runs/clips"), Option("Folder for the rendered clips.")),),
        _CLIP_NAMES,
        adapters.clips_closing,
        lambda figures: figures["total"]["passed"] < figures["total"]["clips"],
        lambda options: {"clips": options["names"] or "all"},
    ),
    EvaluationCommand(
        "crowds",
        """What a frame costs with one mover in view, and with up to forty, in processor time.

        Exit code 1 when it grows by more than the bar, 1.5.
        """,
        "visup.evaluation.motion.crowds:evaluate_crowds",
        "segmenting",
        ("ms", "ratio", "regions", "growth"),
        (count("frames", 200, "Frames for each number of movers.", 12), _SEED),
        failed=lambda figures: figures["total"]["growth"] > figures["total"]["bar"],
    ),
    EvaluationCommand(
        "scale",
        "Growing model databases: time to open and query, memory, and recall lost by the index.",
        f"{_ADAPTERS}:scale",
        "growing",
        (
            *("open_ms", "first_ms", "ms_query", "ms_search", "ms_cpu"),
            *("ms_worst", "rss_mb", "compared", "lost"),
        ),
        (count("views", 100_000, "Views of the largest database."), _SEED),
        folder_argument("Folder of meshes (*.ply)."),
        adapters.scale_closing,
    ),
    EvaluationCommand(
        "robustness",
        "Damaged database files and odd masks: must give an error, an answer or nothing within a second.",
        "tests.oracles.shape.robustness:evaluate_robustness",
        "damaging",
        ("trials", "refused", "answered", "nothing", "failed", "worst_s"),
        (
            count("files", 2000, "Number of damaged database files.", 0),
            count("masks", 2000, "Number of odd masks.", 0),
            _SEED,
        ),
        closing=adapters.failures_closing("{kind}, number {number}: {what}, {seconds:.2f} s"),
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "views",
        "Views from unseen directions: clean, with contour noise, cut by a border, both.",
        "visup.evaluation.shape.view_recognition:evaluate_views",
        "recognising",
        (),
        (
            count("views", 32, "Views of each mesh in the database."),
            flag("machines", "Add thirteen machines generated by code."),
            count("queries", 12, "Queries per mesh."),
            count("seed", 0, "Seed of the queries.", 0),
            count("limit", None, "Most meshes, for a quick look."),
        ),
        folder_argument("Folder of mesh files."),
        adapters.views_closing,
    ),
)
