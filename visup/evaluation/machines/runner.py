"""`visup eval machines`: machines at work, taught from a brief, watched, and scored.

The supervisor gets the brief and the video, as from a user; `truth.json` and masks are used only for scoring,
except with `--eyes`, where masks replace perception to evaluate reasoning by itself. The baseline has the
same tasks, rules and scoring, with different perception.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from visup.agent.contract.behaviour import Behaviour
from visup.agent.cycle.agent import Agent
from visup.agent.model.errors import SettingsError
from visup.agent.model.step import Observer
from visup.evaluation.figures import Progress, silent
from visup.evaluation.machines.clips import Brief, clip_folders, read_brief, read_truth
from visup.evaluation.machines.csrt import box_behaviour
from visup.evaluation.machines.mask_regions import has_masks, mask_behaviours
from visup.evaluation.machines.recorder import MachineRecorder
from visup.evaluation.machines.scores import MachineReport, machine_scores, machine_total
from visup.runs.wiring import WatchSettings, build_agent, open_video, reasoning_agent
from visup.tasks import load_tasks
from visup.tasks.grammar.structure import task_actors
from visup.teaching.outline_teaching import store, views_of


def evaluate_machines(
    folder: Path,
    *,
    eyes: bool = False,
    baseline: bool = True,
    limit: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Figures over all clips with a brief below a folder.

    Args:
        folder: A clip, or a folder searched recursively for clips.
        eyes: Whether masks replace perception; clips without masks are skipped.
        baseline: Whether to evaluate CSRT, too.
        limit: Maximum frames of each clip; all by default.
        progress: Shows what is being done.

    Returns:
        {"total": {...}, "items": {clip: {...}}, "baseline": {...}} with the keys of the data's README;
        each item has its own `baseline`.

    Raises:
        SettingsError: There is no clip, or a brief or truth is not valid.
    """
    folders = _with_masks(folder) if eyes else clip_folders(folder)
    items: dict[str, dict[str, Any]] = {}
    for clip in folders:
        brief, truth = read_brief(clip), read_truth(clip)
        report = (watch_by_masks if eyes else watch_taught)(brief, limit)
        items[clip.name] = machine_scores(report, truth)
        progress(f"{clip.name}: {report.verdict}")
        if baseline and not eyes:
            items[clip.name]["baseline"] = machine_scores(watch_boxes(brief, limit), truth)
    figures = {"total": machine_total(list(items.values())), "items": items}
    baselines = [i["baseline"] for i in items.values() if "baseline" in i]
    return figures | ({"baseline": machine_total(baselines)} if baselines else {})


def _with_masks(folder: Path) -> list[Path]:
    folders = [f for f in clip_folders(folder) if has_masks(f)]
    if not folders:
        raise SettingsError(
            "no clip here has masks to see by",
            where=str(folder),
            expected="folders with masks/00000.png, ... beside brief.json",
            hint="leave --eyes out to see by the pictures",
        )
    return folders


def clip_settings(brief: Brief) -> WatchSettings:
    """The settings for a clip: each actor of the task is the taught thing of its name.

    Other taught things are bystanders.
    """
    roles = {a for task in load_tasks(brief.task) for a in task_actors(task)}
    taught = [o.name for o in brief.actors if o.name in roles]
    others = [o.name for o in brief.outlines if o.name not in roles]
    return WatchSettings(
        source=str(brief.video),
        tasks=(brief.task,),
        actors={name: (name,) for name in taught},
        bystanders=tuple(others),
        fov_vertical_deg=brief.fov_vertical_deg,
    )


def watch_taught(brief: Brief, limit: int | None = None) -> MachineReport:
    """Watch a clip as `visup watch` does, taught from its brief."""
    with tempfile.TemporaryDirectory() as scratch:
        models = Path(scratch) / "taught.models"
        store(models, views_of(brief.outlines))
        settings = replace(clip_settings(brief), models=models)
        return _watch(brief, settings, limit, lambda o: build_agent(settings, (o,)))


def watch_by_masks(brief: Brief, limit: int | None = None) -> MachineReport:
    """Watch a world with masks in place of perception."""
    return _watch_with(mask_behaviours(brief.folder), brief, limit)


def watch_boxes(brief: Brief, limit: int | None = None) -> MachineReport:
    """Watch a clip with the baseline."""
    return _watch_with([box_behaviour(brief)], brief, limit)


def _watch_with(behaviours: list[Behaviour], brief: Brief, limit: int | None) -> MachineReport:
    settings = clip_settings(brief)
    return _watch(brief, settings, limit, lambda o: reasoning_agent(settings, (o,), behaviours))


def _watch(
    brief: Brief, settings: WatchSettings, limit: int | None, make: Callable[[Observer], Agent]
) -> MachineReport:
    recorder = MachineRecorder([o.name for o in brief.others])
    agent = make(recorder)
    try:
        with open_video(settings) as source:
            agent.run(source, until=lambda s: limit is not None and s.frame_index + 1 >= limit)
    finally:
        agent.close()
    return recorder.report()
