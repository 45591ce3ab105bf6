"""Which partitions a lake has: one file, replaced whole, so that a reader sees all of a change or nothing.

A run is in a partition when the manifest says so. Files of its own that are still there then are of no
account any more, and go later: a reader that began before the manifest was replaced may still be reading
them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import write_whole

MANIFEST = "joined.json"
FOLDER = "joined"
VERSION = 1
MOST_RUNS = 2_000
"""Runs in a partition, at most."""


@dataclass(frozen=True, slots=True)
class Partition:
    """Runs whose rows stand in the same files.

    Attributes:
        name: Follows from its runs; its folder is called so.
        number: Its place in the index, where a run is a number.
        runs: Their keys, sorted.
        rows: Of relations: what its size is reckoned by.
        since: When it came into the manifest, seconds since the epoch.
        tidied: Whether its runs have no files of their own any more.
    """

    name: str
    number: int
    runs: tuple[str, ...]
    rows: int
    since: float
    tidied: bool = False

    def run_number(self, place: int) -> int:
        """The number that a run has in the index, by its place among `runs`."""
        return self.number * MOST_RUNS + place


@dataclass(frozen=True)
class Manifest:
    """The partitions of a lake.

    Attributes:
        partitions: Those that are read.
        retired: Name of a partition that others replace -> since when, seconds since the epoch.
    """

    partitions: tuple[Partition, ...] = ()
    retired: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def runs(self) -> frozenset[str]:
        """The keys of all runs in partitions."""
        return frozenset(run for part in self.partitions for run in part.runs)

    def free_number(self) -> int:
        """The lowest number that no partition has."""
        taken = {part.number for part in self.partitions}
        return next(n for n in range(len(taken) + 1) if n not in taken)

    def write(self, lake: Path) -> None:
        """Replace the manifest of a lake.

        Raises:
            OSError: It cannot be written; the old one stands.
        """
        told = {
            "version": VERSION,
            "partitions": [asdict(part) for part in self.partitions],
            "retired": dict(self.retired),
        }
        write_whole(lake / MANIFEST, (json.dumps(told) + "\n").encode())


def partition_name(runs: Iterable[str]) -> str:
    """The name of the partition of some runs: 16 hexadecimal digits."""
    return hashlib.sha256("\n".join(sorted(runs)).encode()).hexdigest()[:16]


def read_manifest(lake: Path) -> Manifest:
    """The manifest of a lake; without partitions where there is none.

    Raises:
        OutputError: It is damaged, or of another version.
    """
    path = lake / MANIFEST
    try:
        stat = path.stat()
    except FileNotFoundError:
        return Manifest()
    # Replaced whole, it is another file then: what was read of this one is still so.
    return _read(path, (stat.st_ino, stat.st_mtime_ns, stat.st_size))


@lru_cache(maxsize=4)
def _read(path: Path, state: tuple[int, int, int]) -> Manifest:
    try:
        told = json.loads(path.read_text(encoding="utf-8"))
        if told["version"] != VERSION:
            raise OutputError(
                f"the list of partitions has version {told['version']}",
                where=str(path),
                expected=f"version {VERSION}",
                hint="read the lake with the visup that wrote it",
            )
        parts = (Partition(**{**part, "runs": tuple(part["runs"])}) for part in told["partitions"])
        return Manifest(tuple(parts), told["retired"])
    except (OSError, ValueError, KeyError, TypeError) as fault:
        what = f"the list of partitions cannot be read ({fault})"
        raise OutputError(what, where=str(path)) from fault
