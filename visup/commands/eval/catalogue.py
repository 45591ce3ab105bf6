"""The evaluations; the commands of `visup eval` are made from these tables."""

from __future__ import annotations

import typer

<<<<<<< HEAD
from visup.commands.eval.machinery_evaluations import MACHINERY_EVALUATIONS
from visup.commands.eval.scene_evaluations import SCENE_EVALUATIONS

EVALUATIONS = (*SCENE_EVALUATIONS, *MACHINERY_EVALUATIONS)
=======
from visup.commands.eval import adapters
from visup.commands.eval.evaluation import (
    FOLDER,
    LIMIT,
    EvaluationCommand,
    count,
    flag,
    folder_argument,
)
from visup.commands.eval.motion import MOTION
from visup.commands.options import Setting
from visup.runs.settings import Option

_SEED = count("seed", 0, "Of all that is drawn.", 0)
_CLIP_NAMES = Parameter(
    "names",
    Parameter.KEYWORD_ONLY,
    default=None,
    annotation=Annotated[
        list[str] | None, typer.Argument(metavar="NAME", help="Which clips; all if none.")
    ],
)
_ADAPTERS = "visup.commands.eval.adapters"

EVALUATIONS = (
    MOTION,
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
        """Machines at work, rendered and real: taught from a brief, watched, scored against the truth.

        Beside it, in the same run: OpenCV's CSRT on the taught boxes, with the same tasks and rules.
        """,
        "visup.evaluation.machines.runner:evaluate_machines",
        "watching",
        (
            *("verdict", "verdicts_right", "stage_f1", "actors"),
            *("contact_f1", "move_f1", "false_alerts_per_min", "ms"),
        ),
        (
            flag("eyes", "Regions are made from the masks of worlds: reasoning by itself."),
            Setting("baseline", bool, True, Option("Let CSRT watch, too.", "--baseline/--alone")),
            LIMIT,
        ),
        FOLDER,
        adapters.machines_closing,
    ),
    EvaluationCommand(
        "random",
        """Worlds drawn from a seed: rendered, taught, watched, scored like machines, thrown away.

        Kinds are spread evenly over the count; rows are kinds.
        """,
        f"{_ADAPTERS}:random_worlds",
        "rendering and watching",
        (
            *("verdicts_right", "verdicts", "stage_f1", "actors"),
            *("contact_f1", "move_f1", "false_alerts_per_min", "ms"),
        ),
        (
            Setting("kind", list[str] | None, None, Option("Which kinds; all if none.")),
            count("count", 60, "How many worlds."),
            _SEED,
            flag("eyes", "Regions are made from the masks: reasoning by itself."),
            Setting("baseline", bool, False, Option("Let CSRT watch, too.", "--baseline/--alone")),
            LIMIT,
            count("workers", None, "Processes that share the work; as many as there are cores."),
        ),
        closing=adapters.random_closing,
    ),
    EvaluationCommand(
        "health",
        "Camera faults put into sound video: found within 1 s, rightly named, false reports.",
        "visup.evaluation.health.runner:evaluate_health",
        "watching",
        (
            *("clips", "found", "named", "latency_s", "early"),
            *("false_reports", "hours", "false_reports_per_hour", "ms"),
        ),
        (
            count("faults", 100, "How many faults are injected."),
            _SEED,
            count("limit", None, "Frames of each video when it is run unharmed."),
        ),
        folder_argument("Folder with sound video anywhere below it."),
    ),
    EvaluationCommand(
        "alarms",
        """Alarms on sound footage, watched without a task: how many of each kind an hour.

        Below the folder stand clips, or recorded runs, which are reasoned about again in seconds.
        """,
        "visup.evaluation.alarms.runner:evaluate_alarms",
        "watching",
        ("alarms", "clips", "per_hour", "hours", "noted", "lines_per_min"),
        (LIMIT,),
        folder_argument("Folder with sound video, or recorded runs, anywhere below it."),
    ),
    EvaluationCommand(
        "clips",
        """Rendered clips of what footage lacks: pan, shake, zoom, stops, eclipse ...

        Each has a bar. Exit code 1 when a clip misses its bar.
        """,
        f"{_ADAPTERS}:clips",
        "rendering and segmenting",
        (),
        (Setting("cache", Path, Path("runs/clips"), Option("Folder for the rendered clips.")),),
        _CLIP_NAMES,
        adapters.clips_closing,
        lambda figures: figures["total"]["passed"] < figures["total"]["clips"],
        lambda given: {"clips": given["names"] or "all"},
    ),
    EvaluationCommand(
        "scale",
        "Model databases that grow: opening, answering, memory, and what the index loses.",
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
        "Damaged database files and odd masks: a clear error, an answer or nothing, within a second.",
        "tests.oracles.shape.robustness:evaluate_robustness",
        "damaging",
        ("trials", "refused", "answered", "nothing", "failed", "worst_s"),
        (
            count("files", 2000, "How many damaged database files.", 0),
            count("masks", 2000, "How many odd masks.", 0),
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
            count("queries", 12, "Silhouettes asked for of each mesh."),
            count("seed", 0, "Of the queries.", 0),
            count("limit", None, "Meshes, for a quick look."),
        ),
        folder_argument("Folder of mesh files."),
        adapters.views_closing,
    ),
    EvaluationCommand(
        "faults",
        """Faults put into behaviours: every run ends, every fault is told, nothing unknown reads fine.

        Exit code: 0 when that is so, else 1.
        """,
        "tests.oracles.runtime.behaviour_faults:evaluate_faults",
        "injecting",
        ("trials", "ended", "told", "unknown", "thought", "fine", "back", "over_ms"),
        (count("count", 1000, "How many faults are injected."), _SEED),
        closing=adapters.failures_closing("number {number}, {fault} in '{kind}': {problem}"),
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "hardening",
        """Damaged and hostile files of every kind, and races of writers: nothing gets in, nothing gets lost.

        Exit code: 0 when all were read or refused within bounds, and nothing was lost, else 1.
        """,
        "tests.oracles.hardening.runner:evaluate_hardening",
        "reading",
        ("files", "read", "refused", "raised", "slow", "crashed", "memory", "ran"),
        (
            count("count", 5000, "Damaged files of each kind."),
            _SEED,
            count("races", 100, "How often two writers begin at once.", 0),
            Setting("kind", list[str] | None, None, Option("Which kinds; all if none.")),
        ),
        closing=adapters.failures_closing("{text}"),
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "relations",
        "Relations of boxes: frames per second, changes of what rests, drift, oracles.",
        "tests.oracles.reasoning.relations:evaluate_relations",
        "judging",
        ("fps", "fps_cpu", "plain_fps", "ratio", "changes", "seen_s"),
        (
            count("draws", 10_000, "Random pairs for the oracles."),
            Setting("minutes", float, 10.0, Option("How long boxes rest.", at_least=0.1)),
            _SEED,
        ),
        closing=adapters.relations_closing,
        recorded=adapters.relations_settings,
    ),
    EvaluationCommand(
        "rules",
        "Rules over time: equal to an oracle and to rtamt, cost of windows, of rules, of snapshots.",
        "tests.oracles.reasoning.rules:evaluate_rules",
        "judging",
        (
            *("formulas", "samples", "online", "different", "us", "samples_per_s", "times_rtamt"),
            *("rules", "ms", "concerns", "kept", "kb_each", "slower"),
        ),
        (count("formulas", 10_000, "How many random formulas.", 10), _SEED),
        closing=adapters.rules_closing,
        failed=adapters.rules_differ,
    ),
    EvaluationCommand(
        "peers",
        """Cases of other tools' own tests, temporal and qualitative: agree, unknown at ends, differ.

        Exit code 1 when a case differs beyond the semantics that docs/coming-from.md states.
        """,
        "tests.oracles.peers.runner:evaluate_peers",
        "judging",
        (
            *("cases", "agree", "unknown_at_ends", "other_semantics"),
            *("differ", "not_expressible"),
        ),
        (),
        folder_argument("Folder with temporal.json and qualitative.json."),
        adapters.peers_closing,
        adapters.peers_differ,
    ),
    EvaluationCommand(
        "reasoning",
        "Reasoning alone, on percepts made from the truth with noise: identity, events, verdicts.",
        f"{_ADAPTERS}:reasoning",
        "reasoning",
        (
            *("identity", "event_precision", "event_recall", "event_f1", "false_coupled"),
            *("false_exit", "ece", "spin_error", "stage", "failing_latency_s", "alerts_found"),
            *("alerts_expected", "false_alerts", "verdicts_right", "verdicts"),
            # Of a long script:
            *("frames", "ms", "ms_ten", "rss_mb", "grown", "snapshot_kb"),
        ),
        (
            count("seeds", 20, "Runs of each mission."),
            count("first", 0, "The first seed.", 0),
            count("every", 1, "Use every n-th frame."),
            count("jobs", 2, "Processes."),
            flag("merge", "Coupled objects are seen as one region."),
            count("long", 0, "Instead: so many frames of a script, for memory and speed.", 0),
        ),
        folder_argument("A mission, or a folder of missions."),
        adapters.reasoning_closing,
        recorded=lambda given: {k: v for k, v in given.items() if k != "jobs"},
    ),
    EvaluationCommand(
        "tasks",
        "Damage task files and read them; time long files and a usual one.",
        "tests.oracles.reasoning.task_files:evaluate_tasks",
        "damaging",
        (),
        (
            count("count", 100_000, "How many damaged files are read.", 0),
            count("seed", 0, "Seed of the first; one more for each file.", None),
        ),
        closing=adapters.tasks_closing,
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "recognition",
        "Recognise random tasks: as the exact oracle does, seen badly, and fast.",
        f"{_ADAPTERS}:recognition",
        "recognising",
        (),
        (
            count("grammars", 2_000, "Small grammars compared with the exact oracle."),
            count("tasks", 20, "Tasks of 30 stages that are followed."),
            count("seed", 0, "Seed of the first; one more for each.", None),
        ),
        closing=adapters.recognition_closing,
        failed=lambda figures: not all(figures["bars"].values()),
    ),
    EvaluationCommand(
        "resume",
        "Kill runs with SIGKILL, resume them, and compare them with an unbroken run.",
        f"{_ADAPTERS}:resume",
        "killing",
        ("kills", "early", "resumed", "equal", "lost", "resume_s"),
        (
            count("kills", 200, "How many runs are killed."),
            count("seed", 0, "Of the moments.", 0),
            flag("demo", "Kill runs of the shipped clip."),
        ),
        closing=lambda figures: iter(figures["failures"]),
        failed=adapters.resume_failed,
    ),
    EvaluationCommand(
        "soak",
        "A run of hours of scripted percepts: time of a step and memory at its start and end.",
        "visup.evaluation.runtime.soak:evaluate_soak",
        "soaking",
        ("ms", "rss_mb"),
        (count("frames", 200_000, "Length of the run.", None),),
        closing=adapters.totals_closing,
    ),
    EvaluationCommand(
        "stepping",
        "Going back by 500 steps: its time, the memory that it takes, and whether it leads to the same.",
        "visup.evaluation.runtime.stepping:evaluate_stepping",
        "stepping",
        ("median_ms", "most_ms"),
        (
            count("steps", 10_000, "How many are made and kept.", None),
            count("seed", 0, "Of the places to go back from.", 0),
        ),
        closing=adapters.stepping_closing,
        failed=adapters.stepping_failed,
    ),
    EvaluationCommand(
        "pace",
        "The time of a step without perception, of replay and observers, and what a kept mind takes.",
        "visup.evaluation.runtime.pace:evaluate_pace",
        "stepping",
        ("ms", "ms_low", "think_ms", "alerts", "observers", "replay_fps", "mind_kb"),
        (
            count("steps", 2000, "Length of each script.", None),
            count("kept", 10_000, "Minds that are kept in a row.", 100),
        ),
    ),
)
>>>>>>> main


def eval_app() -> typer.Typer:
    """The commands of `visup eval`."""
    app = typer.Typer(no_args_is_help=True)
    for evaluation in EVALUATIONS:
        app.command(evaluation.name)(evaluation.command())
    return app
