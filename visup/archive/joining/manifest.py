"""The manifest: the partitions of a lake in one file, which is replaced atomically.

A run is in a partition when the manifest says so. Its own files are then ignored, and deleted later: a reader
that began before the manifest was replaced may still be using them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

from visup.agent.model.errors import OutputError
from visup.agent.storage.atomic import write_atomically

MANIFEST = "joined.json"
FOLDER = "joined"
VERSION = 1
MAX_RUNS = 2_000
"""Runs in a partition, at most."""


@dataclass(frozen=True, slots=True)
class Partition:
    """Runs whose rows share files.

    Attributes:
        name: Derived from its runs; also the name of its folder.
        number: Its position in the index, from which the numbers of its runs follow.
        runs: Keys of the runs, sorted.
        rows: Rows of relations, the measure of its size.
        since: When it was added to the manifest, seconds since the epoch.
        tidied: Whether the runs' own files have been deleted.
    """

    name: str
    number: int
    runs: tuple[str, ...]
    rows: int
    since: float
    tidied: bool = False

    def run_number(self, place: int) -> int:
        """The number of a run in the index, by its position in `runs`."""
        return self.number * MAX_RUNS + place


@dataclass(frozen=True)
class Manifest:
    """The partitions of a lake.

    Attributes:
        partitions: The active partitions.
        retired: Name of a replaced partition -> since when, seconds since the epoch.
    """

    partitions: tuple[Partition, ...] = ()
    retired: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def runs(self) -> frozenset[str]:
        """The keys of all runs in partitions."""
        return frozenset(run for part in self.partitions for run in part.runs)

    def free_number(self) -> int:
        """The lowest unused partition number."""
        taken = {part.number for part in self.partitions}
        return next(n for n in range(len(taken) + 1) if n not in taken)

    def write(self, lake: Path) -> None:
        """Replace the manifest of a lake.

        Raises:
            OSError: It cannot be written; the old one remains.
        """
        fields = {
            "version": VERSION,
            "partitions": [asdict(part) for part in self.partitions],
            "retired": dict(self.retired),
        }
        write_atomically(lake / MANIFEST, (json.dumps(fields) + "\n").encode())


def partition_name(runs: Iterable[str]) -> str:
    """The name of a partition of some runs: 16 hexadecimal digits."""
    return hashlib.sha256("\n".join(sorted(runs)).encode()).hexdigest()[:16]


def read_manifest(lake: Path) -> Manifest:
    """The manifest of a lake; an empty one if there is none.

    Raises:
        OutputError: It is damaged, or of another version.
    """
    path = lake / MANIFEST
    try:
        stat = path.stat()
    except FileNotFoundError:
        return Manifest()
    # The file is replaced, never modified, so its inode, time and size identify the cached content.
    return _read(path, (stat.st_ino, stat.st_mtime_ns, stat.st_size))


@lru_cache(maxsize=4)
def _read(path: Path, state: tuple[int, int, int]) -> Manifest:
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
        if fields["version"] != VERSION:
            raise OutputError(
                f"the list of partitions has version {fields['version']}",
                where=str(path),
                expected=f"version {VERSION}",
                hint="read the lake with the visup that wrote it",
            )
        parts = (
            Partition(**{**part, "runs": tuple(part["runs"])}) for part in fields["partitions"]
        )
        return Manifest(tuple(parts), fields["retired"])
    except (OSError, ValueError, KeyError, TypeError) as fault:
        message = f"the list of partitions cannot be read ({fault})"
        raise OutputError(message, where=str(path)) from fault
