"""Evaluations of reasoning, the languages and the runtime in isolation."""

from __future__ import annotations

from pathlib import Path

from visup.commands.eval import adapters
from visup.commands.eval.evaluation import EvaluationCommand, count, flag, folder_argument
from visup.commands.options import Setting
from visup.runs.settings import Option

_SEED = count("seed", 0, "Random seed.", 0)
_ADAPTERS = "visup.commands.eval.adapters"

MACHINERY_EVALUATIONS = (
    EvaluationCommand(
        "faults",
        """Inject faults into behaviours: every run ends, every fault is reported, unknown never means fine.

        Exit code: 0 when that is so, else 1.
        """,
        "tests.oracles.runtime.behaviour_faults:evaluate_faults",
        "injecting",
        ("trials", "ended", "told", "unknown", "thought", "fine", "back", "over_ms"),
        (count("count", 1000, "Number of faults to inject."), _SEED),
        closing=adapters.failures_closing("number {number}, {fault} in '{kind}': {problem}"),
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "archive",
        """Lakes: complete after kills, `find` equal to replay, large lakes fast to query.

        Exit code: 0 when nothing differs that ought to be equal, else 1.
        """,
        "visup.evaluation.archive.runner:evaluate_archive",
        "archiving",
        (),
        (
            Setting(
                "part",
                list[str] | None,
                None,
                Option("exact, kills, large, throughput, scheduler or chunks; all by default."),
            ),
            count("formulas", 50, "exact: number of random conditions.", 1),
            count("every", 4, "exact, large: use every n-th frame of a mission."),
            count(
                "kills",
                4,
                "kills: workers to kill, and a tenth as many commands, and processes that start workers.",
                0,
            ),
            count("clips", 8, "kills: number of short clips."),
            count("runs", 1_000, "large: number of runs, of a thousand rows each."),
            count("frames", 100, "throughput: frames per mission."),
            count("rounds", 1, "throughput: repetitions."),
            count("jobs", 1_000, "scheduler: number of jobs."),
            count("workers", 100, "scheduler: number of workers, which only sleep."),
            count("watched", 1, "chunks: missions to watch both whole and in three chunks."),
            Setting("models", Path | None, None, Option("chunks: model database.")),
            _SEED,
        ),
        folder_argument("A mission, or a folder of missions."),
        adapters.archive_closing,
        adapters.anything_different,
    ),
    EvaluationCommand(
        "hardening",
        """Damaged files of every kind, attacks, racing writers, power cuts: nothing may get in or be lost.

        Exit code: 0 when all were read or refused within bounds, and nothing was lost, else 1.
        """,
        "tests.oracles.hardening.runner:evaluate_hardening",
        "reading",
        ("files", "read", "refused", "raised", "slow", "crashed", "memory", "ran"),
        (
            count("count", 5000, "Damaged files of each kind; at most one attack per ten."),
            _SEED,
            count("races", 100, "How often two writers start at the same time.", 0),
            count("cuts", 1000, "Number of power cuts.", 0),
            Setting("kind", list[str] | None, None, Option("Which kinds; all by default.")),
        ),
        closing=adapters.hardening_closing,
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "relations",
        "Relations of boxes: frames per second, stability at rest, drift, comparison with oracles.",
        "tests.oracles.reasoning.relations:evaluate_relations",
        "judging",
        ("fps", "fps_cpu", "plain_fps", "ratio", "changes", "seen_s"),
        (
            count("draws", 10_000, "Random pairs for the oracles."),
            Setting(
                "minutes",
                float,
                10.0,
                Option("How long boxes stay at rest, minutes.", at_least=0.1),
            ),
            _SEED,
        ),
        closing=adapters.relations_closing,
        recorded=adapters.relations_settings,
    ),
    EvaluationCommand(
        "rules",
        "Rules over time: agreement with an oracle and with rtamt; cost of windows, rules and snapshots.",
        "tests.oracles.reasoning.rules:evaluate_rules",
        "judging",
        (
            *("formulas", "samples", "online", "different", "us", "samples_per_s", "times_rtamt"),
            *("rules", "ms", "concerns", "kept", "kb_each", "slower"),
        ),
        (count("formulas", 10_000, "Number of random formulas.", 10), _SEED),
        closing=adapters.rules_closing,
        failed=adapters.rules_differ,
    ),
    EvaluationCommand(
        "peers",
        """Test cases of other tools, temporal and qualitative: agree, unknown at ends, differ.

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
        "Reasoning alone, on percepts synthesised from noisy ground truth: identity, events, verdicts.",
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
            flag("merge", "Perceive coupled objects as one region."),
            count("long", 0, "Instead, run a script of this many frames, for memory and speed.", 0),
        ),
        folder_argument("A mission, or a folder of missions."),
        adapters.reasoning_closing,
        recorded=lambda options: {k: v for k, v in options.items() if k != "jobs"},
    ),
    EvaluationCommand(
        "tasks",
        "Read damaged task files; time long files and an ordinary one.",
        "tests.oracles.reasoning.task_files:evaluate_tasks",
        "damaging",
        (),
        (
            count("count", 100_000, "Number of damaged files.", 0),
            count("seed", 0, "Seed of the first file; incremented for each.", None),
        ),
        closing=adapters.tasks_closing,
        failed=adapters.any_failures,
    ),
    EvaluationCommand(
        "recognition",
        "Recognition of random tasks: agreement with the exact oracle, robustness to noise, speed.",
        f"{_ADAPTERS}:recognition",
        "recognising",
        (),
        (
            count("grammars", 2_000, "Small grammars to compare with the exact oracle."),
            count("tasks", 20, "Tasks of 30 stages to follow."),
            count("seed", 0, "Seed of the first; incremented for each.", None),
        ),
        closing=adapters.recognition_closing,
        failed=lambda figures: not all(figures["bars"].values()),
    ),
    EvaluationCommand(
        "resume",
        "Kill runs with SIGKILL, resume them, and compare them with an uninterrupted run.",
        f"{_ADAPTERS}:resume",
        "killing",
        ("kills", "early", "resumed", "equal", "lost", "resume_s"),
        (
            count("kills", 200, "Number of runs to kill."),
            count("seed", 0, "Seed of the moments of the kills.", 0),
            flag("demo", "Kill runs of the shipped clip."),
        ),
        closing=lambda figures: iter(figures["failures"]),
        failed=adapters.resume_failed,
    ),
    EvaluationCommand(
        "soak",
        """A run of many hours on scripted percepts: step time and memory at the start and at the end.

        With --traffic, that many hours of three lanes of cars instead: memory growth in the second half,
        and journal size.
        """,
        f"{_ADAPTERS}:soak",
        "soaking",
        ("ms", "rss_mb"),
        (
            count("frames", 200_000, "Length of the run.", None),
            Setting("traffic", float, 0.0, Option("Hours of traffic.", at_least=0.0)),
        ),
        closing=adapters.totals_closing,
    ),
    EvaluationCommand(
        "serve",
        """Rehearse a service: four cameras, kills, full disk, sinks down; every alert is accounted for.

        Two looped files and two network cameras on loopback that stall, drop and send garbage. Exit code 1
        if an alert was lost or sent twice, or a camera was down for more than 10 s after a kill.
        """,
        "visup.evaluation.serving.rehearsal:evaluate_serving",
        "rehearsing",
        (
            *("alerts", "lost", "twice", "resent", "unrecorded", "without_evidence", "kills"),
            "slowest_s",
            *("median_s", "memory_growth", "frames", "dropped", "cpu"),
        ),
        (
            Setting("minutes", float, 120.0, Option("Duration.", at_least=1.0)),
            Setting("kill_every", float, 60.0, Option("Seconds between kills.", at_least=5.0)),
            Setting(
                "store",
                Path | None,
                None,
                Option(
                    "An empty or new folder; a disk of at most 4 GB is filled from time to time."
                ),
            ),
            Setting(
                "so_far", Path | None, None, Option("A file for the figures so far, each minute.")
            ),
            _SEED,
        ),
        closing=adapters.serving_closing,
        failed=adapters.serving_failed,
    ),
    EvaluationCommand(
        "stepping",
        "Going back by 500 steps: time, memory, and whether the result is identical.",
        "visup.evaluation.runtime.stepping:evaluate_stepping",
        "stepping",
        ("median_ms", "most_ms"),
        (
            count("steps", 10_000, "Number of steps to make and keep.", None),
            count("seed", 0, "Seed of the steps to go back from.", 0),
        ),
        closing=adapters.stepping_closing,
        failed=adapters.stepping_failed,
    ),
    EvaluationCommand(
        "teaching",
        "The cost of knowing five objects at rest: step time with and without them.",
        "visup.evaluation.machines.teaching_cost:evaluate_teaching",
        "stepping",
        ("ms", "ms_taught", "cost", "teach_s"),
        (count("frames", 400, "Number of frames.", None), _SEED),
    ),
    EvaluationCommand(
        "pace",
        "Step time without perception, speed of replay and observers, memory per retained mind.",
        "visup.evaluation.runtime.pace:evaluate_pace",
        "stepping",
        ("ms", "ms_low", "think_ms", "alerts", "observers", "replay_fps", "mind_kb"),
        (
            count("steps", 2000, "Length of each script.", None),
            count("kept", 10_000, "Number of minds to retain.", 100),
        ),
    ),
)
