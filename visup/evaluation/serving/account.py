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

MOST_SHOWN = 50

Opening = tuple[int, float]
"""Number of the alert, and time of opening, seconds."""

Told = tuple[int, float, str]
"""The same with 'opened' or 'closed'."""


@dataclass(frozen=True, slots=True)
class Account:
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


class Ledger:
    """The alerts read from the journals of a camera so far.

    Args:
        camera: Folder of its runs.
    """

    def __init__(self, camera: Path) -> None:
        self._camera = camera
        self._recorded: set[Told] = set()
        self._with_evidence: set[Opening] = set()
        self._seen: dict[Path, float] = {}

    def look(self) -> None:
        """Read the present content of the store."""
        for journal in sorted(self._camera.glob(f"*/{JOURNAL}")):
            with suppress(OSError, VisupError):  # just being deleted or begun
                if journal.stat().st_size and self._is_new(journal, f"{journal}-wal"):
                    self._recorded.update(_recorded(journal.parent))
        for note in self._camera.glob(f"*/{EVIDENCE}/alert-*.json"):
            with suppress(OSError, ValueError, KeyError):
                if self._is_new(note):
                    told = json.loads(note.read_text())
                    self._with_evidence.add(_opening(told))

    def account(self, taken: Iterable[Mapping[str, Any]]) -> Account:
        """The account of the alerts of the camera.

        Args:
            taken: Records received by a sink, of any camera.
        """
        own = [
            r for r in taken if r.get("record") == "alert" and r.get("camera") == self._camera.name
        ]
        counts = Counter((*_opening(r), str(r["state"])) for r in own)
        deliveries = Counter(str(r[DELIVERY]) for r in own if DELIVERY in r)
        opened = {told[:2] for told in self._recorded}
        wrong = {
            "lost": self._recorded - set(counts),
            "twice": {told for told, n in counts.items() if n > 1},
            "unrecorded": set(counts) - self._recorded,
        }
        return Account(
            alerts=len(opened),
            lost=len(wrong["lost"]),
            twice=sum(n - 1 for n in counts.values()),
            resent=sum(n - 1 for n in deliveries.values()),
            unrecorded=len(wrong["unrecorded"]),
            without_evidence=len(opened - self._with_evidence),
            wrong=tuple(f"{how}: {told}" for how, each in wrong.items() for told in sorted(each))[
                :MOST_SHOWN
            ],
        )

    def _is_new(self, path: Path, *others: str) -> bool:
        """Whether a file was written to since it was last read."""
        when = max(p.stat().st_mtime for p in (path, *map(Path, others)) if p.exists())
        before = self._seen.get(path)
        self._seen[path] = when
        return when != before


def _opening(record: Mapping[str, Any]) -> Opening:
    return int(record["id"]), round(float(record["opened"]), 3)


def _recorded(run: Path) -> Iterator[Told]:
    """The openings and closings in a journal; an alert open across two runs is in both."""
    for alert in Recording.open(run).alerts().values():
        yield (*_opening(alert), "opened")
        if alert["closed"] is not None:
            yield (*_opening(alert), "closed")
