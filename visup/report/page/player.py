"""The video player of a report, and the cursor shared by picture, figures and text."""

from __future__ import annotations

from urllib.parse import quote

from visup.report.records import RunData

_FOLD = "<button type=button data-fold aria-label='Show or hide the video' aria-expanded=false>+</button>"


def player(run: RunData) -> str:
    """A corner of the page with the cursor, and the annotated video if it is a single file.

    The video is next to the page. It plays frames at a constant rate: if a camera dropped some, it deviates
    from the cursor by that time.
    """
    if not run.duration:
        return ""
    video = ""
    if len(run.videos) == 1:
        name = quote(run.videos[0])
        video = (
            f'<video src="{name}" preload=metadata muted playsinline aria-label="Annotated video">'
            "</video>"
        )
    return (
        f'<div id=cursor data-duration="{run.duration:.3f}" hidden>{video}'
        "<div class=cursor-bar><button type=button aria-label='Play or pause'>▶</button>"
        f'<input type=range min=0 max="{run.duration:.3f}" step=0.04 value=0 aria-label="Moment of the run">'
        f"<output>0.0 s</output>{_FOLD if video else ''}</div></div>"
    )
