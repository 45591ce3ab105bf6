"""`visup find`: where in a lake a condition was true."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from visup.archive.finding.judge import Hit
    from visup.archive.finding.search import FoundRun


def find(
    lake: Annotated[Path, typer.Argument(metavar="LAKE", help="A lake of `visup archive`.")],
    what: Annotated[
        str,
        typer.Argument(
            metavar="CONDITION",
            help="A condition of the rule language, several with `and then`, or a rules file.",
        ),
    ],
    unknown: Annotated[
        bool, typer.Option("--unknown", help="Also when it was unknown; no run is left out then.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print hits as JSON, one per line.")
    ] = False,
    scan_all: Annotated[
        bool, typer.Option("--scan-all", help="Look into every run, also where it cannot be.")
    ] = False,
) -> None:
    """Find where in all runs of a lake a condition was true, judged as an agent would have.

    Runs in which it cannot have been, by their recorded relations, are left out. Exit code: 0 when there are
    hits, 1 when there are none, 2 on bad input.
    """
    from visup.archive.asking.database import open_database
    from visup.archive.finding.search import find as look
    from visup.archive.finding.search import read_search
    from visup.archive.lake import Lake
    from visup.terminal.console import make_console

    found, console = Lake.open(lake), make_console()
    search, runs = read_search(what, unknown=unknown), found.runs()
    with open_database(found) as database:
        possible = search.possible_runs(database)
    hits = hit_runs = 0
    for each in look(found, search, runs if scan_all else possible):
        _tell(console, each, as_json)
        hits, hit_runs = hits + len(each.hits), hit_runs + bool(each.hits)
    if not as_json:
        count = len(runs) if scan_all else len(possible)
        share = f" ({100 * count / len(runs):.0f} %)" if runs else ""
        console.print(
            f"Hits: {hits}, in {hit_runs} of {len(runs)} runs; looked into: {count}{share}."
        )
    raise typer.Exit(0 if hits else 1)


def _tell(console: Console, found: FoundRun, as_json: bool) -> None:
    from visup.agent.storage.jsonable import to_jsonable
    from visup.terminal.console import echo_json

    if as_json:
        for hit in found.hits:
            where = {"run": found.run, "clip": found.clip, "folder": str(found.folder)}
            echo_json({**where, **to_jsonable(hit)}, sort_keys=True)
        return
    if found.hits:
        console.print(f"{found.clip}", style="bold", soft_wrap=True, markup=False)
        for line in _lines(found.hits):
            console.print(f"  {line}", soft_wrap=True, markup=False)
        console.print(
            f"  open it: visup step {found.folder}", soft_wrap=True, markup=False, style="dim"
        )


def _lines(hits: tuple[Hit, ...]) -> Iterator[str]:
    for hit in hits:
        who = ", ".join(f"{n} ({i})" for n, i in zip(hit.names, hit.objects, strict=True))
        sure = "" if hit.confidence is None else f", confidence {hit.confidence:.2f}"
        word = ", unknown" if hit.truth == "unknown" else ""
        end = f"{hit.end:.1f} s" + (" (the end)" if hit.open else "")
        rule = f"{hit.rule}: " if hit.rule else ""
        yield f"{rule}{hit.begin:.1f} to {end}: {who or 'nobody in particular'}{sure}{word}"
