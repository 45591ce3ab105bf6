"""Feedback on alerts: seen, right, false alarm, muted; stored next to the journal, one line each.

The file is append-only: the last line on an alert counts, and the earlier ones are its history.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from visup.agent import Alert
from visup.agent.model.errors import OutputError, SettingsError
from visup.agent.storage.file_lock import only_writer

FEEDBACK = "feedback.jsonl"
MAX_NOTE_LENGTH = 500
MAX_FILE_BYTES = 2**22
"""Maximum size of a feedback file, bytes."""


class Opinion(StrEnum):
    """Kinds of feedback."""

    SEEN = "seen"
    RIGHT = "right"
    FALSE_ALARM = "false alarm"
    MUTED = "muted"


@dataclass(frozen=True, slots=True)
class AlertFeedback:
    """Feedback on one alert.

    Attributes:
        alert: Its number within the run.
        kind: Kind of the alert.
        opinion: The feedback.
        note: Reason, free text.
        said: Time of the feedback, seconds since the epoch.
    """

    alert: int
    kind: str
    opinion: Opinion
    note: str = ""
    said: float = 0.0


def read_feedback(folder: Path) -> dict[int, AlertFeedback]:
    """The latest feedback on each alert of a run; invalid lines are skipped."""
    path = folder / FEEDBACK
    if not path.is_file() or path.stat().st_size > MAX_FILE_BYTES:
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            feedback = _feedback(json.loads(line))
        except (ValueError, KeyError, TypeError):
            continue
        found[feedback.alert] = feedback
    return found


def _feedback(record: Mapping[str, Any]) -> AlertFeedback:
    return AlertFeedback(
        int(record["alert"]),
        str(record["kind"]),
        Opinion(record["opinion"]),
        str(record["note"])[:MAX_NOTE_LENGTH],
        float(record["said"]),
    )


def store_feedback(folder: Path, alert: Alert, opinion: Opinion, note: str = "") -> AlertFeedback:
    """Store feedback on an alert.

    Args:
        folder: Folder of the run.
        alert: The alert.
        opinion: The feedback; muting an alert needs a reason.
        note: Reason.

    Raises:
        SettingsError: A reason is missing, or too long.
        OutputError: The folder cannot be written.
    """
    note = " ".join(note.split())
    if opinion is Opinion.MUTED and not note:
        raise SettingsError("muting an alert needs a reason", expected="a few words")
    if len(note) > MAX_NOTE_LENGTH:
        raise SettingsError("this note is too long", expected=f"at most {MAX_NOTE_LENGTH} letters")
    feedback = AlertFeedback(alert.id, alert.kind, opinion, note, time.time())
    try:
        with (
            only_writer(folder / FEEDBACK, "feedback on this run"),
            (folder / FEEDBACK).open("a", encoding="utf-8") as out,
        ):
            out.write(json.dumps(asdict(feedback), ensure_ascii=False, sort_keys=True) + "\n")
    except OSError as fault:
        raise OutputError(
            f"the note cannot be kept: {fault.strerror}", where=str(folder / FEEDBACK)
        ) from fault
    return feedback


@dataclass(frozen=True, slots=True)
class KindPrecision:
    """The feedback on alerts of one kind.

    Attributes:
        kind: Kind of the alerts.
        alerts: Number of alerts.
        right: Number confirmed.
        false: Number of false alarms.
    """

    kind: str
    alerts: int
    right: int
    false: int

    @property
    def precision(self) -> float | None:
        """Share of confirmed alerts among those with feedback; None without feedback."""
        rated = self.right + self.false
        return self.right / rated if rated else None


def precisions(
    runs: Iterable[tuple[Iterable[Alert], Mapping[int, AlertFeedback]]],
) -> tuple[KindPrecision, ...]:
    """The precision of each kind of alert over some runs, the most frequent first."""
    alerts: Counter[str] = Counter()
    counts: Counter[tuple[str, Opinion]] = Counter()
    for run_alerts, feedback in runs:
        for a in run_alerts:
            alerts[a.kind] += 1
            if a.id in feedback:
                counts[a.kind, feedback[a.id].opinion] += 1
    return tuple(
        KindPrecision(kind, n, counts[kind, Opinion.RIGHT], counts[kind, Opinion.FALSE_ALARM])
        for kind, n in alerts.most_common()
    )
