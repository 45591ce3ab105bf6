"""Pictures and clips that `visup serve` keeps of alerts, found by the number of the alert, not by a path."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path

from visup.agent.storage.text_file import read_text_file
from visup.runs.evidence.keeper import EVIDENCE, KEYS

LARGEST_NOTE = 2**20
"""Bytes of what is noted of one alert."""

_SNAPSHOT = re.compile(r"alert-(\d{1,9})\.jpg")


@dataclass(frozen=True, slots=True)
class AlertEvidence:
    """What there is of an alert.

    Attributes:
        snapshot: Its picture, or None.
        clip: Its clip, or None.
        awaited: Whether a clip is still being made.
    """

    snapshot: Path | None = None
    clip: Path | None = None
    awaited: bool = False

    def __bool__(self) -> bool:
        return self.snapshot is not None or self.clip is not None


def evidence_of(run: Path, alert: int) -> AlertEvidence:
    """The evidence of an alert of a run, if any.

    Args:
        run: Folder of the run.
        alert: Number of the alert.
    """
    folder = run / EVIDENCE
    try:
        told = json.loads(read_text_file(folder / f"alert-{alert}.json", LARGEST_NOTE))
        snapshot, clip = (folder / Path(str(told[key])).name for key in KEYS)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return AlertEvidence()
    spool = clip.with_suffix(".spool")
    return AlertEvidence(_own(snapshot, ".jpg"), _own(clip, ".webm"), bool(_own(spool, ".spool")))


def latest_snapshot(run: Path) -> int | None:
    """Number of the latest alert of a run of which there is a picture, or None."""
    try:
        found = [_SNAPSHOT.fullmatch(p.name) for p in (run / EVIDENCE).iterdir()]
    except OSError:
        return None
    numbers = (int(m[1]) for m in found if m)
    return max((n for n in numbers if evidence_of(run, n).snapshot), default=None)


def _own(path: Path, kind: str) -> Path | None:
    """A file that stands in the folder itself; links may lead anywhere."""
    try:
        fine = path.suffix == kind and path.is_file() and not path.is_symlink()
        fine = fine and not path.parent.is_symlink()
    except OSError:
        return None
    return path if fine else None
