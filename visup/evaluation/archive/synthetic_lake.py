"""Creates a large lake from a small one: copies of its runs with other times, names and gaps.

A copy is scaled in time, repeated until it has the requested rows, recorded on a random day within two years,
and loses some of its relations; in most copies the actors have other names. So runs are similar but not
equal, like real ones.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.archive.extra import imported
from visup.archive.joining.manifest import (
    FOLDER,
    MAX_RUNS,
    Manifest,
    Partition,
    partition_name,
)
from visup.archive.joining.partition import write_partition
from visup.archive.lake import RECORDINGS, Lake
from visup.archive.schema import TABLES
from visup.evaluation.figures import Progress

KEPT_SHARE = 0.9
"""Share of the relations that a copy keeps."""
NAMED_ONE_IN = 400
"""Of so many copies one keeps the names of the actors."""
FIRST_DAY_US = 1_700_000_000_000_000
DAY_US = 86_400_000_000
TIME_COLUMNS = ("begin", "end", "time", "opened", "updated", "closed", "first_seen", "last_seen")
GROWING_TABLES = ("relations", "events")
"""Tables that grow with the length of a run."""

Tables = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class _Copies:
    """Some copies of a run.

    Attributes:
        keys: Keys of the copies.
        time_scale: Time scale of each.
        repeats: Number of repetitions of each.
    """

    keys: tuple[str, ...]
    time_scale: NDArray[np.float64]
    repeats: int


def multiply_lake(
    small: Lake, folder: Path, runs: int, rows: int, seed: int, progress: Progress
) -> tuple[Lake, int]:
    """Create a large lake.

    Args:
        small: The lake to multiply.
        folder: A new folder.
        runs: Number of runs.
        rows: Approximate number of rows of relations and events.
        seed: Random seed.
        progress: Shows what is being done.

    Returns:
        The lake, and its number of rows of relations and events.
    """
    rng = np.random.default_rng(seed)
    base = _tables_by_run(small)
    lake = Lake.create(folder)
    partitions: list[Partition] = []
    count = 0
    for number, first in enumerate(range(0, runs, MAX_RUNS)):
        progress(f"making run {first} of {runs}")
        size = min(MAX_RUNS, runs - first)
        tables = _sample_copies(base, size, rows / runs, rng)
        keys = tuple(sorted(tables["runs"]["run"].to_pylist()))
        partition = Partition(
            partition_name(keys), number, keys, tables["relations"].num_rows, 0.0, True
        )
        write_partition(lake.path / FOLDER / partition.name, partition, tables)
        partitions.append(partition)
        count += sum(tables[name].num_rows for name in GROWING_TABLES)
    Manifest(tuple(partitions)).write(lake.path)
    return lake, count


def link_recordings(small: Lake, large: Lake, runs: list[str]) -> None:
    """Give runs of a large lake the journals of their originals, so that they can be replayed."""
    originals = small.runs()
    for number, run in enumerate(runs):
        link = large.path / RECORDINGS / run[:2] / run
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.exists():
            link.symlink_to(small.folder_of(originals[number % len(originals)]))


def _tables_by_run(lake: Lake) -> list[Tables]:
    """The tables of each run."""
    arrow = imported("pyarrow")
    rows: dict[str, dict[str, list[Any]]] = {run: {} for run in lake.runs()}
    for name in TABLES:
        for row in lake.rows(name):
            rows[row["run"]].setdefault(name, []).append(row)
    return [
        {
            name: arrow.Table.from_pylist(tables.get(name, []), schema=table.arrow(arrow))
            for name, table in TABLES.items()
        }
        for tables in rows.values()
    ]


def _sample_copies(base: list[Tables], runs: int, rows: float, rng: np.random.Generator) -> Tables:
    """The rows of some copies."""
    arrow = imported("pyarrow")
    shares = rng.multinomial(runs, np.full(len(base), 1 / len(base)))
    parts = []
    for tables, share in zip(base, shares.tolist(), strict=True):
        run_rows = sum(tables[name].num_rows for name in GROWING_TABLES) * KEPT_SHARE
        copies = _Copies(
            tuple(bytes(rng.bytes(16)).hex() for _ in range(share)),
            rng.uniform(0.7, 1.4, share),
            max(1, round(rows / run_rows)),
        )
        if share:
            parts.append(
                {name: _copy_rows(name, table, copies, rng) for name, table in tables.items()}
            )
    return {name: arrow.concat_tables([part[name] for part in parts]) for name in TABLES}


def _copy_rows(name: str, table: Any, copies: _Copies, rng: np.random.Generator) -> Any:
    """The rows of one table of all copies of a run."""
    arrow = imported("pyarrow")
    repeats = copies.repeats if name in GROWING_TABLES else 1
    count = len(copies.keys)
    row = np.tile(np.arange(table.num_rows), count * repeats)
    copy = np.repeat(np.arange(count), table.num_rows * repeats)
    repetition = np.tile(np.repeat(np.arange(repeats), table.num_rows), count)
    if name == "relations":
        kept = rng.random(len(row)) < KEPT_SHARE
        row, copy, repetition = row[kept], copy[kept], repetition[kept]
    copied = table.take(arrow.array(row))
    keys = arrow.array(copies.keys, arrow.string()).take(arrow.array(copy))
    copied = _with_column(copied, "run", keys)
    run_length = max(
        (_max_time(table, column) for column in TIME_COLUMNS if column in table.column_names),
        default=0.0,
    )
    for column in (column for column in TIME_COLUMNS if column in table.column_names):
        times = copied[column].to_numpy(zero_copy_only=False)
        scaled = (times + repetition * run_length) * copies.time_scale[copy]
        copied = _with_column(
            copied, column, arrow.array(scaled, arrow.float64(), from_pandas=True)
        )
    if name == "runs":
        days = rng.integers(0, 730, count) * DAY_US + FIRST_DAY_US
        copied = _with_column(copied, "taken", arrow.array(days, arrow.timestamp("us", "UTC")))
    return _without_names(copied, copies) if name == "objects" else copied


def _max_time(rows: Any, column: str) -> float:
    return float(imported("pyarrow.compute").max(rows[column]).as_py() or 0.0)


def _without_names(objects: Any, copies: _Copies) -> Any:
    """Remove actors and model names in most copies."""
    arrow = imported("pyarrow")
    named = {key for key in copies.keys if int(key[:6], 16) % NAMED_ONE_IN == 0}
    keys = objects["run"].to_pylist()
    for column, replacement in (("names", "body"), ("actors", "part")):
        renamed = [
            values
            if key in named
            else [f"{replacement}_{int(key[:6], 16) % NAMED_ONE_IN}"] * bool(values)
            for key, values in zip(keys, objects[column].to_pylist(), strict=True)
        ]
        objects = _with_column(objects, column, arrow.array(renamed, arrow.list_(arrow.string())))
    return objects


def _with_column(rows: Any, column: str, values: Any) -> Any:
    return rows.set_column(rows.column_names.index(column), rows.schema.field(column), values)
