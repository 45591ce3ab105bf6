"""One partition: the rows of its runs in one file per table, and its index.

The index is what most queries need: the intervals in which relations held, the objects that a name may mean,
and the intervals of stages merged by status. Runs are numbers in it, because joining on numbers is much
faster than on keys.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from visup.agent.storage.atomic import replacing
from visup.archive.extra import imported
from visup.archive.joining.manifest import Partition
from visup.archive.querying.stage_times import stage_times
from visup.archive.schema import TABLES

if TYPE_CHECKING:
    import pyarrow as pa

HELD, MEANT, STAGE_TIMES = "held", "meant", "stage_times"
INDEX = (HELD, MEANT, STAGE_TIMES)
"""Further files of a partition."""
ROW_GROUP = 65_536
"""Rows per Parquet row group: a query for one relation skips most groups by their minimum and maximum."""

Tables = Mapping[str, "pa.Table"]


def read_files(files: Iterable[Path], table: str) -> pa.Table:
    """The rows of some files of a table, in order.

    Raises:
        OSError: One cannot be read.
    """
    arrow, dataset = imported("pyarrow"), imported("pyarrow.dataset")
    schema = TABLES[table].arrow(arrow)
    paths = [str(f) for f in files]
    if not paths:
        return schema.empty_table()
    return dataset.dataset(paths, schema=schema, format="parquet", partitioning=None).to_table()


def in_order(rows: pa.Table, runs: Sequence[str]) -> pa.Table:
    """Sort rows stably by relation, if they have one, and then by run.

    Args:
        rows: Rows of a table, those of a run in order.
        runs: Sorted keys; rows of other runs are dropped.
    """
    arrow, compute = imported("pyarrow"), imported("pyarrow.compute")
    rows = rows.filter(compute.is_in(rows["run"], arrow.array(runs, arrow.string())))
    order = compute.cast(compute.index_in(rows["run"], arrow.array(runs, arrow.string())), "int64")
    if "relation" in rows.column_names:
        names = arrow.array(sorted(compute.unique(rows["relation"]).to_pylist()), arrow.string())
        first = compute.cast(compute.index_in(rows["relation"], names), "int64")
        order = compute.add(compute.multiply(first, len(runs)), order)
    return rows.take(compute.sort_indices(order))


def write_partition(folder: Path, part: Partition, tables: Tables) -> None:
    """Write the files of a partition; it counts only once the manifest names it.

    Args:
        folder: Its folder.
        part: The partition.
        tables: The rows of its runs by table.

    Raises:
        OSError: They cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = {name: in_order(tables[name], part.runs) for name in TABLES}
    for name, rows in found.items():
        _write(folder / f"{name}.parquet", rows)
    _write(folder / f"{HELD}.parquet", _holding_relations(part, found["relations"]))
    _write(folder / f"{MEANT}.parquet", _meant(part, found["runs"], found["objects"]))
    _write(folder / f"{STAGE_TIMES}.parquet", _stage_times(found["runs"], found["stages"]))


def _holding_relations(part: Partition, relations: pa.Table) -> pa.Table:
    """The intervals in which relations held."""
    compute = imported("pyarrow.compute")
    holding = relations.filter(compute.equal(relations["truth"], "true"))
    columns = {name: holding[name] for name in ("relation", "a", "b", "begin", "end")}
    return imported("pyarrow").table({"number": _numbers(part, holding["run"]), **columns})


def _numbers(part: Partition, runs: pa.ChunkedArray) -> pa.ChunkedArray:
    arrow, compute = imported("pyarrow"), imported("pyarrow.compute")
    positions = compute.index_in(runs, arrow.array(part.runs, arrow.string()))
    return compute.cast(compute.add(compute.cast(positions, "int64"), part.run_number(0)), "uint32")


def _meant(part: Partition, runs: pa.Table, objects: pa.Table) -> pa.Table:
    """The objects that each name may mean, by name."""
    arrow = imported("pyarrow")
    place = {run: part.run_number(n) for n, run in enumerate(part.runs)}
    actors = {
        run: json.loads(text or "{}")
        for run, text in zip(runs["run"].to_pylist(), runs["actors"].to_pylist(), strict=True)
    }
    columns = (objects[c].to_pylist() for c in ("run", "object", "names", "actors"))
    found = sorted(
        (name, place[run], number)
        for run, number, names, played in zip(*columns, strict=True)
        for name in meanings(names, played, actors[run])
    )
    schema = arrow.schema(
        [("name", arrow.string()), ("number", arrow.uint32()), ("object", arrow.int64())]
    )
    parts = list(zip(*found, strict=True)) or [()] * len(schema)
    return arrow.table(dict(zip(schema.names, parts, strict=True)), schema=schema)


def meanings(
    names: Sequence[str], played: Sequence[str], actors: Mapping[str, Sequence[str]]
) -> set[str]:
    """The words by which an object may be meant.

    Args:
        names: Its most likely identities over time.
        played: The actors it was believed to be.
        actors: Actor -> models of its run.

    >>> sorted(meanings(["spartan"], [], {"satellite": ["spartan"], "arm": ["rms"]}))
    ['satellite', 'spartan']
    """
    by_model = {actor for actor, models in actors.items() if set(models) & set(names)}
    return {*names, *played, *by_model}


def _stage_times(runs: pa.Table, stages: pa.Table) -> pa.Table:
    with imported("duckdb").connect(":memory:") as connection:
        connection.register("run_rows", runs)
        connection.register("stage_rows", stages)
        return connection.sql(stage_times("run_rows", "stage_rows")).to_arrow_table()


def _write(path: Path, rows: Any) -> None:
    with replacing(path) as draft:
        imported("pyarrow.parquet").write_table(
            rows, draft, compression="zstd", row_group_size=ROW_GROUP
        )
