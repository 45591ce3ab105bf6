"""What is told of clips: missions and worlds on percepts from their truth, machines as they are taught."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

from tests.story.voice import Told, told_of
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
from visup.teaching.lesson import store, views_of


def told_of_mission(folder: Path, noise: PerceptNoise, every: int) -> Told:
    """What is told of a mission on percepts made from its truth, of every so many frames."""
    mission = load_mission(folder, every=every)
    behaviours, _ = behaviours_of(mission, noise)
    rules = default_reasoners()
    task = task_reasoner([load_task("dock")])
    agent = Agent(
        behaviours=behaviours,
        reasoners=Reasoners(rules.update, rules.cogitate, (task,)),
        actors={a: (m,) for a, m in mission.description["actors"].items()},
    )
    return told_of(agent.steps(frames_of(mission, every=every)))


def told_of_world(folder: Path, every: int = 1) -> Told:
    """What is told of a rendered world, whose masks are its percepts."""
    settings = replace(clip_settings(read_brief(folder)), every=every)
    agent = reasoning_agent(settings, (), mask_behaviours(folder))
    with open_video(settings) as video:
        return told_of(agent.steps(video))


def told_of_clip(folder: Path) -> Told:
    """What is told of a clip whose things are taught from its brief: minutes for each."""
    brief = read_brief(folder)
    with tempfile.TemporaryDirectory() as scratch:
        models = Path(scratch) / "taught.models"
        store(models, views_of(brief.shown))
        settings = replace(clip_settings(brief), models=models)
        agent = build_agent(settings)
        try:
            with open_video(settings) as video:
                return told_of(agent.steps(video))
        finally:
            agent.close()


def told_of_run(run: Path) -> Told:
    """What is told of a recorded run when it is reasoned about again."""
    recording, steps = Recording.open(run), list[Step]()
    replay(recording, settings_for(recording), on_step=steps.append)
    return told_of(steps)
