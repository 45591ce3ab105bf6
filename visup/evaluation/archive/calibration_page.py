"""The page of a calibration: reliability diagrams, figures, and fitted settings."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from visup.archive.reporting.figures import BAND, LINE
from visup.archive.reporting.page import archive_page, html_table
from visup.evaluation.archive.calibrating import Reliability
from visup.report.page.figures import Figure, rounded
from visup.report.page.sections import figures

NUMBERS_HEAD = ("statements about", "count", "right", "calibration error", "Brier score")
SMALLEST_PX, LARGEST_PX = 6.0, 24.0


def calibration_page(found: Sequence[Reliability], lake: Path, fitted: str) -> str:
    """The whole page; deterministic.

    Args:
        found: Reliability of each kind of statement.
        lake: The lake, for the title.
        fitted: A sentence about fitted settings.

    Raises:
        ExtraMissingError: Plotly is not installed.
    """
    drawn = [reliability_figure(one) for one in found]
    rows = [
        (one.kind, f"{one.count:,}", f"{one.right:.0%}", f"{one.error:.3f}", f"{one.brier:.3f}")
        for one in found
    ]
    text = {
        "title": escape(lake.absolute().name),
        "diagrams": figures(drawn, "No statement can be compared with the ground truth."),
        "numbers": html_table(
            NUMBERS_HEAD, rows, "No statement can be compared with the ground truth."
        ),
        "fitted": escape(fitted),
    }
    return archive_page("calibration.html", text, drawn, "calibration")


def reliability_figure(one: Reliability) -> Figure:
    """A reliability diagram: the share of right statements at each level of confidence."""
    most = max(b["count"] for b in one.bins)
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
        "name": one.kind,
        "x": [rounded(b["confidence"]) for b in one.bins],
        "y": [rounded(b["right"]) for b in one.bins],
        "customdata": [b["count"] for b in one.bins],
        "marker": {"size": [_size(b["count"] / most) for b in one.bins]},
        "line": {"color": LINE},
        "hovertemplate": "confidence %{x:.2f}, right %{y:.2f}, count %{customdata:.0f}<extra></extra>",
    }
    caption = (
        f"Statements: {one.count:,}, of which {one.right:.0%} right; calibration error {one.error:.3f},"
        f" Brier score {one.brier:.3f}."
    )
    title = f"Confidence of {one.kind}"
    return Figure(f"reliability-{one.kind}", title, caption, [line, points], _layout())


def _size(share: float) -> float:
    """Diameter of a point, pixels, with an area proportional to its share."""
    return rounded(SMALLEST_PX + (LARGEST_PX - SMALLEST_PX) * share**0.5)


def _layout() -> dict[str, Any]:
    axis = {"range": [-0.04, 1.04], "zeroline": False}
    return {
        "height": 360,
        "margin": {"l": 56, "r": 16, "t": 12, "b": 44},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "xaxis": {**axis, "title": {"text": "confidence"}},
        "yaxis": {**axis, "title": {"text": "share right"}},
    }
