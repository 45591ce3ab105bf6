"""Recorded runs made in a moment: what is perceived is scripted, what is believed is the agent's."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.rules.scenes import box_region, seen
from visup.agent import Observation
from visup.agent.model.step import Step
from visup.agent.storage.journal import Journal
from visup.agent.storage.journal_reader import JOURNAL, Recording, export_events
from visup.agent.storage.jsonable import to_jsonable
from visup.runs.settings import WatchSettings
from visup.runs.wiring import final_verdict, reasoning_agent
from visup.version import __version__


def meeting(count: int = 60, exit_frame: int = 45, shift: float = 0.0) -> Iterator[Observation]:
    """An arm that comes up to a satellite and goes back; a third body leaves the picture."""
    for i in range(count):
        x = 100.0 + shift + 8.0 * min(i, 60 - i)
        regions = [box_region(1, (x, 200, 80, 60)), box_region(2, (400, 180, 90, 100))]
        if i < exit_frame:
            regions.append(box_region(3, (120, 20 + i, 60, 50)))
        names = {1: [("arm", 0.9), ("spartan", 0.3)], 2: [("spartan", 0.9), ("arm", 0.2)]}
        yield seen(i, regions, 10.0, names)


def record(
    folder: Path,
    observations: Iterable[Observation],
    settings: WatchSettings | None = None,
    *,
    ended: str | None = "complete",
    **facts: str,
) -> list[Step]:
    """Record a run and give its steps; further facts are noted as they are."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = settings or WatchSettings("clip.mp4")
    agent, journal = reasoning_agent(settings), Journal(folder / JOURNAL)
    journal.note(
        visup=__version__, source="clip.mp4", fps=10.0, settings=to_jsonable(settings), live=False
    )
    steps = []
    for observation in observations:
        steps.append(agent.reason(observation))
        journal.record(steps[-1])
    verdict = final_verdict(agent.mind).value if agent.mind.tasks else None
    journal.note(verdict=verdict, steps=len(steps), **facts)
    if ended:
        journal.note(ended=ended)
    journal.close()
    export_events(folder / JOURNAL, folder / "events.jsonl")
    return steps


def recorded(folder: Path, settings: WatchSettings | None = None) -> Recording:
    """A recorded run of `meeting`."""
    record(folder, meeting(), settings)
    return Recording.open(folder)
