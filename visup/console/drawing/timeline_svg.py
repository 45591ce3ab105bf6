"""The timeline as SVG: one row per track, without text, so that it can be stretched."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from visup.agent import Severity, Status
from visup.console.tracks import TimelineTrack, TrackSpan
from visup.report.palette import SEVERITY_COLOURS, STATUS_COLOURS, css, object_colour

WIDTH = 1000
ROW_HEIGHT = 22
BAR_HEIGHT = 14
MIN_BAR_WIDTH = 2.0
"""Least width of a bar, in SVG units, so that short spans are visible."""

HEALTH_COLOUR = "#96769e"
RAN_COLOUR = "#7a8b99"
OPACITY = {"hidden": 0.35, "active": 0.55, "paused": 0.45, "rested": 0.25, "blind": 0.25}
"""Opacity of states in which little is known or happens."""

_STATUS = {s.value: css(STATUS_COLOURS[s]) for s in Status}
_SEVERITY = {s.name.lower(): css(SEVERITY_COLOURS[s]) for s in Severity}


def timeline_svg(tracks: Sequence[TimelineTrack], seconds: float, start: float = 0.0) -> str:
    """All rows over one time axis.

    Args:
        tracks: From top to bottom.
        seconds: End of the axis.
        start: Start of the axis, seconds; not 0 for a run that continues the time of another.

    Returns:
        An SVG element of `ROW_HEIGHT` pixels per track and the full width.
    """
    height = ROW_HEIGHT * max(1, len(tracks))
    axis = start, max(seconds - start, 1e-6)
    bars = "".join(_row(track, number, axis) for number, track in enumerate(tracks))
    return (
        f'<svg viewBox="0 0 {WIDTH} {height}" preserveAspectRatio="none" width="100%" '
        f'height="{height}" role="img" '
        f'aria-label="{escape(timeline_in_words(tracks), quote=True)}">{bars}</svg>'
    )


def timeline_in_words(tracks: Sequence[TimelineTrack]) -> str:
    """The timeline as a text for screen readers."""
    text = [f"{t.label}: {_spans_in_words(t.spans)}" for t in tracks if t.group != "object"]
    return "; ".join(text) or "No events."


def _spans_in_words(spans: Sequence[TrackSpan]) -> str:
    return ", ".join(f"{s.state} {s.start:.1f} to {s.end:.1f} s" for s in spans[:12])


def _row(track: TimelineTrack, number: int, axis: tuple[float, float]) -> str:
    top = number * ROW_HEIGHT
    background = (
        f'<rect class="row" x="0" y="{top + 1}" width="{WIDTH}" height="{ROW_HEIGHT - 2}"/>'
    )
    return background + "".join(_bar(track, span, top, axis) for span in track.spans)


def _bar(track: TimelineTrack, span: TrackSpan, top: int, axis: tuple[float, float]) -> str:
    start, length = axis
    left = WIDTH * min(1.0, max(0.0, (span.start - start) / length))
    width = max(MIN_BAR_WIDTH, WIDTH * min(1.0, (span.end - start) / length) - left)
    text = f"{track.label}: {span.state}, {span.start:.1f} to {span.end:.1f} s. {span.text}"
    return (
        f'<rect x="{left:.2f}" y="{top + (ROW_HEIGHT - BAR_HEIGHT) // 2}" width="{width:.2f}" '
        f'height="{BAR_HEIGHT}" '
        f'fill="{colour_of(track, span)}" opacity="{OPACITY.get(span.state, 1.0)}">'
        f"<title>{escape(text)}</title></rect>"
    )


def colour_of(track: TimelineTrack, span: TrackSpan) -> str:
    """The CSS colour of a bar."""
    if track.group == "stage":
        return _STATUS[span.state]
    if track.group == "alert":
        return _SEVERITY.get(span.state, HEALTH_COLOUR)
    if track.object_id is not None:
        return css(object_colour(track.object_id))
    if track.group == "behaviour" and span.state in ("ran", "rested", "blind"):
        return RAN_COLOUR
    return HEALTH_COLOUR
