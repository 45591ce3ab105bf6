"""Files that a run names and the console draws: its tasks as flow charts, and its zones."""

from __future__ import annotations

from collections.abc import Mapping

from visup.agent import Zone
from visup.agent.model.errors import VisupError
from visup.runs.inputs.zones import load_zones
from visup.runs.settings import WatchSettings
from visup.tasks import load_tasks
from visup.tasks.tools.diagram import Flow, flow_of


def flows_of(settings: WatchSettings | None) -> Mapping[str, Flow]:
    """Task -> its flow; tasks whose files no longer exist are left out."""
    found: dict[str, Flow] = {}
    for name in settings.tasks if settings else ():
        try:
            found |= {task.name: flow_of(task) for task in load_tasks(name)}
        except VisupError:
            continue
    return found


def zones_of(settings: WatchSettings | None) -> tuple[Zone, ...]:
    """The zones of a run; none if their file no longer exists."""
    try:
        return load_zones(settings.zones) if settings and settings.zones else ()
    except VisupError:
        return ()
