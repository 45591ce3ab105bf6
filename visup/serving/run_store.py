"""The folders of a camera's runs; a note in the camera's folder names the one to resume after a restart."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import write_atomically
from visup.agent.storage.journal_reader import Recording
from visup.agent.storage.text_file import read_text_file
from visup.percepts.video import Ending
from visup.runs.unattended.next_run import ROLLED

CURRENT = "current.json"
STAMP = "%Y%m%dT%H%M%SZ"
_RUN = re.compile(r"\d{8}T\d{6}Z(-\d+)?")
_OVER = (Ending.COMPLETE.value, ROLLED)


@dataclass(frozen=True, slots=True)
class RunStore:
    """The runs of one camera.

    Attributes:
        folder: Folder of the camera.
        fingerprint: Fingerprint of the camera's present settings.
    """

    folder: Path
    fingerprint: str

    def next_folder(self) -> Path:
        """A folder for a further run."""
        return free_run_folder(self.folder)

    def set_current(self, run: Path) -> None:
        """Make this the run that the next process resumes."""
        set_current_run(run, self.fingerprint)


def resumable_run(folder: Path, fingerprint: str) -> Path | None:
    """The run of a camera that can be resumed, or None.

    Args:
        folder: Folder of the camera.
        fingerprint: Fingerprint of the camera's present settings; a run resumes only under its own.
    """
    try:
        current = json.loads(read_text_file(folder / CURRENT))
        name, current_fingerprint = str(current["run"]), str(current["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
    run = folder / name
    if current_fingerprint != fingerprint or Path(name).name != name:
        return None
    try:
        return None if Recording.open(run).facts().get("ended") in _OVER else run
    except OutputError:
        return None


def begin_run(folder: Path, fingerprint: str, now: datetime | None = None) -> Path:
    """A folder for a new run, named for the time in UTC; it is noted but not yet created.

    Args:
        folder: Folder of the camera; created if missing.
        fingerprint: Fingerprint of the camera's present settings.
        now: The time.

    Raises:
        OutputError: The folder cannot be written.
    """
    run = free_run_folder(folder, now)
    set_current_run(run, fingerprint)
    return run


def is_run_name(name: str) -> bool:
    """Whether this is the name of a run's folder.

    >>> is_run_name("20261123T173355Z-2"), is_run_name("notes")
    (True, False)
    """
    return bool(_RUN.fullmatch(name))


def free_run_folder(folder: Path, now: datetime | None = None) -> Path:
    """A folder for a new run, named for the time in UTC; it is not yet created.

    Args:
        folder: Folder of the camera; created if missing.
        now: The time.

    Raises:
        OutputError: The folder cannot be written.
    """
    stamp = (now or datetime.now(UTC)).astimezone(UTC).strftime(STAMP)
    names = (stamp if n == 1 else f"{stamp}-{n}" for n in range(1, 10**6))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return next(p for name in names if not (p := folder / name).exists())
    except OSError as fault:
        raise _unwritable(folder, fault) from fault


def set_current_run(run: Path, fingerprint: str) -> None:
    """Note that this is the run to resume.

    Raises:
        OutputError: The folder cannot be written.
    """
    current = json.dumps({"run": run.name, "fingerprint": fingerprint}, indent=1)
    try:
        write_atomically(run.parent / CURRENT, current.encode() + b"\n")
    except OSError as fault:
        raise _unwritable(run.parent, fault) from fault


def _unwritable(folder: Path, fault: OSError) -> OutputError:
    return OutputError(
        f"the folder of a camera cannot be written: {fault.strerror}",
        where=str(folder),
        hint="check that the store exists, is writable and has room",
    )
