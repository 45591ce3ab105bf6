"""The Plotly figures of the report as plain values, themed by the page."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from visup.agent import Severity, Status
from visup.report.page.summary import name_of, span_sentence
from visup.report.palette import SEVERITY_COLOURS, STATUS_COLOURS, css, object_colour
from visup.report.records import ReportedObject, RunData, StateSpan

CANDIDATE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#8a8f98")
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "solid")
MIN_VOTES = 0.03
"""Candidates that never exceed this share of votes are left out, as in figure 9 of the paper."""
MAX_CANDIDATES = 6
MAX_FIGURES = 8
MAX_ROWS = 16
MAX_CAPTION_SPANS = 12


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure.

    Attributes:
        key: Its id in the page.
        title: Its title.
        caption: A description for screen readers.
        traces: Plotly traces.
        layout: Plotly layout, without colours of text and ground.
    """

    key: str
    title: str
    caption: str
    traces: list[dict[str, Any]]
    layout: dict[str, Any]


def vote_figures(run: RunData) -> list[Figure]:
    """Votes over time for each object that has any (paper, figure 9)."""
    return [_candidate_figure(run, s, "votes", "votes") for s in _identified(run)]


def likelihood_figures(run: RunData) -> list[Figure]:
    """The identity probabilities of each object over time."""
    figures = [_candidate_figure(run, s, "likelihoods", "likelihood") for s in _identified(run)]
    for figure in figures:
        figure.layout["yaxis"] |= {"range": [0, 1.02], "autorange": False}
    return figures


def _identified(run: RunData) -> list[ReportedObject]:
    """The objects that were matched with models, longest in view first."""
    voted = {i for s in run.samples for i in s.votes}
    subjects = [s for s in run.objects if s.id in voted]
    longest = sorted(subjects, key=lambda s: (s.first_seen - s.last_seen, s.id))[:MAX_FIGURES]
    return sorted(longest, key=lambda s: s.id)


def _candidate_figure(run: RunData, subject: ReportedObject, series: str, word: str) -> Figure:
    samples = [(s.time, getattr(s, series).get(subject.id)) for s in run.samples]
    peaks: dict[str, float] = {}
    for _, votes in samples:
        for name, value in (votes or {}).items():
            peaks[name] = max(peaks.get(name, 0.0), value)
    best = sorted(peaks, key=lambda n: (-peaks[n], n))
    shown = [n for n in best if peaks[n] > MIN_VOTES][:MAX_CANDIDATES] or best[:1]
    traces = [_vote_trace(samples, name, i) for i, name in enumerate(shown)]
    left_out = len(peaks) - len(shown)
    caption = f"Highest {word}: {', '.join(f'{n} {peaks[n]:.2f}' for n in shown[:3])}"
    caption += f"; {left_out} weaker left out." if left_out else "."
    return Figure(
        f"{series}-{subject.id}",
        name_of(subject),
        caption,
        traces,
        time_layout(word, run, rangemode="tozero"),
    )


def _vote_trace(samples: list[tuple[float, Any]], name: str, i: int) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines",
        "name": html.escape(name),
        "x": [rounded(t) for t, _ in samples],
        "y": [_votes_for(v, name) for _, v in samples],
        "line": {
            "color": CANDIDATE_COLOURS[i % len(CANDIDATE_COLOURS)],
            "dash": DASHES[i % len(DASHES)],
            "width": 3 if i == 0 else 1.8,
        },
        "connectgaps": False,
        "hovertemplate": f"{html.escape(name)}: %{{y:.2f}} at %{{x:.1f}} s<extra></extra>",
    }


def _votes_for(votes: Mapping[str, float] | None, name: str) -> float | None:
    """Votes for a name; missing ones are unknown, not zero."""
    value = (votes or {}).get(name)
    return None if value is None else rounded(value)


def stage_figure(run: RunData) -> Figure | None:
    """The status of each stage of each task over time."""
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
    longest = sorted(run.objects, key=lambda s: (s.first_seen - s.last_seen, s.id))[:MAX_ROWS]
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
    layout = time_layout("", run)
    layout["barmode"] = "overlay"
    layout["height"] = 110 + 40 * len(rows)
    layout["yaxis"] |= {
        "autorange": "reversed",
        "categoryorder": "array",
        "categoryarray": [html.escape(label) for label in rows.values()],
        "automargin": True,
    }
    sentences = [f"{rows[s.subject]}: {span_sentence(s)}" for s in spans if s.value != "pending"]
    caption = "; ".join(sentences[:MAX_CAPTION_SPANS]) + (
        "; and more." if len(sentences) > MAX_CAPTION_SPANS else "."
    )
    traces = [_bars([s for s in spans if s.value == v], rows, colour_of) for v in values]
    return Figure(key, title, caption if sentences else "Nothing has begun.", traces, layout)


def _bars(
    spans: list[StateSpan],
    rows: Mapping[tuple[str, ...], str],
    colour_of: Callable[[StateSpan], str],
) -> dict[str, Any]:
    """All spans of one value; pending and hidden ones are faint."""
    label = spans[0].value.replace("_", " ")
    faint = spans[0].value in ("pending", "hidden")
    return {
        "type": "bar",
        "orientation": "h",
        "name": label,
        "y": [html.escape(rows[s.subject]) for s in spans],
        "base": [rounded(s.start) for s in spans],
        "x": [rounded(s.end - s.start) for s in spans],
        "customdata": [[rounded(s.start), rounded(s.end)] for s in spans],
        "marker": {"color": [colour_of(s) for s in spans], "opacity": 0.3 if faint else 1.0},
        "width": 0.62,
        "hovertemplate": (
            f"%{{y}}: {label} from %{{customdata[0]:.1f}} to %{{customdata[1]:.1f}} s"
            "<extra></extra>"
        ),
    }


def time_layout(y_title: str, run: RunData, rangemode: str = "normal") -> dict[str, Any]:
    """The common layout of all figures: a time axis with marks for alerts."""
    warnings = [a for a in run.alerts if a.severity > Severity.INFO]
    return {
        "height": 300,
        "margin": {"l": 56, "r": 16, "t": 12, "b": 76},
        "hovermode": "closest",
        "legend": {"orientation": "h", "yref": "container", "y": 0, "yanchor": "bottom", "x": 0},
        "xaxis": {
            "title": {"text": "time, s", "standoff": 6},
            "range": [0, max(run.duration, 1e-3)],
            "zeroline": False,
        },
        "yaxis": {"title": {"text": y_title}, "rangemode": rangemode, "zeroline": False},
        "shapes": [
            {
                "type": "line",
                "xref": "x",
                "yref": "paper",
                "x0": rounded(a.opened),
                "x1": rounded(a.opened),
                "y0": 0,
                "y1": 1,
                "line": {"color": css(SEVERITY_COLOURS[a.severity]), "width": 1.5, "dash": "dot"},
            }
            for a in warnings[:20]
        ],
    }


def rounded(x: float) -> float:
    """Rounded to keep the page small."""
    return round(float(x), 3)
