"""Creates the folder of a run, never over an existing run."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import sync
from visup.agent.storage.file_lock import acquire_lock, lock_path
from visup.agent.storage.journal_reader import JOURNAL
from visup.redaction import redacted


def fresh_folder(out: Path | None, source: str) -> Path:
    """Create the folder of a run; by default `runs/<source>`, numbered if that exists.

    Raises:
        OutputError: It cannot be created, or has a run already, which may still be active.
    """
    out = out or _numbered_folder(source)
    if (out / JOURNAL).exists():
        # The hint must not suggest deleting an active run.
        acquire_lock(out / JOURNAL, "this run").release()
        raise OutputError(
            "the folder already contains a run",
            where=str(out),
            hint="choose another folder, or delete this one",
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
        probe = out / ".writable"
        probe.touch()
        probe.unlink()
        sync(out.parent)  # the entry of the folder must survive a loss of power
    except OSError as fault:
        raise OutputError(
            f"the output folder cannot be written: {fault.strerror}",
            where=str(out),
            hint="choose a folder that you may write to with --out",
        ) from fault
    return out


def discard_unbegun(folder: Path) -> None:
    """Remove the empty folder of a run that could not be started, as on a full disk."""
    journal = folder / JOURNAL
    with suppress(OSError):
        if journal.stat().st_size == 0:
            journal.unlink()
    with suppress(OSError):
        if not journal.exists():
            lock_path(journal).unlink(missing_ok=True)
        folder.rmdir()


def _numbered_folder(source: str) -> Path:
    """Create `runs/<source>`, numbered if that exists, so that each run has its own."""
    source = redacted(source)
    stem = Path(source).stem if Path(source).stem not in ("frames", "img1", "video") else ""
    stem = stem or Path(source).resolve().parent.name or "run"
    for n in range(1, 10**6):
        folder = Path("runs") / (stem if n == 1 else f"{stem}-{n}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError:
            break  # reported by the caller's next attempt
        return folder
    return folder
