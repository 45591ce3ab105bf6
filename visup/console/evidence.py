"""The pictures and clips of alerts saved by `visup serve`, looked up by alert number, never by path."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path

from visup.agent.storage.text_file import read_text_file
from visup.runs.evidence.keeper import EVIDENCE, KEYS

MAX_RECORD_BYTES = 2**20
"""Maximum size of the record of an alert, bytes."""

_SNAPSHOT = re.compile(r"alert-(\d{1,9})\.jpg")


@dataclass(frozen=True, slots=True)
class AlertEvidence:
    """The evidence of an alert.

    Attributes:
        snapshot: Its picture, or None.
        clip: Its clip, or None.
        clip_pending: Whether a clip is still being recorded.
    """

    snapshot: Path | None = None
    clip: Path | None = None
    clip_pending: bool = False

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
        record = json.loads(read_text_file(folder / f"alert-{alert}.json", MAX_RECORD_BYTES))
        snapshot, clip = (folder / Path(str(record[key])).name for key in KEYS)
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return AlertEvidence()
    spool = clip.with_suffix(".spool")
    return AlertEvidence(
        _regular_file(snapshot, ".jpg"),
        _regular_file(clip, ".webm"),
        bool(_regular_file(spool, ".spool")),
    )


def latest_snapshot(run: Path) -> int | None:
    """Number of the latest alert of a run with a picture, or None."""
    try:
        found = [_SNAPSHOT.fullmatch(p.name) for p in (run / EVIDENCE).iterdir()]
    except OSError:
        return None
    numbers = (int(m[1]) for m in found if m)
    return max((n for n in numbers if evidence_of(run, n).snapshot), default=None)


def _regular_file(path: Path, suffix: str) -> Path | None:
    """A regular file of the folder; links are refused, because they may lead anywhere."""
    try:
        is_regular = path.suffix == suffix and path.is_file() and not path.is_symlink()
        is_regular = is_regular and not path.parent.is_symlink()
    except OSError:
        return None
    return path if is_regular else None
