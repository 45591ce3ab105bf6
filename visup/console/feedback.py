"""Feedback on alerts: seen, right, false alarm, muted; stored beside the journal, one line each.

Nothing is ever changed in the file: the last line on an alert counts, and the ones before tell who said
what, and when.
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
LONGEST_NOTE = 500
LARGEST_FILE = 2**22
"""Bytes that are read of a file of feedback."""


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
        kind: Of the alert.
        opinion: What is said.
        note: Why, in free words.
        said: Seconds since the epoch.
    """

    alert: int
    kind: str
    opinion: Opinion
    note: str = ""
    said: float = 0.0


def read_feedback(folder: Path) -> dict[int, AlertFeedback]:
    """The last word on each alert of a run; lines that cannot be read are passed over."""
    path = folder / FEEDBACK
    if not path.is_file() or path.stat().st_size > LARGEST_FILE:
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            told = _feedback(json.loads(line))
        except (ValueError, KeyError, TypeError):
            continue
        found[told.alert] = told
    return found


def _feedback(line: Mapping[str, Any]) -> AlertFeedback:
    return AlertFeedback(
        int(line["alert"]),
        str(line["kind"]),
        Opinion(line["opinion"]),
        str(line["note"])[:LONGEST_NOTE],
        float(line["said"]),
    )


def say(folder: Path, alert: Alert, opinion: Opinion, note: str = "") -> AlertFeedback:
    """Store feedback on an alert.

    Args:
        folder: Of the run.
        alert: The alert.
        opinion: What is said; muting an alert needs a reason.
        note: Why.

    Raises:
        SettingsError: A reason is missing, or too long.
        OutputError: The folder cannot be written.
    """
    note = " ".join(note.split())
    if opinion is Opinion.MUTED and not note:
        raise SettingsError("muting an alert needs a reason", expected="a few words")
    if len(note) > LONGEST_NOTE:
        raise SettingsError("this note is too long", expected=f"at most {LONGEST_NOTE} letters")
    told = AlertFeedback(alert.id, alert.kind, opinion, note, time.time())
    try:
        with (
            only_writer(folder / FEEDBACK, "feedback on this run"),
            (folder / FEEDBACK).open("a", encoding="utf-8") as out,
        ):
            out.write(json.dumps(asdict(told), ensure_ascii=False, sort_keys=True) + "\n")
    except OSError as fault:
        raise OutputError(
            f"the note cannot be kept: {fault.strerror}", where=str(folder / FEEDBACK)
        ) from fault
    return told


@dataclass(frozen=True, slots=True)
class KindPrecision:
    """How alerts of one kind were judged.

    Attributes:
        kind: Of the alerts.
        alerts: How many there were.
        right: How many were said to be right.
        false: How many were said to be false alarms.
    """

    kind: str
    alerts: int
    right: int
    false: int

    @property
    def precision(self) -> float | None:
        """Share of right ones among the judged; None while none was judged."""
        judged = self.right + self.false
        return self.right / judged if judged else None


def precisions(
    runs: Iterable[tuple[Iterable[Alert], Mapping[int, AlertFeedback]]],
) -> tuple[KindPrecision, ...]:
    """How each kind of alert was judged over some runs, the most frequent first."""
    alerts: Counter[str] = Counter()
    said: Counter[tuple[str, Opinion]] = Counter()
    for opened, feedback in runs:
        for a in opened:
            alerts[a.kind] += 1
            if a.id in feedback:
                said[a.kind, feedback[a.id].opinion] += 1
    return tuple(
        KindPrecision(kind, n, said[kind, Opinion.RIGHT], said[kind, Opinion.FALSE_ALARM])
        for kind, n in alerts.most_common()
    )
