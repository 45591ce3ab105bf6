"""The Plotly figures of a lake's report."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape
from typing import Any

from visup.archive.reporting.statistics import LakeStatistics, StageDuration
from visup.report.page.figures import CANDIDATE_COLOURS, Figure, rounded

BAND = "rgba(0, 114, 178, 0.18)"
LINE = "#0072b2"
VERDICT_COLOURS = {
    "succeeded": "#009e73",
    "failed": "#d55e00",
    "interrupted": "#cc79a7",
    "in_progress": "#56b4e9",
    "unknown": "#8a8f98",
    "none": "#b8bcc4",
}
MAX_STAGES = 24


def verdict_figure(statistics: LakeStatistics) -> Figure | None:
    """Verdicts of the runs by week."""
    dated = [v for v in statistics.verdicts if v[0]]
    if not dated:
        return None
    weeks = sorted({week for week, _, _ in dated})
    counts = {(week, verdict): n for week, verdict, n in dated}
    traces = [
        {
            "type": "bar",
            "name": escape(verdict.replace("_", " ")),
            "x": weeks,
            "y": [counts.get((week, verdict), 0) for week in weeks],
            "marker": {"color": VERDICT_COLOURS.get(verdict, CANDIDATE_COLOURS[0])},
        }
        for verdict in sorted({verdict for _, verdict, _ in dated})
    ]
    caption = f"Weeks from {weeks[0]} to {weeks[-1]}."
    layout = {**_layout("runs"), "barmode": "stack"}
    return Figure("verdicts", "Runs per week, by verdict", caption, traces, layout)


def duration_figures(statistics: LakeStatistics) -> list[Figure]:
    """Durations of each stage by week."""
    return [
        _duration_figure(
            n, d, [w for w in statistics.by_week if (w.task, w.stage) == (d.task, d.stage)]
        )
        for n, d in enumerate(statistics.durations[:MAX_STAGES])
        if any((w.task, w.stage) == (d.task, d.stage) for w in statistics.by_week)
    ]


def _duration_figure(number: int, stage: StageDuration, weeks: list[StageDuration]) -> Figure:
    x = [w.group for w in weeks]
    bounds = [rounded(w.high) for w in weeks], [rounded(w.low) for w in reversed(weeks)]
    band = {
        "type": "scatter",
        "name": "middle 80 % of runs",
        "x": [*x, *reversed(x)],
        "y": [*bounds[0], *bounds[1]],
        "fill": "toself",
        "fillcolor": BAND,
        "line": {"width": 0},
        "hoverinfo": "skip",
    }
    median = {
        "type": "scatter",
        "mode": "lines+markers",
        "name": "median",
        "x": x,
        "y": [rounded(w.mid) for w in weeks],
        "customdata": [w.runs for w in weeks],
        "line": {"color": LINE},
        "hovertemplate": "%{y:.1f} s, %{customdata} runs<extra></extra>",
    }
    caption = (
        f"Median {stage.mid:.1f} s over {stage.runs} runs; the middle 80 % took {stage.low:.1f} to"
        f" {stage.high:.1f} s, the longest {stage.longest:.1f} s."
    )
    title = f"Stage '{stage.stage}' of task '{stage.task}'"
    return Figure(f"stage-{number}", title, caption, [band, median], _layout("seconds"))


def all_figures(statistics: LakeStatistics) -> Iterator[Figure]:
    """All figures in the order of the page."""
    verdicts = verdict_figure(statistics)
    yield from [verdicts] if verdicts else []
    yield from duration_figures(statistics)


def _layout(y_title: str) -> dict[str, Any]:
    return {
        "height": 300,
        "margin": {"l": 56, "r": 16, "t": 12, "b": 44},
        "hovermode": "x unified",
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "xaxis": {"type": "date", "zeroline": False},
        "yaxis": {"title": {"text": y_title}, "rangemode": "tozero", "zeroline": False},
    }
