"""The video of a run in its report, and the cursor that picture, figures and text share."""

from __future__ import annotations

from urllib.parse import quote

from visup.report.records import RunData

_FOLD = "<button type=button data-fold aria-label='Show or hide the video' aria-expanded=true>–</button>"


def player(run: RunData) -> str:
    """A corner of the page with the cursor, and above it the annotated video where there is one file of it.

    The video lies beside the page. It has all frames at an even pace: where a camera dropped some, it is
    ahead of or behind the cursor by as much as that.
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
