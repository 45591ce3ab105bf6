"""`visup query`: query a lake in SQL."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.commands.archives.lake_argument import LakeLocation
from visup.commands.options import OptionValues, takes
from visup.runs.settings import Option

if TYPE_CHECKING:
    import pyarrow as pa
    from rich.console import Console

    from visup.archive.querying.database import LakeDatabase

MAX_SHOWN_ROWS = 50


@dataclass(frozen=True, slots=True)
class AnswerOptions:
    """How a result is written, and what else is shown."""

    form: Annotated[
        str | None, Option("table (default), csv, json or parquet.", "--format", "FORM")
    ] = None
    out: Annotated[
        Path | None,
        Option("Write the result to this file: .csv, .json or .parquet.", metavar="FILE"),
    ] = None
    tables: Annotated[bool, Option("Show the tables and their columns.", "--tables")] = False
    examples: Annotated[
        bool, Option("Show fifteen example queries with their results.", "--examples")
    ] = False
    memory_gb: Annotated[float, Option("Memory that a query may use, gigabytes.", at_least=0.1)] = (
        2.0
    )


@takes(AnswerOptions)
def query(
    answer_options: OptionValues,
    location: LakeLocation,
    sql: Annotated[
        str | None, typer.Argument(metavar="SQL", help="One SELECT, in the SQL of DuckDB.")
    ] = None,
) -> None:
    """Query a lake in SQL (read-only).

    Exit code: 0 if the query ran, even with an empty result, 2 if it did not.
    """
    from visup.archive.querying.answers import answer_rows, as_csv, format_of, write_answer
    from visup.archive.querying.database import open_database
    from visup.archive.storing.places import open_lake
    from visup.terminal.console import echo, echo_json, make_console

    options = AnswerOptions(**answer_options)
    if not (sql or options.tables or options.examples):
        raise typer.BadParameter("give a query, or see --examples", param_hint="SQL")
    form = format_of(options.form, options.out)
    console = make_console(unwrapped=True)
    with open_database(open_lake(location), options.memory_gb) as database:
        if options.tables:
            _show_tables(console, database)
        if options.examples:
            _show_examples(console, database)
        if not sql:
            return
        answer = database.ask(sql)
    if options.out:
        write_answer(answer, form, options.out)
        rows = "1 row" if answer.num_rows == 1 else f"{answer.num_rows} rows"
        echo(f"{options.out}: {rows}")
    elif form == "json":
        echo_json(answer_rows(answer))
    elif form == "csv":
        echo(as_csv(answer), nl=False)
    else:
        _show(console, answer)


def _show(console: Console, answer: pa.Table) -> None:
    from rich.markup import escape
    from rich.text import Text

    from visup.archive.querying.answers import cell
    from visup.terminal.tables import table

    if not answer.num_rows:
        console.print(f"No rows ({', '.join(answer.column_names)}).", markup=False, soft_wrap=True)
        return
    rows = table(*map(escape, answer.column_names))
    head = answer.slice(0, MAX_SHOWN_ROWS)
    columns = [column.to_pylist() for column in head.columns]
    for row in zip(*columns, strict=True):
        rows.add_row(*(Text(cell(value)) for value in row))
    console.print(rows)
    more = answer.num_rows - head.num_rows
    if more > 0:
        console.print(f"and {more} more rows; --format csv shows all", markup=False)


def _show_examples(console: Console, database: LakeDatabase) -> None:
    from visup.archive.querying.examples import EXAMPLES

    for number, question in enumerate(EXAMPLES, 1):
        console.print(f"{number}. {question.words}", markup=False, style="bold")
        console.print(f"   {question.sql}\n", markup=False, soft_wrap=True)
        _show(console, database.ask(question.sql))
        console.print()


def _show_tables(console: Console, database: LakeDatabase) -> None:
    from visup.archive.querying.views import RELATIONS, VIEWS

    for name, (meaning, _) in VIEWS.items():
        columns = database.ask(f"SELECT * FROM {name} LIMIT 0").column_names
        console.print(f"{name}: {meaning}", markup=False, soft_wrap=True)
        console.print(f"    {', '.join(columns)}", markup=False, soft_wrap=True)
    sentence = f"Each relation, with the times at which it held: {', '.join(RELATIONS)}"
    console.print(sentence, markup=False, soft_wrap=True)
    console.print("The stored tables: lake.runs, lake.objects, ...", markup=False)
