"""What the operating system holds an isolated behaviour's process to: memory, processes, no core files."""

from __future__ import annotations

import os
from pathlib import Path

MOST_MORE_TASKS = 256
"""Processes and threads that it may have besides those which its user has when it starts; libraries of linear
algebra take one a core. The system does not count those of root."""

STARTING_MB = 4096.0
"""Memory that it may take for its libraries and models until it has started, megabytes."""

ADDRESSES_MB = 2048
"""Addresses beyond its memory, megabytes: a thread reserves some 130 for its stack and its allocations."""


def limit_at_start(memory_mb: float) -> None:
    """Bound this process before code of the user's own runs in it, where the platform can.

    Args:
        memory_mb: What a run of it may take, megabytes.
    """
    try:
        import resource

        _set(resource.RLIMIT_CORE, 0)
        _set(resource.RLIMIT_NPROC, _tasks() + MOST_MORE_TASKS)
    except (ImportError, OSError, ValueError):
        return
    limit_memory(max(STARTING_MB, memory_mb), final=False)


def limit_memory(memory_mb: float, *, final: bool = True) -> None:
    """Bound the memory of this process, where the platform can: what it has now and so much more.

    Memory that may be shared is no data to the system, and is bounded by addresses: in the end alone,
    since a library that is loaded may reserve many of them (a GPU's).

    Args:
        memory_mb: How much more, megabytes.
        final: Whether the process itself may not raise the bound again.
    """
    try:
        import resource

        addresses, *_, data, _ = map(int, Path("/proc/self/statm").read_text().split())
        page, more = resource.getpagesize(), int(memory_mb * 2**20)
        _set(resource.RLIMIT_DATA, data * page + more, final=final)
        if final:
            _set(resource.RLIMIT_AS, addresses * page + more + ADDRESSES_MB * 2**20)
    except (ImportError, OSError, ValueError):
        return


def _set(kind: int, most: int, *, final: bool = True) -> None:
    import resource

    _, hard = resource.getrlimit(kind)
    if hard == resource.RLIM_INFINITY or most < hard:
        resource.setrlimit(kind, (most, most if final else hard))


def _tasks() -> int:
    """Processes and threads that this user has."""
    count = 0
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if folder.stat().st_uid == os.getuid():
                count += sum(1 for _ in (folder / "task").iterdir())
        except OSError:
            continue  # it ended meanwhile
    return count
