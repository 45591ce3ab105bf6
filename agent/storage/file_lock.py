"""Write locks for a file or a run folder, released when their process ends.

They are locks of the operating system on a hidden file next to the locked one (`.NAME.lock`), which may
remain: a killed process holds nothing. Reading needs no lock.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import BaseFileLock, FileLock, Timeout

from visup.agent.model.errors import OutputError

WAIT_S = 60.0
"""How long a writer waits for another, seconds: replacing a database takes a second or two."""


def acquire_lock(
    path: Path, what: str, wait_s: float = 0.0, *, reentrant: bool = False
) -> BaseFileLock:
    """Acquire the write lock of a file, which the caller must release.

    Args:
        path: The file to be written; it need not exist.
        what: Description for the message, such as 'this run'.
        wait_s: How long to wait for another writer, seconds.
        reentrant: Whether the lock is re-entrant for its thread.

    Raises:
        OutputError: Another writer holds it, or locking is not possible there.
    """
    if not path.parent.is_dir() or not path.name:
        raise _unwritable(path, what, "there is no such folder")
    lock = FileLock(lock_path(path), is_singleton=reentrant)
    try:
        lock.acquire(timeout=wait_s, poll_interval=0.02)
    except Timeout as timeout:
        raise OutputError(
            f"another visup is writing {what}",
            where=str(path),
            hint="wait until it is done, or stop it",
        ) from timeout
    except OSError as fault:
        raise _unwritable(path, what, fault.strerror or str(fault)) from fault
    return lock


def lock_path(path: Path) -> Path:
    """The lock file of a file."""
    return path.with_name(f".{path.name}.lock")


def _unwritable(path: Path, what: str, reason: str) -> OutputError:
    return OutputError(
        f"{what} cannot be written ({reason})",
        where=str(path),
        hint="check that the folder exists, is writable and has room",
    )


@contextmanager
def only_writer(path: Path, what: str) -> Iterator[None]:
    """Hold the lock of a file while changing it, after waiting for others; see `acquire_lock`."""
    lock = acquire_lock(path, what, WAIT_S, reentrant=True)
    try:
        yield
    finally:
        lock.release()
