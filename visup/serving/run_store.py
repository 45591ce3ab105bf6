"""Where a camera's runs go, and which of them goes on: a note in its folder outlives the service."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import write_whole
from visup.agent.storage.journal_reader import Recording
from visup.agent.storage.text_file import read_text_file
from visup.percepts.video import Ending

CURRENT = "current.json"
STAMP = "%Y%m%dT%H%M%SZ"


def run_under_way(folder: Path, fingerprint: str) -> Path | None:
    """The run of a camera that can go on, or None.

    Args:
        folder: Of the camera.
        fingerprint: As the camera is now: a run goes on as it was begun, or not at all.
    """
    try:
        told = json.loads(read_text_file(folder / CURRENT))
        name, begun_as = str(told["run"]), str(told["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    run = folder / name
    if begun_as != fingerprint or Path(name).name != name:
        return None
    try:
        return None if Recording.open(run).facts().get("ended") == Ending.COMPLETE else run
    except OutputError:
        return None


def begin_run(folder: Path, fingerprint: str, now: datetime | None = None) -> Path:
    """The folder of a new run, named for the time in UTC; it is not made yet, but noted.

    Args:
        folder: Of the camera; made if it is not there.
        fingerprint: As the camera is now.
        now: The time.

    Raises:
        OutputError: The folder cannot be written.
    """
    stamp = (now or datetime.now(UTC)).astimezone(UTC).strftime(STAMP)
    names = (stamp if n == 1 else f"{stamp}-{n}" for n in range(1, 10**6))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        run = next(p for name in names if not (p := folder / name).exists())
        note = json.dumps({"run": run.name, "fingerprint": fingerprint}, indent=1)
        write_whole(folder / CURRENT, note.encode() + b"\n")
    except OSError as fault:
        raise OutputError(
            f"the folder of a camera cannot be written: {fault.strerror}",
            where=str(folder),
            hint="check that the store exists, is writable and has room",
        ) from fault
    return run
