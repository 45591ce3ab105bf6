"""Calibration of the confidences of a lake on runs with known truth."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path, PurePath

from visup.agent.model.errors import SourceError
from visup.agent.storage.text_file import read_text_file
from visup.archive.filling.clips import MAX_MANIFEST_BYTES
from visup.archive.querying.database import LakeDatabase
from visup.evaluation.calibration import Calibration

COLUMNS = ("source", "verdict", "objects", "stages")
KINDS = ("identity", "stage", "verdict")
STATEMENT_QUERIES = {
    "identity": (
        "SELECT run, object::VARCHAR, name, confidence FROM lake.objects WHERE confirmed ORDER BY ALL"
    ),
    "stage": "SELECT run, stage, status, confidence FROM lake.stages WHERE open ORDER BY ALL",
    "verdict": "SELECT run, task, verdict, confidence FROM lake.tasks WHERE open ORDER BY ALL",
}
"""Final statements: run, subject, value, confidence."""


@dataclass(frozen=True, slots=True)
class RunTruth:
    """The truth of a run.

    Attributes:
        verdict: The verdict, or ''.
        objects: Number of an object -> its model.
        stages: Stage -> its final status.
    """

    verdict: str
    objects: Mapping[str, str]
    stages: Mapping[str, str]

    def of(self, kind: str, subject: str) -> str | None:
        """The true value of a subject, or None if not known."""
        if kind == "verdict":
            return self.verdict or None
        return (self.objects if kind == "identity" else self.stages).get(subject)


@dataclass(frozen=True, slots=True)
class Reliability:
    """The reliability of the confidences of one kind.

    Attributes:
        kind: 'identity', 'stage' or 'verdict'.
        count: Number of statements with known truth.
        right: Share of correct ones.
        error: Expected calibration error over all bins.
        brier: Brier score: mean squared difference of confidence and truth.
        bins: Rows of `Calibration.table`, by increasing confidence.
    """

    kind: str
    count: int
    right: float
    error: float
    brier: float
    bins: tuple[Mapping[str, float], ...]


def read_truth(path: Path) -> dict[str, RunTruth]:
    """Read the truth of runs by source or clip name.

    Args:
        path: CSV with the column `source`, and those of `verdict`, `objects` (`1=spartan;2=arm`) and
            `stages` (`captured=done`) that are known.

    Raises:
        SourceError: It cannot be read, or is malformed.
    """
    try:
        reader = csv.DictReader(StringIO(read_text_file(path, MAX_MANIFEST_BYTES)), strict=True)
        header = reader.fieldnames or ()
        if "source" not in header or set(header) - set(COLUMNS):
            raise SourceError(
                f"the head is: {', '.join(header)}",
                where=str(path),
                expected=f"source, and some of: {', '.join(COLUMNS[1:])}",
            )
        rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise SourceError(f"the truth cannot be read ({error})", where=str(path)) from error
    return {
        row["source"]: RunTruth(
            (row.get("verdict") or "").strip(),
            _pairs(row.get("objects"), f"{path}:{line}"),
            _pairs(row.get("stages"), f"{path}:{line}"),
        )
        for line, row in rows
    }


def truth_by_run(database: LakeDatabase, truth: Mapping[str, RunTruth]) -> Mapping[str, RunTruth]:
    """The truth of the runs of a lake by key.

    Args:
        database: The lake.
        truth: Truth by source or clip name.

    Raises:
        SourceError: No run of the lake has a known truth.
    """
    runs = database.ask("SELECT run, source FROM lake.runs").to_pylist()
    known = {
        row["run"]: truth[name]
        for row in runs
        for name in (row["source"], PurePath(row["source"]).name)
        if name in truth
    }
    if not known:
        raise SourceError(
            "no run of the lake is in the file of the truth",
            expected="in its column `source` what was watched, such as clip.mp4",
        )
    return known


def reliabilities(database: LakeDatabase, truth: Mapping[str, RunTruth]) -> tuple[Reliability, ...]:
    """The reliability by kind, for kinds with known truth.

    Args:
        database: The lake.
        truth: The truth of its runs by key.
    """
    by_kind = ((kind, list(_checked_statements(database, kind, truth))) for kind in KINDS)
    return tuple(reliability(kind, statements) for kind, statements in by_kind if statements)


def reliability(kind: str, statements: Sequence[tuple[float, bool]]) -> Reliability:
    """Compute the reliability of confidences.

    Args:
        kind: Kind of statement.
        statements: Confidence (0 to 1), and whether it was correct; at least one.

    >>> reliability("verdict", [(0.75, True), (0.75, True), (0.75, True), (0.75, False)]).error
    0.0
    """
    calibration = Calibration()
    for confidence, correct in statements:
        calibration.add(confidence, correct)
    squared_errors = ((confidence - correct) ** 2 for confidence, correct in statements)
    return Reliability(
        kind,
        len(statements),
        sum(correct for _, correct in statements) / len(statements),
        calibration.error() or 0.0,
        sum(squared_errors) / len(statements),
        tuple(calibration.table()),
    )


def _checked_statements(
    database: LakeDatabase, kind: str, truth: Mapping[str, RunTruth]
) -> Iterator[tuple[float, bool]]:
    table = database.ask(STATEMENT_QUERIES[kind])
    for run, subject, reported, confidence in zip(
        *(column.to_pylist() for column in table.columns), strict=True
    ):
        true_value = truth[run].of(kind, subject) if run in truth else None
        if true_value is not None:
            yield float(confidence), reported == true_value


def _pairs(text: str | None, where: str) -> dict[str, str]:
    parts = [part.strip() for part in (text or "").split(";") if part.strip()]
    if malformed := [part for part in parts if "=" not in part]:
        raise SourceError(
            f"'{malformed[0]}' says nothing", where=where, expected="such as: 1=spartan;2=arm"
        )
    return {key.strip(): value.strip() for key, _, value in (part.partition("=") for part in parts)}
