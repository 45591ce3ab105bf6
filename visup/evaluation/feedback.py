"""Precision of alerts, from the feedback given in the console."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from visup.agent import Alert
from visup.agent.model.errors import VisupError
from visup.api.recorded import open_run
from visup.console.feedback import AlertFeedback, KindPrecision, precisions, read_feedback
from visup.console.library import RunLibrary
from visup.evaluation.figures import Progress, silent


def evaluate_feedback(folder: Path, progress: Progress = silent) -> dict[str, Any]:
    """The precision of alerts over all runs below a folder.

    Args:
        folder: Searched recursively for run folders; unreadable ones are counted and skipped.
        progress: Shows what is being done.

    Returns:
        `items` by kind of alert: `alerts`, `right`, `false`, `precision` (None without feedback);
        `total` over all, with `runs` and `unreadable`.
    """
    entries = RunLibrary([folder]).scan()
    readable = [e.folder for e in entries if not e.problem]
    kinds = precisions(_alerts_with_feedback(readable, progress))
    alerts, right, false = (sum(getattr(k, n) for k in kinds) for n in ("alerts", "right", "false"))
    overall = _figures(KindPrecision("", alerts, right, false))
    counts = {"runs": len(readable), "unreadable": len(entries) - len(readable)}
    return {"items": {k.kind: _figures(k) for k in kinds}, "total": {**overall, **counts}}


def _alerts_with_feedback(
    folders: list[Path], progress: Progress
) -> Iterator[tuple[tuple[Alert, ...], Mapping[int, AlertFeedback]]]:
    for folder in folders:
        progress(folder.name)
        try:
            yield tuple(open_run(folder).alerts), read_feedback(folder)
        except VisupError:
            continue


def _figures(kind: KindPrecision) -> dict[str, Any]:
    counts = {"alerts": kind.alerts, "right": kind.right, "false": kind.false}
    return {**counts, "precision": kind.precision}
