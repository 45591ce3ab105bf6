"""A small lake of simulated runs: percepts are generated from the truth of missions with noise."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL
from visup.agent.storage.jsonable import to_jsonable
from visup.archive.adding import add_run
from visup.archive.lake import Lake
from visup.evaluation.figures import Progress
from visup.evaluation.simulation.percepts import PerceptNoise, observations_of
from visup.evaluation.simulation.truth_masks import Mission, load_mission
from visup.runs.settings import WatchSettings
from visup.runs.wiring import final_verdict, reasoning_agent
from visup.version import __version__


def lake_of_missions(
    folder: Path, missions: Sequence[Path], seeds: int, every: int, progress: Progress
) -> Lake:
    """A lake of missions, each simulated with several noise seeds.

    Args:
        folder: A folder for it and the journals.
        missions: Folders with `mission.json`, `truth.json` and `masks/`.
        seeds: Runs of each mission.
        every: Use every n-th frame.
        progress: Shows what is being done.

    Raises:
        SettingsError: A mission cannot be read.
    """
    lake = Lake.create(folder / "recorded")
    for number, mission_folder in enumerate(missions):
        mission = load_mission(mission_folder, every=every)
        for seed in range(seeds):
            progress(f"{mission_folder.name}, seed {seed}")
            run = folder / "runs" / f"{mission_folder.name}-{seed}"
            record_mission(run, mission, PerceptNoise(seed=seed * len(missions) + number), every)
            add_run(lake, run)
    return lake


def record_mission(run: Path, mission: Mission, noise: PerceptNoise, every: int) -> None:
    """Record a simulated run of a mission in a new folder."""
    run.mkdir(parents=True)
    description = mission.description
    settings = WatchSettings(
        f"{run.name}.mp4",
        tasks=(str(description["task"]),),
        actors={actor: (model,) for actor, model in description["actors"].items()},
    )
    agent, journal = reasoning_agent(settings), Journal(run / JOURNAL)
    facts = {"visup": __version__, "source": settings.source, "fps": mission.fps / every}
    journal.note(**facts, settings=to_jsonable(settings), live=False)
    steps = 0
    for observation, _ in observations_of(mission, noise, every=every):
        journal.record(agent.reason(observation))
        steps += 1
    journal.note(verdict=final_verdict(agent.mind).value, steps=steps)
    journal.note(ended="complete")
    journal.close()
