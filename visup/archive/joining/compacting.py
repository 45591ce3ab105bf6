"""Joins runs into partitions, one after the other, each atomically.

A partition is written first and then named in the manifest. A process stopped in between leaves a folder that
nobody reads, and the next one writes it again. What a partition replaces, the files of its runs and smaller
partitions, is deleted later, when no reader uses it any more.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from visup.agent.model.errors import OutputError
from visup.archive.extra import imported
from visup.archive.joining.manifest import (
    FOLDER,
    MAX_RUNS,
    Manifest,
    Partition,
    partition_name,
    read_manifest,
)
from visup.archive.joining.partition import read_files, write_partition
from visup.archive.lake import Lake
from visup.archive.schema import TABLES

if TYPE_CHECKING:
    import pyarrow as pa

MAX_ROWS = 2_000_000
"""Rows of relations in a partition, unless a single run has more; bounds the memory of joining to 2 GB."""
GRACE_S = 600.0
"""How long replaced files are kept, seconds; longer than a query takes."""
WORTH_IT = 500
"""Number of unjoined runs from which filling a lake ends with a compaction."""


@dataclass(frozen=True, slots=True)
class Compaction:
    """The result of a compaction.

    Attributes:
        joined: Number of runs joined into partitions.
        partitions: Number of partitions in the lake.
        tidied: Number of runs whose own files were deleted.
    """

    joined: int = 0
    partitions: int = 0
    tidied: int = 0


@dataclass(frozen=True, slots=True)
class _Unit:
    """An indivisible part of a partition: a run, or a small partition."""

    runs: tuple[str, ...]
    rows: int
    old: Partition | None = None


def compact(lake: Lake, *, grace_s: float = GRACE_S, now: float | None = None) -> Compaction:
    """Join the files of runs; the caller holds `only_filler`.

    Args:
        lake: The lake.
        grace_s: How long replaced files are kept for readers, seconds.
        now: Seconds since the epoch, or None for the clock's.

    Raises:
        OutputError: It cannot be read or written; the lake stays valid, perhaps with some more partitions.
    """
    at = time.time() if now is None else now
    try:
        tidied = _tidied(lake, at - grace_s)
        unjoined, joined = lake.snapshot().loose, 0
        for group in _groups(lake, unjoined) if unjoined else ():
            joined += sum(unit.old is None for unit in group)
            _join(lake, group, at)
        tidied += _tidied(lake, at - grace_s)
    except (OSError, imported("pyarrow").ArrowInvalid) as fault:
        reason = getattr(fault, "strerror", None) or str(fault)
        raise OutputError(f"the runs cannot be joined ({reason})", where=str(lake.path)) from fault
    return Compaction(joined, len(read_manifest(lake.path).partitions), tidied)


def compact_if_worth_it(lake: Lake) -> Compaction:
    """Join the files of runs if many are unjoined; the caller holds `only_filler`."""
    return compact(lake) if len(lake.snapshot().loose) >= WORTH_IT else Compaction()


def _groups(lake: Lake, unjoined: Sequence[str]) -> Iterator[list[_Unit]]:
    """Small partitions and unjoined runs, grouped into new partitions."""
    group: list[_Unit] = []
    for unit in _units(lake, unjoined):
        runs = sum(len(u.runs) for u in group) + len(unit.runs)
        if group and (runs > MAX_RUNS or sum(u.rows for u in group) + unit.rows > MAX_ROWS):
            yield group
            group = []
        group.append(unit)
    if any(unit.old is None for unit in group) or len(group) > 1:
        yield group


def _units(lake: Lake, unjoined: Sequence[str]) -> Iterator[_Unit]:
    parquet = imported("pyarrow.parquet")
    for part in read_manifest(lake.path).partitions:
        if len(part.runs) <= MAX_RUNS // 2 and part.rows <= MAX_ROWS // 2:
            yield _Unit(part.runs, part.rows, part)
    for run in unjoined:
        file = lake.table_file("relations", run)
        yield _Unit((run,), parquet.read_metadata(file).num_rows if file.is_file() else 0)


def _join(lake: Lake, group: Sequence[_Unit], at: float) -> None:
    before = read_manifest(lake.path)
    runs = tuple(sorted(run for unit in group for run in unit.runs))
    rows, name = sum(u.rows for u in group), partition_name(runs)
    part = Partition(name, before.free_number(), runs, rows, at)
    if all(unit.old is not None and unit.old.tidied for unit in group):
        part = replace(part, tidied=True)
    tables = {table: _rows(lake, group, table) for table in TABLES}
    write_partition(lake.path / FOLDER / name, part, tables)
    old = {unit.old.name for unit in group if unit.old}
    retained = tuple(p for p in before.partitions if p.name not in old)
    retired = {**before.retired, **dict.fromkeys(old, at)}
    retired.pop(name, None)
    Manifest((*retained, part), retired).write(lake.path)


def _rows(lake: Lake, group: Sequence[_Unit], table: str) -> pa.Table:
    files = [lake.path / FOLDER / u.old.name / f"{table}.parquet" for u in group if u.old]
    unjoined_files = (lake.table_file(table, run) for u in group if not u.old for run in u.runs)
    return read_files([*files, *(f for f in unjoined_files if f.is_file())], table)


def _tidied(lake: Lake, before: float) -> int:
    """Delete what was replaced before some time; returns the number of runs whose own files were deleted."""
    manifest = read_manifest(lake.path)
    old = {p.name for p in manifest.partitions if not p.tidied and p.since <= before}
    expired = {name for name, since in manifest.retired.items() if since <= before}
    joined = (run for part in manifest.partitions if part.name in old for run in part.runs)
    runs = [run for run in joined if lake.table_file("runs", run).is_file()]
    # The row in `runs` goes last: after an interruption the remaining files are found by it.
    for table in reversed(tuple(TABLES)):
        for run in runs:
            lake.table_file(table, run).unlink(missing_ok=True)
    current = {p.name for p in manifest.partitions} | (set(manifest.retired) - expired)
    for folder in _folders(lake.path / FOLDER):
        if folder.name not in current:
            shutil.rmtree(folder)
    if old or expired:
        parts = tuple(replace(p, tidied=p.tidied or p.name in old) for p in manifest.partitions)
        retired: dict[str, Any] = {k: v for k, v in manifest.retired.items() if k not in expired}
        Manifest(parts, retired).write(lake.path)
    return len(runs)


def _folders(place: Path) -> list[Path]:
    return [p for p in place.iterdir() if p.is_dir()] if place.is_dir() else []
