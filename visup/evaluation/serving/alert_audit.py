"""Compares the alerts of all journals with the records received by a sink: losses and duplicates.

A store on a small disk deletes runs soon, so the journals are read repeatedly: an alert once read counts even
if its journal is deleted later.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.model.errors import VisupError
from visup.agent.storage.journal_reader import JOURNAL, Recording
from visup.runs.evidence.keeper import EVIDENCE
from visup.sinks.delivery_log import DELIVERY

MAX_EXAMPLES = 50

Opening = tuple[int, float]
"""Number of the alert, and time of opening, seconds."""

StateChange = tuple[int, float, str]
"""The same with 'opened' or 'closed'."""


@dataclass(frozen=True, slots=True)
class AlertAudit:
    """The account of the alerts of one camera.

    Attributes:
        alerts: Number of alerts in its journals.
        lost: Openings and closings without a received record.
        twice: Records received more than once.
        resent: Of these, those with the same delivery id, resent after an unknown outcome.
        unrecorded: Received openings and closings that are in no journal.
        without_evidence: Alerts that never had a picture and a clip.
        wrong: Examples of lost, duplicate or unrecorded ones.
    """

    alerts: int
    lost: int
    twice: int
    resent: int
    unrecorded: int
    without_evidence: int
    wrong: tuple[str, ...] = ()


class AlertAuditor:
    """The alerts read from the journals of a camera so far.

    Args:
        camera: Folder of its runs.
    """

    def __init__(self, camera: Path) -> None:
        self._camera = camera
        self._recorded: set[StateChange] = set()
        self._with_evidence: set[Opening] = set()
        self._modified_at: dict[Path, float] = {}

    def read_store(self) -> None:
        """Read the present content of the store."""
        for journal in sorted(self._camera.glob(f"*/{JOURNAL}")):
            with suppress(OSError, VisupError):  # just being deleted or begun
                if journal.stat().st_size and self._is_new(journal, f"{journal}-wal"):
                    self._recorded.update(_recorded(journal.parent))
        for note in self._camera.glob(f"*/{EVIDENCE}/alert-*.json"):
            with suppress(OSError, ValueError, KeyError):
                if self._is_new(note):
                    document = json.loads(note.read_text())
                    self._with_evidence.add(_opening(document))

    def audit(self, received: Iterable[Mapping[str, Any]]) -> AlertAudit:
        """The account of the alerts of the camera.

        Args:
            received: Records received by a sink, of any camera.
        """
        own = [
            record
            for record in received
            if record.get("record") == "alert" and record.get("camera") == self._camera.name
        ]
        counts = Counter((*_opening(record), str(record["state"])) for record in own)
        deliveries = Counter(str(record[DELIVERY]) for record in own if DELIVERY in record)
        opened = {change[:2] for change in self._recorded}
        discrepancies = {
            "lost": self._recorded - set(counts),
            "twice": {change for change, n in counts.items() if n > 1},
            "unrecorded": set(counts) - self._recorded,
        }
        return AlertAudit(
            alerts=len(opened),
            lost=len(discrepancies["lost"]),
            twice=sum(n - 1 for n in counts.values()),
            resent=sum(n - 1 for n in deliveries.values()),
            unrecorded=len(discrepancies["unrecorded"]),
            without_evidence=len(opened - self._with_evidence),
            wrong=tuple(
                f"{how}: {change}"
                for how, changes in discrepancies.items()
                for change in sorted(changes)
            )[:MAX_EXAMPLES],
        )

    def _is_new(self, path: Path, *others: str) -> bool:
        """Whether a file was written to since it was last read."""
        modified_at = max(p.stat().st_mtime for p in (path, *map(Path, others)) if p.exists())
        before = self._modified_at.get(path)
        self._modified_at[path] = modified_at
        return modified_at != before


def _opening(record: Mapping[str, Any]) -> Opening:
    return int(record["id"]), round(float(record["opened"]), 3)


def _recorded(run: Path) -> Iterator[StateChange]:
    """The openings and closings in a journal; an alert open across two runs is in both."""
    for alert in Recording.open(run).alerts().values():
        yield (*_opening(alert), "opened")
        if alert["closed"] is not None:
            yield (*_opening(alert), "closed")
