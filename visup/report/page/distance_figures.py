"""Figures of the distance between two objects over time, with fitted lines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from visup.report.page.figures import MAX_FIGURES, Figure, rounded, time_layout
from visup.report.page.summary import called, span_sentence
from visup.report.records import RunData, StateSpan

TREND_COLOURS = {"converging": "#009e73", "diverging": "#d55e00", "keeping_distance": "#8a8f98"}
MIN_POINTS = 3


@dataclass(frozen=True, slots=True)
class FigureLine:
    """A straight line through the distances of a pair during one kind of motion.

    Attributes:
        span: The time and kind of motion.
        start: Pixels at the first point.
        end: Pixels at the last point.
        slope: Pixels per second.
        times: (first, last) seconds.
    """

    span: StateSpan
    start: float
    end: float
    slope: float
    times: tuple[float, float]


def fitted_lines(
    times: Sequence[float], gaps: Sequence[float], spans: Iterable[StateSpan]
) -> tuple[FigureLine, ...]:
    """Least-squares lines through distances, one for each span (paper, section 7.4).

    A gap of 0 only means that the outlines touch and carries no information about the speed, so such moments
    are left out.

    Args:
        times: Seconds, growing.
        gaps: Pixels.
        spans: The kinds of motion of the pair over time.

    Returns:
        A line for each span with at least three distances above 0.
    """
    t, y = np.asarray(times, float), np.asarray(gaps, float)
    lines = []
    for span in spans:
        inside = (t >= span.start) & (t <= span.end) & (y > 0)
        if inside.sum() < MIN_POINTS:
            continue
        x = t[inside] - t[inside][0]
        slope, start = np.polynomial.polynomial.polyfit(x, y[inside], 1)[::-1]
        ends = float(t[inside][0]), float(t[inside][-1])
        lines.append(
            FigureLine(span, float(start), float(start + slope * x[-1]), float(slope), ends)
        )
    return tuple(lines)


def distance_figures(run: RunData) -> list[Figure]:
    """Distance over time of each pair with its fitted lines, pairs with the most data first."""
    counts: dict[tuple[int, int], int] = {}
    for sample in run.samples:
        for pair in sample.distances:
            counts[pair] = counts.get(pair, 0) + 1
    moving = {tuple(map(int, s.subject[1:])) for s in run.spans_about("relation")}
    order = sorted(counts, key=lambda p: (p not in moving, -counts[p], p))
    shown = [p for p in order if counts[p] >= MIN_POINTS][:MAX_FIGURES]
    return [_distance_figure(run, pair) for pair in shown]


def _distance_figure(run: RunData, pair: tuple[int, int]) -> Figure:
    known = [(s.time, s.distances.get(pair)) for s in run.samples]
    points = [(t, d) for t, d in known if d is not None]
    times, gaps = [t for t, _ in points], [d.gap for _, d in points]
    subject = ("relation", str(pair[0]), str(pair[1]))
    spans = [s for s in run.spans if s.subject == subject and s.value in TREND_COLOURS]
    lines = fitted_lines(times, gaps, spans)
    traces = [*_band(points), _series(known, "distance")]
    traces += [_line_trace(line, lines[:i]) for i, line in enumerate(lines)]
    coupled = [s for s in run.spans if s.subject == subject and s.value == "coupled"]
    trends = "; ".join(
        [f"{span_sentence(x.span)} at {x.slope:+.1f} px/s" for x in lines]
        + [span_sentence(s) for s in coupled]
    )
    layout = time_layout("gap in the image, px", run, rangemode="tozero")
    layout["shapes"] += [_coupled_band(s) for s in coupled]
    names = [called(run, i) for i in pair]
    return Figure(
        f"distance-{pair[0]}-{pair[1]}",
        f"{names[0]} and {names[1]}",
        f"From {gaps[0]:.0f} px at {times[0]:.1f} s to {gaps[-1]:.0f} px at {times[-1]:.1f} s"
        + (f"; {trends}." if trends else "; no lasting trend was reported."),
        traces,
        layout,
    )


def _coupled_band(span: StateSpan) -> dict[str, Any]:
    """A band behind the lines for the time in which a pair was coupled."""
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": rounded(span.start),
        "x1": rounded(span.end),
        "y0": 0,
        "y1": 1,
        "line": {"width": 0},
        "fillcolor": "rgba(0,114,178,0.14)",
        "layer": "below",
        "label": {"text": "coupled", "textposition": "top left", "font": {"size": 12}},
    }


def _series(known: list[tuple[float, Any]], name: str) -> dict[str, Any]:
    """The measured distance; missing data leave a gap in the line."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": [rounded(t) for t, _ in known],
        "y": [None if d is None else rounded(d.gap) for _, d in known],
        "line": {"color": "#7d8796", "width": 1.5},
        "connectgaps": False,
        "hovertemplate": "%{x:.1f} s: %{y:.1f} px<extra></extra>",
    }


def _band(points: list[tuple[float, Any]]) -> list[dict[str, Any]]:
    """A band of one standard deviation, if all points have one."""
    if not points or any(d.sigma is None for _, d in points):
        return []
    times = [rounded(t) for t, _ in points]
    low = [rounded(max(0.0, d.gap - d.sigma)) for _, d in points]
    high = [rounded(d.gap + d.sigma) for _, d in points]
    return [
        {
            "type": "scatter",
            "mode": "lines",
            "name": "± 1 σ",
            "x": times + times[::-1],
            "y": high + low[::-1],
            "fill": "toself",
            "fillcolor": "rgba(125,135,150,0.2)",
            "line": {"width": 0},
            "hoverinfo": "skip",
        }
    ]


def _line_trace(line: FigureLine, before: Sequence[FigureLine]) -> dict[str, Any]:
    trend = line.span.value
    words = trend.replace("_", " ")
    return {
        "type": "scatter",
        "mode": "lines",
        "name": words,
        "legendgroup": words,
        "showlegend": all(b.span.value != trend for b in before),
        "x": [rounded(t) for t in line.times],
        "y": [rounded(line.start), rounded(line.end)],
        "line": {"color": TREND_COLOURS[trend], "width": 4},
        "hovertemplate": f"{words} at {line.slope:+.1f} px/s<extra></extra>",
    }
