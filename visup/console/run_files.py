"""What a run was given that the console draws: the flows of its tasks, and its zones."""

from __future__ import annotations

from collections.abc import Mapping

from visup.agent import Zone
from visup.agent.model.errors import VisupError
from visup.runs.inputs.zones import load_zones
from visup.runs.settings import WatchSettings
from visup.tasks import load_tasks
from visup.tasks.tools.diagram import Flow, flow_of


def flows_of(settings: WatchSettings | None) -> Mapping[str, Flow]:
    """Task -> its flow; of tasks whose files are not there any more, none."""
    found: dict[str, Flow] = {}
    for place in settings.tasks if settings else ():
        try:
            found |= {task.name: flow_of(task) for task in load_tasks(place)}
        except VisupError:
            continue
    return found


def zones_of(settings: WatchSettings | None) -> tuple[Zone, ...]:
    """The zones of a run; none where their file is not there any more."""
    try:
        return load_zones(settings.zones) if settings and settings.zones else ()
    except VisupError:
        return ()
