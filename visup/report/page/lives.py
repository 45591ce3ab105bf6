"""The objects of a run: name, picture, and times in view."""

from __future__ import annotations

import base64
from html import escape

from visup.report.page.summary import name_of
from visup.report.palette import css, object_colour
from visup.report.records import ReportedObject, RunData

MOST_LIVES = 120
"""Maximum rows; further objects are in the downloadable tables."""


def lives(run: RunData) -> str:
    """A row for each object, in order of appearance."""
    if not run.objects:
        return "<p class=empty>No object was followed.</p>"
    looks = _closeups(run)
    ordered = sorted(run.objects, key=lambda o: (o.first_seen, o.id))
    rows = "".join(_life(run, o, looks.get(o.id)) for o in ordered[:MOST_LIVES])
    left = len(ordered) - MOST_LIVES
    more = f"<p class=empty>{left} more are in the table to download.</p>" if left > 0 else ""
    return (
        "<div class=scroll><table class=lives><thead><tr><th><th>object<th>from<th>to<th>in view<th>life"
        f"</thead><tbody>{rows}</tbody></table></div>{more}"
    )


def _life(run: RunData, one: ReportedObject, look: bytes | None) -> str:
    data = base64.b64encode(look or b"").decode("ascii")
    words = escape(name_of(one))
    picture = f'<img src="data:image/jpeg;base64,{data}" alt="{words}">' if look else ""
    whole = max(run.duration, 1e-3)
    left, width = 100 * one.first_seen / whole, 100 * (one.last_seen - one.first_seen) / whole
    return (
        f"<tr><td>{picture}</td><th scope=row>{words}</th>"
        f"<td>{one.first_seen:.1f} s</td><td>{one.last_seen:.1f} s</td>"
        f"<td>{one.last_seen - one.first_seen:.1f} s</td>"
        f'<td><div class=life style="--object:{css(object_colour(one.id))}">'
        f'<i style="left:{left:.1f}%;width:{width:.1f}%"></i></div></td></tr>'
    )


def _closeups(run: RunData) -> dict[int, bytes]:
    """The largest picture of each object in a key frame."""
    found: dict[int, bytes] = {}
    for key in run.key_frames:
        for look in key.looks:
            if look.object_id is not None and len(look.jpeg) > len(found.get(look.object_id, b"")):
                found[look.object_id] = look.jpeg
    return found
