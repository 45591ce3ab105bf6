"""The figures of the report as Plotly draws them: plain values, themed by the page."""

from __future__ import annotations

import html
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from visup.agent import Severity, Status
from visup.report.palette import SEVERITY_COLOURS, STATUS_COLOURS, css, object_colour
from visup.report.records import ReportedObject, RunData, StateSpan
from visup.report.summary import called, name_of, span_sentence

CANDIDATE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#8a8f98")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "solid")
MOVE_COLOURS = {"converging": "#009e73", "diverging": "#d55e00", "keeping_distance": "#8a8f98"}
LEAST_VOTES = 0.03
"""Candidates that never got more votes are left out, as in figure 9 of the paper."""
MOST_CANDIDATES = 6
MOST_FIGURES = 8
MOST_ROWS = 16
MOST_TOLD = 12
FEWEST_POINTS = 3


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure.

    Attributes:
        key: Its id in the page.
        title: What it shows.
        caption: The same in words, for those who cannot see it.
        traces: Plotly traces.
        layout: Plotly layout, without colours of text and ground.
    """

    key: str
    title: str
    caption: str
    traces: list[dict[str, Any]]
    layout: dict[str, Any]


@dataclass(frozen=True, slots=True)
class FigureLine:
    """A straight line through the distances while a pair moved in one way.

    Attributes:
        span: When, and how it moved.
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

    A gap of 0 only says that the outlines touch, not how deep one body is before the other, so that
    such moments tell nothing about the speed and are left out.

    Args:
        times: Seconds, growing.
        gaps: Pixels.
        spans: How the pair moved, and when.

    Returns:
        A line for each span with at least three distances above 0.
    """
    t, y = np.asarray(times, float), np.asarray(gaps, float)
    lines = []
    for span in spans:
        inside = (t >= span.start) & (t <= span.end) & (y > 0)
        if inside.sum() < FEWEST_POINTS:
            continue
        x = t[inside] - t[inside][0]
        slope, start = np.polynomial.polynomial.polyfit(x, y[inside], 1)[::-1]
        ends = float(t[inside][0]), float(t[inside][-1])
        lines.append(
            FigureLine(span, float(start), float(start + slope * x[-1]), float(slope), ends)
        )
    return tuple(lines)


def distance_figures(run: RunData) -> list[Figure]:
    """Distance over time of each pair with its fitted lines, the longest known pairs first."""
    counts: dict[tuple[int, int], int] = {}
    for sample in run.samples:
        for pair in sample.distances:
            counts[pair] = counts.get(pair, 0) + 1
    moving = {tuple(map(int, s.subject[1:])) for s in run.spans_about("relation")}
    order = sorted(counts, key=lambda p: (p not in moving, -counts[p], p))
    shown = [p for p in order if counts[p] >= FEWEST_POINTS][:MOST_FIGURES]
    return [_distance_figure(run, pair) for pair in shown]


def _distance_figure(run: RunData, pair: tuple[int, int]) -> Figure:
    known = [(s.time, s.distances.get(pair)) for s in run.samples]
    points = [(t, d) for t, d in known if d is not None]
    times, gaps = [t for t, _ in points], [d.gap for _, d in points]
    subject = ("relation", str(pair[0]), str(pair[1]))
    spans = [s for s in run.spans if s.subject == subject and s.value in MOVE_COLOURS]
    lines = fitted_lines(times, gaps, spans)
    traces = [*_band(points), _series(known, "distance")]
    traces += [_line_trace(line, lines[:i]) for i, line in enumerate(lines)]
    coupled = [s for s in run.spans if s.subject == subject and s.value == "coupled"]
    told = "; ".join(
        [f"{span_sentence(x.span)} at {x.slope:+.1f} px/s" for x in lines]
        + [span_sentence(s) for s in coupled]
    )
    layout = _layout("gap in the image, px", run, rangemode="tozero")
    layout["shapes"] += [_shaded(s) for s in coupled]
    names = [called(run, i) for i in pair]
    return Figure(
        f"distance-{pair[0]}-{pair[1]}",
        f"{names[0]} and {names[1]}",
        f"From {gaps[0]:.0f} px at {times[0]:.1f} s to {gaps[-1]:.0f} px at {times[-1]:.1f} s"
        + (f"; {told}." if told else "; no lasting way of moving was told."),
        traces,
        layout,
    )


def _shaded(span: StateSpan) -> dict[str, Any]:
    """A stretch of time in which a pair was one body, as a band behind the lines."""
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": _short(span.start),
        "x1": _short(span.end),
        "y0": 0,
        "y1": 1,
        "line": {"width": 0},
        "fillcolor": "rgba(0,114,178,0.14)",
        "layer": "below",
        "label": {"text": "coupled", "textposition": "top left", "font": {"size": 12}},
    }


def _series(known: list[tuple[float, Any]], name: str) -> dict[str, Any]:
    """The measured distance; a gap in what is known stays a gap in the line."""
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": [_short(t) for t, _ in known],
        "y": [None if d is None else _short(d.gap) for _, d in known],
        "line": {"color": "#7d8796", "width": 1.5},
        "connectgaps": False,
        "hovertemplate": "%{x:.1f} s: %{y:.1f} px<extra></extra>",
    }


def _band(points: list[tuple[float, Any]]) -> list[dict[str, Any]]:
    """One standard deviation to both sides, where all points have one."""
    if not points or any(d.sigma is None for _, d in points):
        return []
    times = [_short(t) for t, _ in points]
    low = [_short(max(0.0, d.gap - d.sigma)) for _, d in points]
    high = [_short(d.gap + d.sigma) for _, d in points]
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
    move = line.span.value
    words = move.replace("_", " ")
    return {
        "type": "scatter",
        "mode": "lines",
        "name": words,
        "legendgroup": words,
        "showlegend": all(b.span.value != move for b in before),
        "x": [_short(t) for t in line.times],
        "y": [_short(line.start), _short(line.end)],
        "line": {"color": MOVE_COLOURS[move], "width": 4},
        "hovertemplate": f"{words} at {line.slope:+.1f} px/s<extra></extra>",
    }


def vote_figures(run: RunData) -> list[Figure]:
    """Votes over time for each object that has any (paper, figure 9)."""
    voted = {i for s in run.samples for i in s.votes}
    subjects = [s for s in run.objects if s.id in voted]
    longest = sorted(subjects, key=lambda s: (s.first_seen - s.last_seen, s.id))[:MOST_FIGURES]
    return [_vote_figure(run, s) for s in sorted(longest, key=lambda s: s.id)]


def _vote_figure(run: RunData, subject: ReportedObject) -> Figure:
    samples = [(s.time, s.votes.get(subject.id)) for s in run.samples]
    peaks: dict[str, float] = {}
    for _, votes in samples:
        for name, value in (votes or {}).items():
            peaks[name] = max(peaks.get(name, 0.0), value)
    best = sorted(peaks, key=lambda n: (-peaks[n], n))
    shown = [n for n in best if peaks[n] > LEAST_VOTES][:MOST_CANDIDATES] or best[:1]
    traces = [_vote_trace(samples, name, i) for i, name in enumerate(shown)]
    left_out = len(peaks) - len(shown)
    caption = f"Highest votes: {', '.join(f'{n} {peaks[n]:.2f}' for n in shown[:3])}"
    caption += f"; {left_out} weaker left out." if left_out else "."
    return Figure(
        f"votes-{subject.id}",
        name_of(subject),
        caption,
        traces,
        _layout("votes", run, rangemode="tozero"),
    )


def _vote_trace(samples: list[tuple[float, Any]], name: str, i: int) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": html.escape(name),
        "x": [_short(t) for t, _ in samples],
        "y": [_known(v, name) for _, v in samples],
        "line": {
            "color": CANDIDATE_COLOURS[i % len(CANDIDATE_COLOURS)],
            "dash": DASHES[i % len(DASHES)],
            "width": 3 if i == 0 else 1.8,
        },
        "connectgaps": False,
        "hovertemplate": f"{html.escape(name)}: %{{y:.2f}} at %{{x:.1f}} s<extra></extra>",
    }


def _known(votes: Mapping[str, float] | None, name: str) -> float | None:
    """Votes for a name; those that were not kept are unknown, not zero."""
    value = (votes or {}).get(name)
    return None if value is None else _short(value)


def stage_figure(run: RunData) -> Figure | None:
    """How each stage of each task stood, over time."""
    several = len(run.tasks) > 1
    rows: dict[tuple[str, ...], str] = {
        ("stage", t.task, s.stage): f"{t.task}: {s.stage}" if several else s.stage
        for t in run.tasks
        for s in t.stages
    }
    colours = {s.value: css(STATUS_COLOURS[s]) for s in Status}
    return _timeline("stages", "Stages", run, rows, lambda s: colours[s.value])


def presence_figure(run: RunData) -> Figure | None:
    """When each object was seen or hidden."""
    longest = sorted(run.objects, key=lambda s: (s.first_seen - s.last_seen, s.id))[:MOST_ROWS]
    rows: dict[tuple[str, ...], str] = {
        ("presence", str(s.id)): name_of(s) for s in sorted(longest, key=lambda s: s.id)
    }
    figure = _timeline(
        "presence", "In view", run, rows, lambda s: css(object_colour(int(s.subject[1])))
    )
    for trace in figure.traces if figure else []:
        trace["showlegend"] = False
    return figure


def _timeline(
    key: str,
    title: str,
    run: RunData,
    rows: Mapping[tuple[str, ...], str],
    colour_of: Callable[[StateSpan], str],
) -> Figure | None:
    """Bars over time, one row for each subject, one trace for each value."""
    spans = sorted((s for s in run.spans if s.subject in rows), key=lambda s: s.start)
    if not spans:
        return None
    values = dict.fromkeys(s.value for s in spans)
    layout = _layout("", run)
    layout["barmode"] = "overlay"
    layout["height"] = 110 + 40 * len(rows)
    layout["yaxis"] |= {
        "autorange": "reversed",
        "categoryorder": "array",
        "categoryarray": [html.escape(label) for label in rows.values()],
        "automargin": True,
    }
    told = [f"{rows[s.subject]}: {span_sentence(s)}" for s in spans if s.value != "pending"]
    caption = "; ".join(told[:MOST_TOLD]) + ("; and more." if len(told) > MOST_TOLD else ".")
    traces = [_bars([s for s in spans if s.value == v], rows, colour_of) for v in values]
    return Figure(key, title, caption if told else "Nothing has begun.", traces, layout)


def _bars(
    spans: list[StateSpan],
    rows: Mapping[tuple[str, ...], str],
    colour_of: Callable[[StateSpan], str],
) -> dict[str, Any]:
    """All spans of one value; what waits or is hidden is faint."""
    words = spans[0].value.replace("_", " ")
    faint = spans[0].value in ("pending", "hidden")
    return {
        "type": "bar",
        "orientation": "h",
        "name": words,
        "y": [html.escape(rows[s.subject]) for s in spans],
        "base": [_short(s.start) for s in spans],
        "x": [_short(s.end - s.start) for s in spans],
        "customdata": [[_short(s.start), _short(s.end)] for s in spans],
        "marker": {"color": [colour_of(s) for s in spans], "opacity": 0.3 if faint else 1.0},
        "width": 0.62,
        "hovertemplate": (
            f"%{{y}}: {words} from %{{customdata[0]:.1f}} to %{{customdata[1]:.1f}} s"
            "<extra></extra>"
        ),
    }


def _layout(y_title: str, run: RunData, rangemode: str = "normal") -> dict[str, Any]:
    """What all figures share: one time axis, and a mark where an alert opened."""
    grave = [a for a in run.alerts if a.severity > Severity.INFO]
    return {
        "height": 300,
        "margin": {"l": 56, "r": 16, "t": 12, "b": 44},
        "hovermode": "closest",
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "xaxis": {
            "title": {"text": "time, s"},
            "range": [0, max(run.duration, 1e-3)],
            "zeroline": False,
        },
        "yaxis": {"title": {"text": y_title}, "rangemode": rangemode, "zeroline": False},
        "shapes": [
            {
                "type": "line",
                "xref": "x",
                "yref": "paper",
                "x0": _short(a.opened),
                "x1": _short(a.opened),
                "y0": 0,
                "y1": 1,
                "line": {"color": css(SEVERITY_COLOURS[a.severity]), "width": 1.5, "dash": "dot"},
            }
            for a in grave[:20]
        ],
    }


def _short(x: float) -> float:
    """Rounded, so that the page stays small."""
    return round(float(x), 3)
