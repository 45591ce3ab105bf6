"""`visup find`: where in a lake a condition held."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.archive.parallel import Workers
from visup.commands.archives.lake_argument import LakeLocation
from visup.commands.options import OptionValues, takes
from visup.runs.settings import Option

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from rich.console import Console

    from visup.archive.finding.pattern_evaluator import Hit
    from visup.archive.finding.search import FoundRun


@dataclass(frozen=True, slots=True)
class FindOptions:
    """Where to search, and what to do with the hits."""

    unknown: Annotated[
        bool,
        Option("Also report where the condition was unknown; searches every run.", "--unknown"),
    ] = False
    as_json: Annotated[bool, Option("Print hits as JSON, one per line.", "--json")] = False
    scan_all: Annotated[
        bool, Option("Search every run, even those that an index rules out.", "--scan-all")
    ] = False
    first: Annotated[
        int | None, Option("Stop after this many runs with hits.", metavar="N", at_least=1)
    ] = None
    clips: Annotated[
        Path | None, Option("Cut the hits out of the footage, as video clips.", metavar="DIR")
    ] = None
    workers: Workers = None


@takes(FindOptions)
def find(
    find_options: OptionValues,
    location: LakeLocation,
    condition: Annotated[
        str,
        typer.Argument(
            metavar="CONDITION",
            help="A condition in the rule language, several joined by `and then`, or a rules or task file.",
        ),
    ],
) -> None:
    """Find where a condition held, in all runs of a lake, evaluated exactly as in a live run.

    Runs whose recorded relations rule the condition out are skipped. Exit code: 0 if there are hits, 1 if
    there are none, 2 for bad input.
    """
    from visup.archive.finding.search import find as find_runs
    from visup.archive.finding.search import read_search
    from visup.archive.querying.database import open_database
    from visup.archive.storing.places import open_lake
    from visup.terminal.console import make_console

    options, lake, console = FindOptions(**find_options), open_lake(location), make_console()
    search, runs = read_search(condition, unknown=options.unknown), lake.runs()
    with open_database(lake) as database:
        possible = runs if options.scan_all else search.possible_runs(database)
    counts = _print_runs(console, find_runs(lake, search, possible, options.workers), options)
    if not options.as_json:
        share = f" ({100 * counts.runs / len(runs):.0f} %)" if runs else ""
        unsearched = (
            "" if counts.runs == len(possible) else f"; not searched: {len(possible) - counts.runs}"
        )
        console.print(
            f"Hits: {counts.hits}, in {counts.hit_runs} of {len(runs)} runs;"
            f" searched: {counts.runs}{share}{unsearched}."
        )
    raise typer.Exit(0 if counts.hits else 1)


@dataclass(slots=True)
class _Counts:
    """Counts of what was printed."""

    runs: int = 0
    hit_runs: int = 0
    hits: int = 0


def _print_runs(console: Console, found_runs: Iterable[FoundRun], options: FindOptions) -> _Counts:
    """Print each run, until enough have hits."""
    counts = _Counts()
    for found in found_runs:
        _print_run(console, found, options.as_json)
        counts.runs, counts.hits = counts.runs + 1, counts.hits + len(found.hits)
        counts.hit_runs += bool(found.hits)
        if found.hits and options.clips:
            _cut(None if options.as_json else console, found, options.clips)
        if counts.hit_runs == options.first:
            break
    return counts


def _cut(console: Console | None, found: FoundRun, folder: Path) -> None:
    """Cut the hits of a run out of its footage; missing footage is reported and does not stop the rest."""
    from visup.agent.model.errors import SourceError
    from visup.archive.finding.clips import cut_hits
    from visup.terminal.console import print_error

    try:
        for path in cut_hits(found.clip, found.run, found.hits, folder):
            if console:
                console.print(f"  video: {path}", soft_wrap=True, markup=False, style="dim")
    except SourceError as error:
        print_error(str(error))


def _print_run(console: Console, found: FoundRun, as_json: bool) -> None:
    from visup.agent.storage.jsonable import to_jsonable
    from visup.terminal.console import echo_json

    if as_json:
        for hit in found.hits:
            identity = {"run": found.run, "clip": found.clip, "folder": str(found.folder)}
            echo_json({**identity, **to_jsonable(hit)}, sort_keys=True)
        return
    if found.hits:
        console.print(f"{found.clip}", style="bold", soft_wrap=True, markup=False)
        for line in _lines(found.hits):
            console.print(f"  {line}", soft_wrap=True, markup=False)
        first = found.hits[0].begin
        console.print(
            f"  inspect it: visup step {found.folder} (then: go {first:.1f}s),"
            f" or visup console {found.folder}",
            soft_wrap=True,
            markup=False,
            style="dim",
        )


def _lines(hits: tuple[Hit, ...]) -> Iterator[str]:
    for hit in hits:
        objects = ", ".join(f"{n} ({i})" for n, i in zip(hit.names, hit.objects, strict=True))
        confidence = "" if hit.confidence is None else f", confidence {hit.confidence:.2f}"
        truth = ", unknown" if hit.truth == "unknown" else ""
        end = f"{hit.end:.1f} s" + (" (the end)" if hit.open else "")
        rule = f"{hit.rule}: " if hit.rule else ""
        yield f"{rule}{hit.begin:.1f} to {end}: {objects or 'no particular object'}{confidence}{truth}"
