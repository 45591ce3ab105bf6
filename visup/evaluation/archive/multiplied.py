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
    MOST_RUNS,
    Manifest,
    Partition,
    partition_name,
)
from visup.archive.joining.partition import write_partition
from visup.archive.lake import RECORDINGS, Lake
from visup.archive.schema import TABLES
from visup.evaluation.figures import Progress

KEPT = 0.9
"""Share of the relations that a copy keeps."""
OTHERS = 400
"""One in this many copies keeps the names of the actors."""
FIRST_DAY_US = 1_700_000_000_000_000
DAY_US = 86_400_000_000
TIMES = ("begin", "end", "time", "opened", "updated", "closed", "first_seen", "last_seen")
GROWING = ("relations", "events")
"""Tables that grow with the length of a run."""

Tables = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class _Copies:
    """Some copies of a run.

    Attributes:
        keys: Keys of the copies.
        stretch: Time scale of each.
        repeats: Number of repetitions of each.
    """

    keys: tuple[str, ...]
    stretch: NDArray[np.float64]
    repeats: int


def multiply(
    small: Lake, place: Path, runs: int, rows: int, seed: int, progress: Progress
) -> tuple[Lake, int]:
    """Create a large lake.

    Args:
        small: The lake to multiply.
        place: A new folder.
        runs: Number of runs.
        rows: Approximate number of rows of relations and events.
        seed: Random seed.
        progress: Shows what is being done.

    Returns:
        The lake, and its number of rows of relations and events.
    """
    rng = np.random.default_rng(seed)
    base = _tables(small)
    lake = Lake.create(place)
    made: list[Partition] = []
    count = 0
    for number, first in enumerate(range(0, runs, MOST_RUNS)):
        progress(f"making run {first} of {runs}")
        size = min(MOST_RUNS, runs - first)
        tables = _drawn(base, size, rows / runs, rng)
        keys = tuple(sorted(tables["runs"]["run"].to_pylist()))
        part = Partition(
            partition_name(keys), number, keys, tables["relations"].num_rows, 0.0, True
        )
        write_partition(lake.path / FOLDER / part.name, part, tables)
        made.append(part)
        count += sum(tables[name].num_rows for name in GROWING)
    Manifest(tuple(made)).write(lake.path)
    return lake, count


def lend_recordings(small: Lake, large: Lake, runs: list[str]) -> None:
    """Give runs of a large lake the journals of their originals, so that they can be replayed."""
    known = small.runs()
    for number, run in enumerate(runs):
        link = large.path / RECORDINGS / run[:2] / run
        link.parent.mkdir(parents=True, exist_ok=True)
        if not link.exists():
            link.symlink_to(small.folder_of(known[number % len(known)]))


def _tables(lake: Lake) -> list[Tables]:
    """The tables of each run."""
    arrow = imported("pyarrow")
    found: dict[str, dict[str, list[Any]]] = {run: {} for run in lake.runs()}
    for name in TABLES:
        for row in lake.rows(name):
            found[row["run"]].setdefault(name, []).append(row)
    return [
        {
            name: arrow.Table.from_pylist(of.get(name, []), schema=table.arrow(arrow))
            for name, table in TABLES.items()
        }
        for of in found.values()
    ]


def _drawn(base: list[Tables], runs: int, rows: float, rng: np.random.Generator) -> Tables:
    """The rows of some copies."""
    arrow = imported("pyarrow")
    shares = rng.multinomial(runs, np.full(len(base), 1 / len(base)))
    parts = []
    for tables, share in zip(base, shares.tolist(), strict=True):
        own = sum(tables[name].num_rows for name in GROWING) * KEPT
        copies = _Copies(
            tuple(bytes(rng.bytes(16)).hex() for _ in range(share)),
            rng.uniform(0.7, 1.4, share),
            max(1, round(rows / own)),
        )
        if share:
            parts.append(
                {name: _copied(name, rows_, copies, rng) for name, rows_ in tables.items()}
            )
    return {name: arrow.concat_tables([part[name] for part in parts]) for name in TABLES}


def _copied(name: str, rows: Any, copies: _Copies, rng: np.random.Generator) -> Any:
    """The rows of one table of all copies of a run."""
    arrow = imported("pyarrow")
    repeats = copies.repeats if name in GROWING else 1
    count = len(copies.keys)
    place = np.tile(np.arange(rows.num_rows), count * repeats)
    copy = np.repeat(np.arange(count), rows.num_rows * repeats)
    again = np.tile(np.repeat(np.arange(repeats), rows.num_rows), count)
    if name == "relations":
        kept = rng.random(len(place)) < KEPT
        place, copy, again = place[kept], copy[kept], again[kept]
    found = rows.take(arrow.array(place))
    keys = arrow.array(copies.keys, arrow.string()).take(arrow.array(copy))
    found = _with(found, "run", keys)
    longest = max((_longest(rows, c) for c in TIMES if c in rows.column_names), default=0.0)
    for column in (c for c in TIMES if c in rows.column_names):
        times = found[column].to_numpy(zero_copy_only=False)
        moved = (times + again * longest) * copies.stretch[copy]
        found = _with(found, column, arrow.array(moved, arrow.float64(), from_pandas=True))
    if name == "runs":
        days = rng.integers(0, 730, count) * DAY_US + FIRST_DAY_US
        found = _with(found, "taken", arrow.array(days, arrow.timestamp("us", "UTC")))
    return _renamed(found, copies) if name == "objects" else found


def _longest(rows: Any, column: str) -> float:
    return float(imported("pyarrow.compute").max(rows[column]).as_py() or 0.0)


def _renamed(objects: Any, copies: _Copies) -> Any:
    """Remove actors and model names in most copies."""
    arrow = imported("pyarrow")
    same = {key for key in copies.keys if int(key[:6], 16) % OTHERS == 0}
    keys = objects["run"].to_pylist()
    for column, other in (("names", "body"), ("actors", "part")):
        kept = [
            told if key in same else [f"{other}_{int(key[:6], 16) % OTHERS}"] * bool(told)
            for key, told in zip(keys, objects[column].to_pylist(), strict=True)
        ]
        objects = _with(objects, column, arrow.array(kept, arrow.list_(arrow.string())))
    return objects


def _with(rows: Any, column: str, values: Any) -> Any:
    return rows.set_column(rows.column_names.index(column), rows.schema.field(column), values)
