"""Narratives of missions, rendered worlds, taught clips and recorded runs."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from tests.narrative.consistency import NarratedRun, narrated
from visup.agent.cycle.agent import Agent, Reasoners
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import Recording
from visup.evaluation.machines.clips import read_brief
from visup.evaluation.machines.mask_regions import mask_behaviours
from visup.evaluation.machines.runner import clip_settings
from visup.evaluation.simulation.percepts import PerceptNoise, behaviours_of, frames_of
from visup.evaluation.simulation.truth_masks import load_mission
from visup.rules.reasoners import default_reasoners
from visup.runs.replay import replay, settings_for
from visup.runs.wiring import build_agent, open_video, reasoning_agent
from visup.tasks import load_task
from visup.tasks.supervision.supervise import task_reasoner
from visup.teaching.outline_teaching import store, views_of


def narrate_mission(folder: Path, noise: PerceptNoise, every: int) -> NarratedRun:
    """The narrative of a mission on percepts simulated from its truth, of every n-th frame."""
    mission = load_mission(folder, every=every)
    behaviours, _ = behaviours_of(mission, noise)
    rules = default_reasoners()
    task = task_reasoner([load_task("dock")])
    agent = Agent(
        behaviours=behaviours,
        reasoners=Reasoners(rules.update, rules.cogitate, (task,)),
        actors={a: (m,) for a, m in mission.description["actors"].items()},
    )
    return narrated(agent.steps(frames_of(mission, every=every)))


def narrate_world(folder: Path, every: int = 1) -> NarratedRun:
    """The narrative of a rendered world, whose masks are its percepts."""
    settings = replace(clip_settings(read_brief(folder)), every=every)
    agent = reasoning_agent(settings, (), mask_behaviours(folder))
    with open_video(settings) as video:
        return narrated(agent.steps(video))


def narrate_clip(folder: Path) -> NarratedRun:
    """The narrative of a clip whose objects are taught from its brief; takes minutes."""
    brief = read_brief(folder)
    with tempfile.TemporaryDirectory() as scratch:
        models = Path(scratch) / "taught.models"
        store(models, views_of(brief.outlines))
        settings = replace(clip_settings(brief), models=models)
        agent = build_agent(settings)
        try:
            with open_video(settings) as video:
                return narrated(agent.steps(video))
        finally:
            agent.close()


def narrate_run(run: Path) -> NarratedRun:
    """The narrative of a recorded run, replayed."""
    recording, steps = Recording.open(run), list[Step]()
    replay(recording, settings_for(recording), on_step=steps.append)
    return narrated(steps)
