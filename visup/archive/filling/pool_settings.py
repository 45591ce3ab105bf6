"""The command-line options for where jobs run."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Annotated

from visup.runs.settings import Option


@dataclass(frozen=True, slots=True)
class PoolSettings:
    """Where jobs run."""

    workers: Annotated[
        int | None,
        Option("Processes; 0 for this one alone (default: one for each core).", at_least=0),
    ] = None
    scheduler: Annotated[
        str | None,
        Option(
            "Use the workers of this Dask scheduler, such as tcp://head:8786.", metavar="ADDRESS"
        ),
    ] = None
    memory_gb: Annotated[
        float | None,
        Option("What a worker may take, gigabytes; one that takes more is ended.", at_least=0.1),
    ] = None

    @property
    def processes(self) -> int:
        """Number of processes to start on this machine."""
        if self.scheduler:
            return 0
        return (os.cpu_count() or 1) if self.workers is None else self.workers
