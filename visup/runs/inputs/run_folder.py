"""The folder of a run: made new, never over another one."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import sync
from visup.agent.storage.file_lock import acquire_lock, lock_path
from visup.agent.storage.journal_reader import JOURNAL
from visup.redaction import redacted


def fresh_folder(out: Path | None, source: str) -> Path:
    """The folder of a run, made new; by default `runs/<source>`, numbered when that exists.

    Raises:
        OutputError: It cannot be made, or holds a run already (what was recorded is never lost), which
            may still go on.
    """
    out = out or _numbered_folder(source)
    if (out / JOURNAL).exists():
        # Nobody is told to delete a run that goes on.
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
        sync(out.parent)  # that there is a folder is to be known after the power was lost, too
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
    """`runs/<source>`, made new; numbered where that exists, so that no two runs are given the same."""
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
            break  # it is told when it is tried once more
        return folder
    return folder
