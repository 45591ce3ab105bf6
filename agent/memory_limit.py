"""Room for the libraries: what cannot have the memory that it takes ends a process without a word."""

from __future__ import annotations

import os

from visup.agent.model.errors import SettingsError

LEAST_MEMORY_MB = 1200
MEMORY_A_CORE_MB = 100
"""Address space that libraries take when they are loaded: measured with 2 cores at 1.2 GB; each core has
threads, which have stacks."""


def check_memory() -> None:
    """See that libraries will have the memory that they take when they are loaded.

    Raises:
        SettingsError: A limit is set (`ulimit -v`), and it is too low.
    """
    try:
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError):
        return
    least = LEAST_MEMORY_MB + MEMORY_A_CORE_MB * (os.cpu_count() or 1)
    if limit != resource.RLIM_INFINITY and limit < least * 2**20:
        raise SettingsError(
            f"this process may use {limit >> 20} MB of memory, which visup cannot work with",
            expected=f"{least} MB or more",
            hint="raise the limit: ulimit -v unlimited",
        )
