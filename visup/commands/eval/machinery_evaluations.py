"""Evaluations of reasoning, languages and the runtime by themselves: a row for each."""

from __future__ import annotations

from pathlib import Path

from visup.commands.eval import adapters
from visup.commands.eval.evaluation import EvaluationCommand, count, flag, folder_argument
from visup.commands.options import Setting
from visup.runs.settings import Option

_SEED = count("seed", 0, "Of all that is drawn.", 0)
_ADAPTERS = "visup.commands.eval.adapters"

MACHINERY_EVALUATIONS = (
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
        "archive",
        """Lakes: filled whatever is killed, found as replays say, and large ones asked fast.

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
                Option("exact, kills, large, throughput, scheduler, chunks; all if none."),
            ),
            count("formulas", 50, "exact: random conditions.", 1),
            count("every", 4, "exact, large: use every n-th frame of a mission."),
            count("kills", 4, "kills: of workers; a tenth as many of the scheduler.", 0),
            count("clips", 8, "kills: short clips."),
            count("runs", 1_000, "large: runs, of a thousand rows each."),
            count("frames", 100, "throughput: frames of each mission."),
            count("rounds", 1, "throughput: how often."),
            count("jobs", 1_000, "scheduler: jobs."),
            count("workers", 100, "scheduler: workers that sleep."),
            count("watched", 1, "chunks: missions that are watched, unbroken and cut in three."),
            Setting("models", Path | None, None, Option("chunks: model database.")),
            _SEED,
        ),
        folder_argument("A mission, or a folder of missions."),
        adapters.archive_closing,
        adapters.anything_different,
    ),
    EvaluationCommand(
        "hardening",
        """Damaged files of every kind, attacks, races of writers, cuts of power: nothing gets in or lost.

        Exit code: 0 when all were read or refused within bounds, and nothing was lost, else 1.
        """,
        "tests.oracles.hardening.runner:evaluate_hardening",
        "reading",
        ("files", "read", "refused", "raised", "slow", "crashed", "memory", "ran"),
        (
            count("count", 5000, "Damaged files of each kind; an attack for ten, at most."),
            _SEED,
            count("races", 100, "How often two writers begin at once.", 0),
            count("cuts", 1000, "How often the power is lost.", 0),
            Setting("kind", list[str] | None, None, Option("Which kinds; all if none.")),
        ),
        closing=adapters.hardening_closing,
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
        """A run of hours of scripted percepts: time of a step and memory at its start and end.

        With --traffic instead so many hours of three lanes of cars: growth of memory in the second half,
        and of the journal.
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
        """A service rehearsed: four cameras, kills, full disk, sinks down; every alert accounted for.

        Two looped files and two network cameras on loopback that stall, drop and send garbage. Exit code 1
        when an alert was lost or told twice, or a camera was away for more than 10 s after a kill.
        """,
        "visup.evaluation.serving.rehearsal:evaluate_serving",
        "rehearsing",
        (
            *("alerts", "lost", "twice", "resent", "without_evidence", "kills", "slowest_s"),
            *("median_s", "memory_growth", "frames", "dropped", "cpu"),
        ),
        (
            Setting("minutes", float, 120.0, Option("How long.", at_least=1.0)),
            Setting("kill_every", float, 60.0, Option("Seconds between kills.", at_least=5.0)),
            Setting(
                "store",
                Path | None,
                None,
                Option("An empty folder; on a disk of at most 4 GB that is filled now and then."),
            ),
            _SEED,
        ),
        closing=adapters.serving_closing,
        failed=adapters.serving_failed,
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
        "teaching",
        "What it costs that five things at rest are known: the time of a step with them, and without.",
        "visup.evaluation.machines.teaching_cost:evaluate_teaching",
        "stepping",
        ("ms", "ms_taught", "cost", "teach_s"),
        (count("frames", 400, "How many are watched.", None), _SEED),
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
