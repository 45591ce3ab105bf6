"""Read-only SQL over a lake.

DuckDB may access only the folder of the tables, its settings are locked, and only SELECT statements are
accepted: a query can neither read other files, nor write any, nor reach the network.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from visup.agent.model.errors import VisupError
from visup.archive.extra import imported
from visup.archive.joining.manifest import FOLDER
from visup.archive.lake import TABLES_FOLDER, Lake, LakeSnapshot
from visup.archive.querying.views import definitions, escaped, quoted

if TYPE_CHECKING:
    import pyarrow as pa

MEMORY_GB = 2.0


class QueryError(VisupError):
    """A query to a lake cannot be answered."""


@dataclass(frozen=True, slots=True)
class LakeDatabase:
    """A lake that can be queried.

    Attributes:
        connection: The locked DuckDB connection.
    """

    connection: Any

    def ask(self, sql: str) -> pa.Table:
        """The result of one SELECT.

        Raises:
            QueryError: It is not a single SELECT, or cannot be answered.
        """
        duckdb = imported("duckdb")
        try:
            statements = self.connection.extract_statements(sql)
            if len(statements) != 1:
                raise QueryError(
                    f"these are {len(statements)} statements"
                    if statements
                    else "the query is empty",
                    expected="one SELECT",
                )
            # EXPLAIN is refused too: EXPLAIN ANALYZE runs the statement.
            if statements[0].type != duckdb.StatementType.SELECT:
                raise QueryError(
                    f"a lake is only read, and this is {statements[0].type.name}",
                    expected="SELECT ..., or WITH ... SELECT ...",
                )
            return self.connection.sql(sql).to_arrow_table()
        except duckdb.Error as fault:
            raise _query_error(fault) from fault


@contextmanager
def open_database(lake: Lake, memory_gb: float = MEMORY_GB) -> Iterator[LakeDatabase]:
    """A lake as a database, closed at the end.

    Args:
        lake: The lake.
        memory_gb: Memory limit of a query, gigabytes.

    Raises:
        QueryError: The tables cannot be read.
        ExtraMissingError: DuckDB is not installed.
    """
    duckdb = imported("duckdb")
    folders = [(lake.path / name).absolute() for name in (TABLES_FOLDER, FOLDER)]
    allowed = ", ".join(quoted(f"{each}/") for f in folders for each in (f, escaped(f)))
    offline = {"autoinstall_known_extensions": "false", "autoload_known_extensions": "false"}
    with duckdb.connect(":memory:", config=offline) as connection:
        try:
            found = lake.snapshot()
            _number_runs(connection, found)
            for statement in definitions(found):
                connection.execute(statement)
            for setting in (
                "TimeZone = 'UTC'",
                "enable_progress_bar = false",
                f"memory_limit = '{memory_gb:g}GB'",
                "temp_directory = ''",
                f"allowed_directories = [{allowed}]",
                "enable_external_access = false",
                "lock_configuration = true",
            ):
                connection.execute(f"SET {setting}")
        except duckdb.Error as fault:
            raise QueryError(
                f"the tables cannot be read ({fault})", where=str(lake.path)
            ) from fault
        yield LakeDatabase(connection)


def _number_runs(connection: Any, found: LakeSnapshot) -> None:
    """Create the table of runs with their numbers in the index."""
    arrow = imported("pyarrow")
    parts = [
        arrow.table(
            {
                "run": arrow.array(runs, arrow.string()),
                "number": arrow.array(range(first, first + len(runs)), arrow.uint32()),
                "own": arrow.array([own] * len(runs), arrow.bool_()),
            }
        )
        for runs, first, own in found.numbered()
    ]
    connection.execute("CREATE SCHEMA lake_index")
    connection.register("numbered", arrow.concat_tables(parts))
    connection.execute("CREATE TABLE lake_index.runs AS SELECT * FROM numbered")
    connection.unregister("numbered")


def _query_error(fault: Exception) -> QueryError:
    """A DuckDB error as a `QueryError`."""
    kind, name = str(fault).partition(": ")[::2], type(fault).__name__
    text = kind[1].strip() or str(fault)
    hints = {
        "PermissionException": "a question reads the tables of its lake and nothing else",
        "OutOfMemoryException": "ask for less, group earlier, or give more with --memory-gb",
        "CatalogException": "visup query LAKE --tables shows what there is",
        "BinderException": "visup query LAKE --tables shows what there is",
    }
    return QueryError(text, hint=hints.get(name))
