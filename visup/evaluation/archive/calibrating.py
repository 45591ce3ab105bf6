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
SAID = {
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

    def of(self, kind: str, what: str) -> str | None:
        """The true value of a subject, or None if not known."""
        if kind == "verdict":
            return self.verdict or None
        return (self.objects if kind == "identity" else self.stages).get(what)


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
        head = reader.fieldnames or ()
        if "source" not in head or set(head) - set(COLUMNS):
            raise SourceError(
                f"the head is: {', '.join(head)}",
                where=str(path),
                expected=f"source, and some of: {', '.join(COLUMNS[1:])}",
            )
        rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as fault:
        raise SourceError(f"the truth cannot be read ({fault})", where=str(path)) from fault
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
    named = database.ask("SELECT run, source FROM lake.runs").to_pylist()
    known = {
        row["run"]: truth[name]
        for row in named
        for name in (row["source"], PurePath(row["source"]).name)
        if name in truth
    }
    if not known:
        raise SourceError(
            "no run of the lake is in the file of the truth",
            expected="in its column `source` what was watched, such as clip.mp4",
        )
    return known


def reliabilities(database: LakeDatabase, known: Mapping[str, RunTruth]) -> tuple[Reliability, ...]:
    """The reliability by kind, for kinds with known truth.

    Args:
        database: The lake.
        known: The truth of its runs by key.
    """
    found = ((kind, list(_judged(database, kind, known))) for kind in KINDS)
    return tuple(reliability(kind, said) for kind, said in found if said)


def reliability(kind: str, said: Sequence[tuple[float, bool]]) -> Reliability:
    """Compute the reliability of confidences.

    Args:
        kind: Kind of statement.
        said: Confidence (0 to 1), and whether it was correct; at least one.

    >>> reliability("verdict", [(0.75, True), (0.75, True), (0.75, True), (0.75, False)]).error
    0.0
    """
    counted = Calibration()
    for confidence, is_right in said:
        counted.add(confidence, is_right)
    squares = ((confidence - is_right) ** 2 for confidence, is_right in said)
    return Reliability(
        kind,
        len(said),
        sum(is_right for _, is_right in said) / len(said),
        counted.error() or 0.0,
        sum(squares) / len(said),
        tuple(counted.table()),
    )


def _judged(
    database: LakeDatabase, kind: str, known: Mapping[str, RunTruth]
) -> Iterator[tuple[float, bool]]:
    table = database.ask(SAID[kind])
    for run, what, told, confidence in zip(*(c.to_pylist() for c in table.columns), strict=True):
        true = known[run].of(kind, what) if run in known else None
        if true is not None:
            yield float(confidence), told == true


def _pairs(text: str | None, where: str) -> dict[str, str]:
    parts = [p.strip() for p in (text or "").split(";") if p.strip()]
    if bad := [p for p in parts if "=" not in p]:
        raise SourceError(
            f"'{bad[0]}' says nothing", where=where, expected="such as: 1=spartan;2=arm"
        )
    return {k.strip(): v.strip() for k, _, v in (p.partition("=") for p in parts)}
