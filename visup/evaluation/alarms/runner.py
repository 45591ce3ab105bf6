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
        severe: Counts of alerts of severity warning or above, by kind.
        minor: Counts of those below.
        seconds: Length of the clip.
        lines: Lines of its narrative on a terminal.
    """

    severe: Counter[str] = field(default_factory=Counter)
    minor: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0
    lines: int = 0
    _narrative: Narrative = field(default_factory=Narrative, repr=False)

    def __call__(self, step: Step, frame: object = None) -> None:
        """Add one step; an observer."""
        self.seconds = max(self.seconds, step.time)
        self.lines += len(self._narrative.lines(step, None))
        for event in step.events:
            if event.kind == "alert":
                kinds = self.severe if event.severity >= Severity.WARNING else self.minor
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
    counts: dict[str, AlarmCounts] = {}
    runs = sorted(p.parent for p in folder.rglob(JOURNAL))
    for source in runs or find_sources(folder):
        name = str(source.relative_to(folder)) if source != folder else folder.name
        progress(name)
        counts[name] = _replay_run(source) if runs else _watch_clip(source, limit)
        for kind in _expected_kinds(source):
            counts[name].severe.pop(kind, None)
    return alarm_rates(counts)


def alarm_rates(counts_by_clip: Mapping[str, AlarmCounts]) -> dict[str, Any]:
    """The figures of clips by name."""
    hours = sum(c.seconds for c in counts_by_clip.values()) / 3600
    kinds = sorted({kind for c in counts_by_clip.values() for kind in c.severe})
    items = {
        kind: _rate([c.severe[kind] for c in counts_by_clip.values() if c.severe[kind]], hours)
        for kind in kinds
    }
    total = _rate(
        [sum(c.severe.values()) for c in counts_by_clip.values() if c.severe.total()], hours
    )
    total |= {"hours": hours, "noted": sum(c.minor.total() for c in counts_by_clip.values())}
    lines = sum(c.lines for c in counts_by_clip.values())
    total["lines_per_min"] = lines / (60 * hours) if hours else 0.0
    raised = {name: dict(c.severe) for name, c in counts_by_clip.items() if c.severe.total()}
    return {"total": total, "items": items, "raised": raised}


def _rate(alarms: Sequence[int], hours: float) -> dict[str, Any]:
    per_hour = sum(alarms) / hours if hours else 0.0
    return {"alarms": sum(alarms), "clips": len(alarms), "per_hour": per_hour}


def _watch_clip(source: Path, limit: int | None) -> AlarmCounts:
    counts = AlarmCounts()
    settings = WatchSettings(source=str(source))
    agent = build_agent(settings, observers=(counts,))
    with open_video(settings) as video:
        agent.run(video, until=lambda s: limit is not None and s.frame_index + 1 >= limit)
    return counts


def _replay_run(run: Path) -> AlarmCounts:
    counts = AlarmCounts()
    recording = Recording.open(run)
    replay(recording, replace(settings_for(recording), tasks=(), actors={}), on_step=counts)
    return counts


def _expected_kinds(source: Path) -> set[str]:
    """The expected kinds of alerts in the truth of a clip."""
    truth = source.parent / "truth.json"
    if not truth.is_file():
        return set()
    return {str(alert["kind"]) for alert in read_json(truth).get("alerts") or ()}
