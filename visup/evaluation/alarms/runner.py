"""`visup eval alarms`: the rate of false alarms (severity warning or above) by kind of alert.

Every clip below a folder is watched without a task. It counts as normal except for the kinds of faults that a
`truth.json` next to it expects. A recorded run is replayed in seconds instead of being watched, so that rules
can be tested on hours of footage.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from visup.agent import Severity
from visup.agent.model.step import Step
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.evaluation.figures import Progress, silent
from visup.evaluation.health.runner import find_sources
from visup.evaluation.missions.files import read_json
from visup.narrative import Narrative
from visup.runs.replay import replay, settings_for
from visup.runs.settings import WatchSettings
from visup.runs.wiring import build_agent, open_video


@dataclass(slots=True)
class AlarmCounts:
    """The alerts of one clip.

    Attributes:
        grave: Counts of alerts of severity warning or above, by kind.
        noted: Counts of those below.
        seconds: Length of the clip.
        lines: Lines of its narrative on a terminal.
    """

    grave: Counter[str] = field(default_factory=Counter)
    noted: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    lines: int = 0
    _narrative: Narrative = field(default_factory=Narrative, repr=False)

    def __call__(self, step: Step, frame: object = None) -> None:
        """Add one step; an observer."""
        self.seconds = max(self.seconds, step.time)
        self.lines += len(self._narrative.lines(step, None))
        for event in step.events:
            if event.kind == "alert":
                kinds = self.grave if event.severity >= Severity.WARNING else self.noted
                kinds[str(event.data["alert_kind"])] += 1


def evaluate_alarms(
    folder: Path,
    *,
    limit: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Count the false alarms in normal footage.

    Args:
        folder: Searched recursively for video files, folders of images and recorded runs.
        limit: Maximum frames of each watched clip, or None for all.
        progress: Shows what is being done.

    Returns:
        `items` by kind of alert with `alarms`, `clips` that raised it, and `per_hour`; `total` with the same
        of all kinds, `hours`, `noted` (alerts below a warning) and `lines_per_min` (of the narrative);
        `raised` lists the clips that did.

    Raises:
        SettingsError: There is no video or recorded run below the folder.
    """
    found: dict[str, AlarmCounts] = {}
    runs = sorted(p.parent for p in folder.rglob(JOURNAL))
    for place in runs or find_sources(folder):
        name = str(place.relative_to(folder)) if place != folder else folder.name
        progress(name)
        found[name] = _recorded(place) if runs else _watched(place, limit)
        for kind in _expected(place):
            found[name].grave.pop(kind, None)
    return alarm_rates(found)


def alarm_rates(found: Mapping[str, AlarmCounts]) -> dict[str, Any]:
    """The figures of clips by name."""
    hours = sum(c.seconds for c in found.values()) / 3600
    kinds = sorted({k for c in found.values() for k in c.grave})
    items = {
        kind: _rate([c.grave[kind] for c in found.values() if c.grave[kind]], hours)
        for kind in kinds
    }
    total = _rate([sum(c.grave.values()) for c in found.values() if c.grave.total()], hours)
    total |= {"hours": hours, "noted": sum(c.noted.total() for c in found.values())}
    lines = sum(c.lines for c in found.values())
    total["lines_per_min"] = lines / (60 * hours) if hours else 0.0
    raised = {name: dict(c.grave) for name, c in found.items() if c.grave.total()}
    return {"total": total, "items": items, "raised": raised}


def _rate(alarms: Sequence[int], hours: float) -> dict[str, Any]:
    per_hour = sum(alarms) / hours if hours else 0.0
    return {"alarms": sum(alarms), "clips": len(alarms), "per_hour": per_hour}


def _watched(source: Path, limit: int | None) -> AlarmCounts:
    counts = AlarmCounts()
    settings = WatchSettings(source=str(source))
    agent = build_agent(settings, observers=(counts,))
    with open_video(settings) as video:
        agent.run(video, until=lambda s: limit is not None and s.frame_index + 1 >= limit)
    return counts


def _recorded(run: Path) -> AlarmCounts:
    counts = AlarmCounts()
    recording = Recording.open(run)
    replay(recording, replace(settings_for(recording), tasks=(), actors={}), on_step=counts)
    return counts


def _expected(place: Path) -> set[str]:
    """The expected kinds of alerts in the truth of a clip."""
    truth = place.parent / "truth.json"
    if not truth.is_file():
        return set()
    return {str(a["kind"]) for a in read_json(truth).get("alerts") or ()}
