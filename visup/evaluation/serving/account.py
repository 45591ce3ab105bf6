"""Every alert of all journals against every record that a sink took: what was lost, what came twice."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from visup.agent.storage.journal_reader import Recording
from visup.runs.evidence.keeper import EVIDENCE
from visup.sinks.delivery_log import DELIVERY

Told = tuple[str, int, float, str]
"""Camera, number of the alert, seconds when it opened, 'opened' or 'closed'."""


@dataclass(frozen=True, slots=True)
class Account:
    """What became of the alerts of one camera.

    Attributes:
        alerts: That are in its journals.
        lost: Openings and closings of which no record came.
        twice: Records that came more than once.
        resent: Of these, those that were sent again as nobody knew whether they had arrived.
        without_evidence: Alerts without a picture or without a clip.
    """

    alerts: int
    lost: int
    twice: int
    resent: int
    without_evidence: int


def account_of(camera: Path, taken: Iterable[Mapping[str, Any]]) -> Account:
    """What became of the alerts of a camera.

    Args:
        camera: Folder of its runs.
        taken: Records that a sink took, of any camera.
    """
    expected = set(_recorded(camera))
    own = [r for r in taken if r.get("record") == "alert" and r.get("camera") == camera.name]
    counts = Counter(_key(r) for r in own)
    extra = sum(n - 1 for n in counts.values())
    deliveries = Counter(str(r[DELIVERY]) for r in own if DELIVERY in r)
    return Account(
        alerts=sum(told[3] == "opened" for told in expected),
        lost=len(expected - set(counts)),
        twice=extra,
        resent=sum(n - 1 for n in deliveries.values()),
        without_evidence=len(list(_without_evidence(camera))),
    )


def _key(record: Mapping[str, Any]) -> Told:
    return (
        str(record["camera"]),
        int(record["id"]),
        round(float(record["opened"]), 3),
        str(record["state"]),
    )


def _recorded(camera: Path) -> Iterator[Told]:
    """What the journals of all runs say; an alert that was open when a run was followed is in two."""
    for journal in sorted(camera.glob("*/journal.sqlite")):
        if not journal.stat().st_size:
            continue  # killed before its first line, or on a full disk: nothing was told of it
        for alert in Recording.open(journal.parent).alerts().values():
            known = camera.name, int(alert["id"]), round(float(alert["opened"]), 3)
            yield (*known, "opened")
            if alert["closed"] is not None:
                yield (*known, "closed")


def _without_evidence(camera: Path) -> Iterator[Told]:
    kept = {p.stem for p in camera.glob(f"*/{EVIDENCE}/alert-*.json")}
    for told in {t[:3] for t in _recorded(camera)}:
        if f"alert-{told[1]}" not in kept:
            yield (*told, "opened")
