"""Resource limits of an isolated behaviour's process (setrlimit): memory, processes, no core files."""

from __future__ import annotations

import os
from pathlib import Path

MAX_MORE_TASKS = 256
"""Processes and threads beyond those of its user when it starts; linear algebra libraries use one per core.
The system does not limit root."""

STARTING_MB = 4096.0
"""Memory limit during the start, for its libraries and models, megabytes."""

ADDRESSES_MB = 2048
"""Address space beyond its memory, megabytes: a thread reserves some 130 for its stack and allocations."""


def limit_at_start(memory_mb: float) -> None:
    """Limit this process before user code runs in it, where the platform can.

    Args:
        memory_mb: Memory limit of a run, megabytes.
    """
    try:
        import resource

        _set(resource.RLIMIT_CORE, 0)
        _set(resource.RLIMIT_NPROC, _tasks() + MAX_MORE_TASKS)
    except (ImportError, OSError, ValueError):
        return
    limit_memory(max(STARTING_MB, memory_mb), final=False)


def limit_memory(memory_mb: float, *, final: bool = True) -> None:
    """Limit the memory of this process to its present use plus an amount, where the platform can.

    Shared memory is not part of the data limit and is bounded by address space, only after the start, since
    loading a library (such as a GPU's) may reserve a lot of it.

    Args:
        memory_mb: Additional memory, megabytes.
        final: Whether the process cannot raise the limit again.
    """
    try:
        import resource

        address_pages, *_, data_pages, _ = map(int, Path("/proc/self/statm").read_text().split())
        page, additional = resource.getpagesize(), int(memory_mb * 2**20)
        _set(resource.RLIMIT_DATA, data_pages * page + additional, final=final)
        if final:
            _set(resource.RLIMIT_AS, address_pages * page + additional + ADDRESSES_MB * 2**20)
    except (ImportError, OSError, ValueError):
        return


def _set(kind: int, limit: int, *, final: bool = True) -> None:
    import resource

    _, hard = resource.getrlimit(kind)
    if hard == resource.RLIM_INFINITY or limit < hard:
        resource.setrlimit(kind, (limit, limit if final else hard))


def _tasks() -> int:
    """Number of processes and threads of this user."""
    count = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if folder.stat().st_uid == os.getuid():
                count += sum(1 for _ in (folder / "task").iterdir())
        except OSError:
            continue  # ended meanwhile
    return count
