"""The page of a calibration: reliability diagrams, figures, and fitted settings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from visup.archive.reporting.figures import BAND, LINE
from visup.archive.reporting.page import archive_page, html_table
from visup.evaluation.archive.reliability import Reliability
from visup.report.page.figures import Figure, rounded
from visup.report.page.sections import figures

TABLE_HEADER = ("statements about", "count", "right", "calibration error", "Brier score")
MIN_MARKER_PX, MAX_MARKER_PX = 6.0, 24.0


def calibration_page(reliabilities: Sequence[Reliability], lake: Path, fitted: str) -> str:
    """The whole page; deterministic.

    Args:
        reliabilities: Reliability of each kind of statement.
        lake: The lake, for the title.
        fitted: A sentence about fitted settings.

    Returns:
        HTML.

    Raises:
        ExtraMissingError: Plotly is not installed.
    """
    diagrams = [reliability_figure(r) for r in reliabilities]
    rows = [
        (
            r.kind,
            f"{r.count:,}",
            f"{r.right:.0%}",
            f"{r.error:.3f}",
            f"{r.brier:.3f}",
        )
        for r in reliabilities
    ]
    text = {
        "title": escape(lake.absolute().name),
        "diagrams": figures(diagrams, "No statement can be compared with the ground truth."),
        "numbers": html_table(
            TABLE_HEADER, rows, "No statement can be compared with the ground truth."
        ),
        "fitted": escape(fitted),
    }
    return archive_page("calibration.html", text, diagrams, "calibration")


def reliability_figure(reliability: Reliability) -> Figure:
    """A reliability diagram: the share of right statements at each level of confidence."""
    max_count = max(b["count"] for b in reliability.bins)
    line = {
        "type": "scatter",
        "mode": "lines",
        "name": "perfect calibration",
        "x": [0, 1],
        "y": [0, 1],
        "line": {"color": BAND, "dash": "dot"},
        "hoverinfo": "skip",
    }
    points = {
        "type": "scatter",
        "mode": "lines+markers",
        "name": reliability.kind,
        "x": [rounded(b["confidence"]) for b in reliability.bins],
        "y": [rounded(b["right"]) for b in reliability.bins],
        "customdata": [b["count"] for b in reliability.bins],
        "marker": {"size": [_marker_size(b["count"] / max_count) for b in reliability.bins]},
        "line": {"color": LINE},
        "hovertemplate": "confidence %{x:.2f}, right %{y:.2f}, count %{customdata:.0f}<extra></extra>",
    }
    caption = (
        f"Statements: {reliability.count:,}, of which {reliability.right:.0%} right;"
        f" calibration error {reliability.error:.3f}, Brier score {reliability.brier:.3f}."
    )
    title = f"Confidence of {reliability.kind}"
    return Figure(f"reliability-{reliability.kind}", title, caption, [line, points], _layout())


def _marker_size(share: float) -> float:
    """Diameter of a point, pixels, with an area proportional to its share."""
    return rounded(MIN_MARKER_PX + (MAX_MARKER_PX - MIN_MARKER_PX) * share**0.5)


def _layout() -> dict[str, Any]:
    axis = {"range": [-0.04, 1.04], "zeroline": False}
    return {
        "height": 360,
        "margin": {"l": 56, "r": 16, "t": 12, "b": 44},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "xaxis": {**axis, "title": {"text": "confidence"}},
        "yaxis": {**axis, "title": {"text": "share right"}},
    }
