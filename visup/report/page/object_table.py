"""The objects of a run: name, picture, and times in view."""

from __future__ import annotations

import base64
from html import escape

from visup.report.page.summary import name_of
from visup.report.palette import css, object_colour
from visup.report.records import ReportedObject, RunData

MAX_ROWS = 120
"""Maximum rows; further objects are in the downloadable tables."""


def object_table(run: RunData) -> str:
    """A row for each object, in order of appearance."""
    if not run.objects:
        return "<p class=empty>No object was followed.</p>"
    pictures = _closeups(run)
    ordered = sorted(run.objects, key=lambda o: (o.first_seen, o.id))
    rows = "".join(_row(run, o, pictures.get(o.id)) for o in ordered[:MAX_ROWS])
    left_out = len(ordered) - MAX_ROWS
    more = (
        f"<p class=empty>{left_out} more are in the table to download.</p>" if left_out > 0 else ""
    )
    return (
        "<div class=scroll><table class=objects><thead><tr>"
        "<th><th>object<th>from<th>to<th>in view<th>timeline"
        f"</thead><tbody>{rows}</tbody></table></div>{more}"
    )


def _row(run: RunData, reported: ReportedObject, jpeg: bytes | None) -> str:
    data = base64.b64encode(jpeg or b"").decode("ascii")
    name = escape(name_of(reported))
    picture = f'<img src="data:image/jpeg;base64,{data}" alt="{name}">' if jpeg else ""
    duration = max(run.duration, 1e-3)
    left, width = (
        100 * reported.first_seen / duration,
        100 * (reported.last_seen - reported.first_seen) / duration,
    )
    return (
        f"<tr><td>{picture}</td><th scope=row>{name}</th>"
        f"<td>{reported.first_seen:.1f} s</td><td>{reported.last_seen:.1f} s</td>"
        f"<td>{reported.last_seen - reported.first_seen:.1f} s</td>"
        f'<td><div class=life style="--object:{css(object_colour(reported.id))}">'
        f'<i style="left:{left:.1f}%;width:{width:.1f}%"></i></div></td></tr>'
    )


def _closeups(run: RunData) -> dict[int, bytes]:
    """The largest picture of each object in a key frame."""
    found: dict[int, bytes] = {}
    for key in run.key_frames:
        for closeup in key.closeups:
            if closeup.object_id is not None and len(closeup.jpeg) > len(
                found.get(closeup.object_id, b"")
            ):
                found[closeup.object_id] = closeup.jpeg
    return found
