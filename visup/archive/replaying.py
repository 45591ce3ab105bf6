"""Replays recorded runs with other rules and tasks, and reports what they would have changed."""

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
    """The changes in a run.

    Attributes:
        run: Its key.
        clip: Its source.
        folder: Its folder.
        diff: Difference of the transcripts.
    """

    run: str
    clip: str
    folder: Path
    diff: TranscriptDiff

    @property
    def alerts(self) -> tuple[Mapping[str, int], Mapping[str, int]]:
        """Counts of lost and gained alerts by kind; a changed number alone makes no different alert."""
        lost, new = _alerts(self.diff.gone), _alerts(self.diff.new)
        return Counter(k for k, *_ in (lost - new).elements()), Counter(
            k for k, *_ in (new - lost).elements()
        )


@dataclass(slots=True)
class ChangeSummary:
    """The changes in all runs.

    Attributes:
        runs: Number of runs replayed.
        changed: Number of runs with any difference.
        lost: Kind of alert -> count of alerts no longer raised.
        gained: Kind of alert -> count of new alerts.
        verdicts: (before, after) -> number of runs.
    """

    runs: int = 0
    changed: int = 0
    lost: Counter[str] = field(default_factory=Counter)
    gained: Counter[str] = field(default_factory=Counter)
    verdicts: Counter[tuple[str, str]] = field(default_factory=Counter)

    def take(self, changes: RunChanges) -> None:
        """Add one run."""
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
    """Replay the reasoning of runs with other settings.

    Args:
        lake: The lake.
        runs: Keys of the runs.
        workers: Worker processes; None for one per core.
        changed: Tasks, rules, actors or zones, as in `changed_settings`.

    Yields:
        The changes in each run, including runs without any.

    Raises:
        VisupError: A run is damaged, or a file is not valid.
    """
    yield from each_run(partial(_run_changes, lake, changed), list(runs), workers)


def _run_changes(lake: Lake, changed: Mapping[str, Any], run: str) -> RunChanges:
    recording, settings = lake.recorded(run)
    replayed = replay(recording, changed_settings(settings, **changed))
    diff = transcript_diff(recorded_transcript(recording), replayed)
    return RunChanges(run, settings.source, lake.folder_of(run), diff)


def _alerts(events: Iterable[Mapping[str, Any]]) -> Counter[tuple[str, float, str]]:
    """Alerts by kind, time and sentence."""
    return Counter(
        (str(e["data"].get("alert_kind")), float(e["time"]), str(e["text"]))
        for e in events
        if e.get("kind") == ALERT
    )
