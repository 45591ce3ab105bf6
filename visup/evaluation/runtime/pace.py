"""Speed of reasoning: steps without perception, observers, replay, and size of stored minds.

Scripted observations, twenty rules, two tasks, with journal. Times are processor time; the median and the
lowest decile are reported, since other load makes steps slower, never faster.
"""

from __future__ import annotations

import gc
import tempfile
import time
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from visup.agent import Frame, Mind, Observation
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import SettingsError
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.agent.storage.jsonable import to_jsonable
from visup.evaluation.figures import Progress, resident_mb, silent
from visup.evaluation.runtime.scripted_observations import SIZE, drifting_boxes
from visup.runs.replay import replay, settings_for
from visup.runs.settings import WatchSettings
from visup.runs.wiring import reasoning_agent
from visup.sinks import Sinks

COUNTS = (3, 10)
"""Objects in the scripts."""
TASKS = ("dock", "inspect")
MIN_STEPS = 300
WARM_UP_STEPS = 100
"""Warm-up steps that are not measured, while objects enter and windows fill."""

RULES = """
rule near(a, b): info
    when gap(a, b) < 20 px for 0.5 s hold 1 s
    say "{a} is near {b}."
rule closing_fast(a, b): info
    when closing_speed(a, b) > 30 px/s leave 20 px/s for 0.3 s
    say "{a} closes in on {b} fast."
rule meets_soon(a, b): info
    when time_to_contact(a, b) < 3 s and converging(a, b)
    say "{a} meets {b} soon."
rule bounced(a, b): info
    when diverging(a, b) and touching(a, b) within 2 s
    say "{a} bounced off {b}."
rule overlaps(a, b): info
    when partially_overlapping(a, b) for 1 s and not coupled(a, b)
    say "{a} overlaps {b}."
rule fast(a): info
    when speed(a) > 60 px/s in 60 % of 2 s hold 1 s
    say "{a} is fast."
rule stopped(a): info
    when not moving(a) for 2 s and moving(a) within 10 s
    say "{a} has stopped."
rule gone_long(a): info
    when hidden(a) and out_of_sight(a) > 5 s
    say "{a} has been out of sight for long."
rule crowd(a): info
    when exists b: gap(a, b) < 60 px for 1 s
    say "{a} has company."
rule follows(a, b): info
    when moving_towards(a, b) and moving_away_from(b, a) for 1 s
    say "{a} follows {b}."
rule was_apart(a, b): info
    when touching(a, b) since disconnected(a, b) within 20 s
    say "{a} came to {b}."
"""
"""One for most operators; with the nine shipped rules they are twenty."""


def evaluate_pace(
    steps: int = 2000, *, kept: int = 10_000, progress: Progress = silent
) -> dict[str, Any]:
    """Measure the pace of reasoning.

    Args:
        steps: Steps of each script.
        kept: Number of consecutive minds to store.
        progress: Shows what is being done.

    Returns:
        `items` for '3 objects' and '10 objects' with `ms` and `ms_low` (median and lowest decile of
        the processor time of a step with its journal), `think_ms` (median without the journal) and
        `alerts` (open on average); `total` with `observers` (relative cost of a file and an
        unreachable webhook), `replay_fps` (frames per second of processor time) and
        `mind_kb` (resident memory of a stored mind with its regions).

    Raises:
        SettingsError: There are too few steps.
    """
    if steps < MIN_STEPS:
        raise SettingsError(f"--steps is {steps}", expected=f"at least {MIN_STEPS}")
    items: dict[str, dict[str, float]] = {}
    with tempfile.TemporaryDirectory() as scratch:
        settings = _settings(Path(scratch))
        for count in COUNTS:
            progress(f"{count} objects")
            items[f"{count} objects"] = _step_costs(
                settings, list(drifting_boxes(count, steps, count)), Path(scratch) / str(count)
            )
        progress("replay")
        fps = _replay_fps(Path(scratch) / str(COUNTS[0]))
        progress("observers")
        share = _observer_share(settings, Path(scratch) / "alerts.jsonl")
    progress(f"{kept} minds")
    total = {"observers": share, "replay_fps": fps, "mind_kb": _mind_kb(kept)}
    return {"items": items, "total": total}


def _settings(folder: Path) -> WatchSettings:
    rules = folder / "twenty.rules"
    shipped = files("visup.rules.safety").joinpath("safety.rules").read_text(encoding="utf-8")
    rules.write_text(shipped + RULES, encoding="utf-8")
    return WatchSettings("scripted", tasks=TASKS, rules=(rules,))


def _step_costs(
    settings: WatchSettings, observations: list[Observation], folder: Path
) -> dict[str, float]:
    """Cost of steps and of recording them; the journal is left in the folder."""
    folder.mkdir()
    journal = Journal(folder / JOURNAL)
    journal.note(settings=to_jsonable(settings))
    agent = reasoning_agent(settings)
    reasoning_s, step_s, alerts = [], [], []
    for observation in observations:
        begin = time.process_time()
        step = agent.reason(observation)
        reasoning_s.append(time.process_time() - begin)
        journal.record(step)
        step_s.append(time.process_time() - begin)
        alerts.append(len(step.mind.alerts))
    journal.close()
    ms = 1e3 * np.array(step_s[WARM_UP_STEPS:])
    return {
        "ms": float(np.median(ms)),
        "ms_low": float(np.percentile(ms, 10)),
        "think_ms": 1e3 * float(np.median(reasoning_s[WARM_UP_STEPS:])),
        "alerts": float(np.mean(alerts[WARM_UP_STEPS:])),
    }


def _replay_fps(folder: Path) -> float:
    """Replay speed with one task and the shipped rules."""
    recording = Recording.open(folder)
    settings = replace(settings_for(recording, tasks=TASKS[:1]), rules=())
    begin = time.process_time()
    transcript = replay(recording, settings)
    return transcript.steps / (time.process_time() - begin)


def _observer_share(settings: WatchSettings, path: Path) -> float:
    """Time of the cycle's thread in observers, relative to that of reasoning."""
    # The webhook answers nobody, and is not waited for: all is measured by then.
    sinks = Sinks([f"file:{path}", "webhook:http://127.0.0.1:9/"], "scripted", closing_s=0.2)
    blank = Frame(0, 0.0, np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
    agent = reasoning_agent(settings)
    reasoning_s, observer_s = [], []
    for observation in drifting_boxes(COUNTS[0], MIN_STEPS, 2):
        begin = time.thread_time()
        step = agent.reason(observation)
        middle = time.thread_time()
        sinks(step, blank)
        reasoning_s.append(middle - begin)
        observer_s.append(time.thread_time() - middle)
    sinks.close()
    return float(np.sum(observer_s[WARM_UP_STEPS:]) / np.sum(reasoning_s[WARM_UP_STEPS:]))


def _mind_kb(count: int) -> float:
    agent: Agent = reasoning_agent(WatchSettings("scripted"))
    minds: list[Mind] = []
    for k, observation in enumerate(drifting_boxes(COUNTS[0], WARM_UP_STEPS + count, 1)):
        if k == WARM_UP_STEPS:
            gc.collect()
            initial_mb = resident_mb()
        mind = agent.reason(observation).mind
        if k >= WARM_UP_STEPS:
            minds.append(mind)
    return 1024 * (resident_mb() - initial_mb) / len(minds)
