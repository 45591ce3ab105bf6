"""One partition: the rows of its runs in a file for each table, and its index.

The index is what questions need of nearly every run: the times in which relations held, whom a name may have
stood for, and the times of stages with the stretches of one status joined. Runs are numbers in it, since
joining numbers takes a fraction of what joining keys takes.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from visup.agent.storage.atomic import replacing
from visup.archive.asking.stage_times import stage_times
from visup.archive.extra import imported
from visup.archive.joining.manifest import Partition
from visup.archive.schema import TABLES

if TYPE_CHECKING:
    import pyarrow as pa

HELD, MEANT, STAGE_TIMES = "held", "meant", "stage_times"
INDEX = (HELD, MEANT, STAGE_TIMES)
"""Files of a partition beside those of the tables."""
ROW_GROUP = 65_536
"""A question about one relation passes over most groups by their least and greatest value."""

Tables = Mapping[str, "pa.Table"]


def read_files(files: Iterable[Path], table: str) -> pa.Table:
    """The rows of some files of a table, in their order.

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
    """Rows by relation, where they have one, and then by run; what is left keeps its order.

    Args:
        rows: Of a table; those of a run stand in their own order.
        runs: Sorted keys; rows of other runs are left out.
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
    """Write the files of a partition; it is none before the manifest says so.

    Args:
        folder: Its own.
        part: Which.
        tables: The rows of its runs, by the name of their table.

    Raises:
        OSError: They cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found = {name: in_order(tables[name], part.runs) for name in TABLES}
    for name, rows in found.items():
        _write(folder / f"{name}.parquet", rows)
    _write(folder / f"{HELD}.parquet", _held(part, found["relations"]))
    _write(folder / f"{MEANT}.parquet", _meant(part, found["runs"], found["objects"]))
    _write(folder / f"{STAGE_TIMES}.parquet", _stage_times(found["runs"], found["stages"]))


def _held(part: Partition, relations: pa.Table) -> pa.Table:
    """The times in which relations held."""
    compute = imported("pyarrow.compute")
    held = relations.filter(compute.equal(relations["truth"], "true"))
    columns = {name: held[name] for name in ("relation", "a", "b", "begin", "end")}
    return imported("pyarrow").table({"number": _numbers(part, held["run"]), **columns})


def _numbers(part: Partition, runs: pa.ChunkedArray) -> pa.ChunkedArray:
    arrow, compute = imported("pyarrow"), imported("pyarrow.compute")
    places = compute.index_in(runs, arrow.array(part.runs, arrow.string()))
    return compute.cast(compute.add(compute.cast(places, "int64"), part.run_number(0)), "uint32")


def _meant(part: Partition, runs: pa.Table, objects: pa.Table) -> pa.Table:
    """Whom each name may have stood for, by name."""
    arrow = imported("pyarrow")
    place = {run: part.run_number(n) for n, run in enumerate(part.runs)}
    actors = {
        run: json.loads(told or "{}")
        for run, told in zip(runs["run"].to_pylist(), runs["actors"].to_pylist(), strict=True)
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
    """The words that an object may ever have been meant by.

    Args:
        names: The identities that it was ever likeliest to have.
        played: The actors that it was ever believed to play.
        actors: Actor -> models, of its run.

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
