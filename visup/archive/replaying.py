"""Other rules and tasks on the past: what they would have changed, run by run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from visup.archive.lake import Lake
from visup.archive.parallel import each_run
from visup.runs.replay import (
    TranscriptDiff,
    changed_settings,
    recorded_transcript,
    replay,
    transcript_diff,
)

ALERT = "alert"


@dataclass(frozen=True, slots=True)
class RunChanges:
    """What changes of a run.

    Attributes:
        run: Its key.
        clip: What was watched.
        folder: Where it can be opened.
        diff: What is told otherwise.
    """

    run: str
    clip: str
    folder: Path
    diff: TranscriptDiff

    @property
    def alerts(self) -> tuple[Mapping[str, int], Mapping[str, int]]:
        """How many alerts of each kind are lost, and gained; another number makes no other alert."""
        gone, new = _alerts(self.diff.gone), _alerts(self.diff.new)
        return Counter(k for k, *_ in (gone - new).elements()), Counter(
            k for k, *_ in (new - gone).elements()
        )


@dataclass(slots=True)
class ChangeSummary:
    """What changes in all runs.

    Attributes:
        runs: How many were looked into.
        changed: How many of them tell anything otherwise.
        lost: Kind of alert -> how many are no longer raised.
        gained: Kind of alert -> how many are raised that were not.
        verdicts: (before, after) -> runs whose verdict changes so.
    """

    runs: int = 0
    changed: int = 0
    lost: Counter[str] = field(default_factory=Counter)
    gained: Counter[str] = field(default_factory=Counter)
    verdicts: Counter[tuple[str, str]] = field(default_factory=Counter)

    def take(self, changes: RunChanges) -> None:
        """Count one run."""
        self.runs += 1
        self.changed += bool(changes.diff)
        lost, gained = changes.alerts
        self.lost.update(lost)
        self.gained.update(gained)
        before, after = changes.diff.verdicts
        if before != after:
            self.verdicts[before or "none", after or "none"] += 1

    def lines(self) -> Iterator[str]:
        """The summary in words."""
        yield f"Runs: {self.runs}, of which {self.changed} change."
        for kind in sorted({*self.lost, *self.gained}):
            yield f"  alerts {kind}: {self.lost[kind]} lost, {self.gained[kind]} gained"
        for (before, after), count in sorted(self.verdicts.items()):
            yield f"  verdict {before} -> {after}: {count}"


def changes(
    lake: Lake, runs: Iterable[str], workers: int | None = 0, **changed: Any
) -> Iterator[RunChanges]:
    """Reason again about runs of a lake, with other settings.

    Args:
        lake: The lake.
        runs: Their keys.
        workers: Processes that share them; None for one for each core.
        changed: Tasks, rules, actors or zones, as of `changed_settings`.

    Yields:
        What changes of each run; also of those of which nothing does.

    Raises:
        VisupError: A run is damaged, or a file is not as it should be.
    """
    yield from each_run(partial(_run_changes, lake, changed), list(runs), workers)


def _run_changes(lake: Lake, changed: Mapping[str, Any], run: str) -> RunChanges:
    recording, settings = lake.recorded(run)
    told = replay(recording, changed_settings(settings, **changed))
    diff = transcript_diff(recorded_transcript(recording), told)
    return RunChanges(run, settings.source, lake.folder_of(run), diff)


def _alerts(events: Iterable[Mapping[str, Any]]) -> Counter[tuple[str, float, str]]:
    """Alerts by kind, time and sentence."""
    return Counter(
        (str(e["data"].get("alert_kind")), float(e["time"]), str(e["text"]))
        for e in events
        if e.get("kind") == ALERT
    )
