"""Checks the memory limit before libraries are loaded, which would otherwise crash without a message."""

from __future__ import annotations

import os

from visup.agent.model.errors import SettingsError

MIN_MEMORY_MB = 1200
MEMORY_A_CORE_MB = 100
"""Address space of the loaded libraries: 1.2 GB measured with 2 cores; each core adds threads with stacks."""


def check_memory() -> None:
    """Check that the libraries can be loaded.

    Raises:
        SettingsError: The address space is limited (`ulimit -v`) too low.
    """
    try:
        import resource

        limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    except (ImportError, OSError):
        return
    least = MIN_MEMORY_MB + MEMORY_A_CORE_MB * (os.cpu_count() or 1)
    if limit != resource.RLIM_INFINITY and limit < least * 2**20:
        raise SettingsError(
            f"this process may use {limit >> 20} MB of memory, which visup cannot work with",
            expected=f"{least} MB or more",
            hint="raise the limit: ulimit -v unlimited",
        )
