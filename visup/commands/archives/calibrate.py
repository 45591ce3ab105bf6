"""`visup archive calibrate`: how well the confidences of a lake are calibrated."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.commands.archives.lake_argument import LakeLocation

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from rich.table import Table

    from visup.archive.lake import Lake
    from visup.evaluation.archive.reliability import Reliability, RunTruth

NOT_FITTED = "No settings were fitted; use --fit FILE."


def calibrate(
    location: LakeLocation,
    truth: Annotated[
        Path,
        typer.Option(metavar="FILE", help="Ground truth (CSV): source,verdict,objects,stages."),
    ],
    page: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write a page with reliability diagrams.")
    ] = None,
    fit: Annotated[
        Path | None,
        typer.Option(
            metavar="TOML", help="Fit the weight of votes; write settings for `visup watch`."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON.")] = False,
) -> None:
    """Check calibration: how often statements of a given confidence were right."""
    from visup.archive.querying.database import open_database
    from visup.archive.storing.places import open_lake
    from visup.evaluation.archive.calibration_page import calibration_page
    from visup.evaluation.archive.reliability import read_truth, reliabilities, truth_by_run
    from visup.report.page.shell import write_page
    from visup.terminal.console import echo_json

    lake = open_lake(location)
    with open_database(lake) as database:
        truths = truth_by_run(database, read_truth(truth))
        results = reliabilities(database, truths)
    fitted = _fit(lake, truths, fit) if fit else NOT_FITTED
    if page:
        write_page(calibration_page(results, Path(location), fitted), page)
    if as_json:
        echo_json([asdict(result) for result in results])
        return
    notes = [fitted] if fit else []
    _print_figures(results, notes + ([f"Page: {page}"] if page else []))


def _fit(lake: Lake, truths: Mapping[str, RunTruth], path: Path) -> str:
    """Fit the weight of identity votes and write it; returns a sentence about the result."""
    from visup.agent.model.errors import OutputError
    from visup.agent.storage.atomic import write_atomically
    from visup.evaluation.archive.vote_fitting import MIN_LABELLED, fitted_evidence, labelled_votes
    from visup.rules.identity import VoteSettings
    from visup.runs.inputs.settings_file import fitted_settings

    labelled = list(labelled_votes(lake, truths))
    evidence = fitted_evidence(labelled)
    if evidence is None:
        return (
            f"{len(labelled)} objects are labelled;"
            f" fitting the weight of votes takes at least {MIN_LABELLED}."
        )
    comment = (
        f"Weight of a vote for an identity, fitted to {len(labelled)} labelled objects;"
        f" the default is {VoteSettings().evidence:g}."
    )
    try:
        write_atomically(path, fitted_settings(evidence, comment).encode())
    except OSError as error:
        reason = error.strerror or str(error)
        raise OutputError(f"the settings cannot be written ({reason})", where=str(path)) from error
    return f"{comment} Fitted: {evidence:.3f}, written to {path}."


def _print_figures(results: Sequence[Reliability], notes: Sequence[str]) -> None:
    """Print a summary and a table of each kind of statement, then the notes."""
    from visup.terminal.console import make_console

    console = make_console()
    for result in results:
        console.print(_summary(result), soft_wrap=True, markup=False)
        console.print(_reliability_table(result))
    for text in notes:
        console.print(text, soft_wrap=True, markup=False)


def _summary(result: Reliability) -> str:
    return (
        f"Statements about {result.kind}: {result.count}, of which {result.right:.0%} right;"
        f" calibration error {result.error:.3f}, Brier score {result.brier:.3f}"
    )


def _reliability_table(result: Reliability) -> Table:
    from visup.terminal.tables import table

    rows = table("count", "confidence", "right")
    for bin_ in result.bins:
        rows.add_row(f"{bin_['count']:.0f}", f"{bin_['confidence']:.2f}", f"{bin_['right']:.2f}")
    return rows
