"""Runs into partitions: as many as fit, one partition after the other, each there whole or not at all.

A partition is written, then the manifest says that it is there. Whoever is stopped in between leaves a
folder that nobody reads, and the next one writes it again. What a partition replaces, the files of its runs
and smaller partitions, is taken away later, when nobody reads it any more.
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
    MOST_RUNS,
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

MOST_ROWS = 2_000_000
"""Of relations in a partition, unless one run alone has more: it is joined within 2 GB of memory."""
GRACE_S = 600.0
"""How long files stay that others replace; longer than a question takes."""
WORTH_IT = 500
"""With so many runs that are not joined yet, whoever has filled a lake joins them."""


@dataclass(frozen=True, slots=True)
class Compaction:
    """What was done.

    Attributes:
        joined: How many runs came into a partition.
        partitions: How many the lake has now.
        tidied: From how many runs the files of their own were taken away.
    """

    joined: int = 0
    partitions: int = 0
    tidied: int = 0


@dataclass(frozen=True, slots=True)
class _Unit:
    """What comes into a partition undivided: a run, or a small partition."""

    runs: tuple[str, ...]
    rows: int
    old: Partition | None = None


def compact(lake: Lake, *, grace_s: float = GRACE_S, now: float | None = None) -> Compaction:
    """Join the files of runs; `only_filler` is held.

    Args:
        lake: The lake.
        grace_s: How long what is replaced is left for those who read it.
        now: Seconds since the epoch, or None for the clock's.

    Raises:
        OutputError: It cannot be read or written; the lake is as it was, or with some partitions more.
    """
    at = time.time() if now is None else now
    try:
        tidied = _tidied(lake, at - grace_s)
        loose, joined = lake.snapshot().loose, 0
        for group in _groups(lake, loose) if loose else ():
            joined += sum(unit.old is None for unit in group)
            _join(lake, group, at)
        tidied += _tidied(lake, at - grace_s)
    except (OSError, imported("pyarrow").ArrowInvalid) as fault:
        said = getattr(fault, "strerror", None) or str(fault)
        raise OutputError(f"the runs cannot be joined ({said})", where=str(lake.path)) from fault
    return Compaction(joined, len(read_manifest(lake.path).partitions), tidied)


def compact_if_worth_it(lake: Lake) -> Compaction:
    """Join the files of runs when there are many that are not joined; `only_filler` is held."""
    return compact(lake) if len(lake.snapshot().loose) >= WORTH_IT else Compaction()


def _groups(lake: Lake, loose: Sequence[str]) -> Iterator[list[_Unit]]:
    """What comes into one partition each: small partitions and loose runs."""
    group: list[_Unit] = []
    for unit in _units(lake, loose):
        runs = sum(len(u.runs) for u in group) + len(unit.runs)
        if group and (runs > MOST_RUNS or sum(u.rows for u in group) + unit.rows > MOST_ROWS):
            yield group
            group = []
        group.append(unit)
    if any(unit.old is None for unit in group) or len(group) > 1:
        yield group


def _units(lake: Lake, loose: Sequence[str]) -> Iterator[_Unit]:
    parquet = imported("pyarrow.parquet")
    for part in read_manifest(lake.path).partitions:
        if len(part.runs) <= MOST_RUNS // 2 and part.rows <= MOST_ROWS // 2:
            yield _Unit(part.runs, part.rows, part)
    for run in loose:
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
    kept = tuple(p for p in before.partitions if p.name not in old)
    retired = {**before.retired, **dict.fromkeys(old, at)}
    retired.pop(name, None)
    Manifest((*kept, part), retired).write(lake.path)


def _rows(lake: Lake, group: Sequence[_Unit], table: str) -> pa.Table:
    files = [lake.path / FOLDER / u.old.name / f"{table}.parquet" for u in group if u.old]
    own = (lake.table_file(table, run) for u in group if not u.old for run in u.runs)
    return read_files([*files, *(f for f in own if f.is_file())], table)


def _tidied(lake: Lake, before: float) -> int:
    """Take away what was replaced before some time; the number of runs that lose files of their own."""
    manifest = read_manifest(lake.path)
    old = {p.name for p in manifest.partitions if not p.tidied and p.since <= before}
    gone = {name for name, since in manifest.retired.items() if since <= before}
    joined = (run for part in manifest.partitions if part.name in old for run in part.runs)
    runs = [run for run in joined if lake.table_file("runs", run).is_file()]
    # The row in `runs` goes last: whoever goes on after one that was stopped finds the rest by it.
    for table in reversed(tuple(TABLES)):
        for run in runs:
            lake.table_file(table, run).unlink(missing_ok=True)
    known = {p.name for p in manifest.partitions} | (set(manifest.retired) - gone)
    for folder in _folders(lake.path / FOLDER):
        if folder.name not in known:
            shutil.rmtree(folder)
    if old or gone:
        parts = tuple(replace(p, tidied=p.tidied or p.name in old) for p in manifest.partitions)
        retired: dict[str, Any] = {k: v for k, v in manifest.retired.items() if k not in gone}
        Manifest(parts, retired).write(lake.path)
    return len(runs)


def _folders(place: Path) -> list[Path]:
    return [p for p in place.iterdir() if p.is_dir()] if place.is_dir() else []
