"""`visup teach`: teach objects by outlines, given on the command line, in a file, or in the browser."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from visup.agent.model.errors import SettingsError
from visup.terminal.console import echo

if TYPE_CHECKING:
    from visup.teaching.clip_frames import ClipFrames
    from visup.teaching.outline_teaching import TeachingResult


class OutlineCommand(TyperCommand):
    """A command whose `--outline` takes corners as separate words, so that no quotes are needed."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Join the corners of each outline."""
        from visup.teaching.outlines import join_corners

        return super().parse_args(ctx, join_corners(args))


def teach(
    clip: Annotated[
        str | None,
        typer.Argument(metavar="[CLIP]", help="Video, folder of images, or picture."),
    ] = None,
    models: Annotated[
        Path | None, typer.Option(metavar="DB", help="Model database; created if there is none.")
    ] = None,
    frame: Annotated[int, typer.Option(min=0, help="Number of the frame, from 0.")] = 0,
    outline: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=x,y x,y ...", help="Corners of an outline, in pixels; repeatable."
        ),
    ] = None,
    brief: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Take clips and outlines from a brief.json.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Picture of what was stored (default: beside DB)."),
    ] = None,
    browser: Annotated[
        bool, typer.Option(help="Open the page in the browser, or only print its address.")
    ] = True,
) -> None:
    """Teach objects by outlining them once, so that visup recognises them from then on.

    Without --outline or --brief, a page opens in the browser on which you draw the outlines.
    """
    if models is None:
        raise SettingsError(
            "no model database was given in which to store the taught objects",
            expected="--models DB",
            hint="a database that does not exist yet is created",
        )
    result = _teach(clip, models, frame, outline or [], brief, browser)
    if result is None:
        echo("Nothing was stored.")
        return
    for sentence in result.messages:
        echo(sentence)
    _draw_views(result, out or models.with_name(f"{models.stem}-taught.png"))


def _teach(
    clip: str | None,
    models: Path,
    frame: int,
    outlines: Sequence[str],
    brief: Path | None,
    browser: bool,
) -> TeachingResult | None:
    from visup.teaching.clip_frames import ClipFrames
    from visup.teaching.outline_teaching import teach_brief, teach_outlines
    from visup.teaching.outlines import parse_outline

    if brief is not None and (outlines or clip is not None):
        raise SettingsError(
            "a brief already contains the outlines and names the clips",
            expected="--brief FILE --models DB, without CLIP or --outline",
        )
    if brief is not None:
        return teach_brief(brief, models)
    if clip is None:
        raise SettingsError(
            "no clip was given to draw outlines in",
            expected="CLIP: a video, a folder of images or a picture; or --brief FILE",
        )
    drawn = [(frame, parse_outline(text)) for text in outlines]
    with ClipFrames(clip) as frames:
        if drawn:
            return teach_outlines(frames, drawn, models)
        return _in_the_browser(frames, frame, models, browser)


def _in_the_browser(
    frames: ClipFrames, frame: int, models: Path, browser: bool
) -> TeachingResult | None:
    from visup.teaching.page.server import TeachingPage

    frames.at(frame)
    with TeachingPage(frames, models, frame) as page:
        echo(f"Draw the outlines at {page.url}")
        echo("Press Ctrl-C to stop.")
        if browser:
            typer.launch(page.url)
        try:
            page.wait()
        except KeyboardInterrupt:
            echo()
        return page.result


def _draw_views(result: TeachingResult, out: Path) -> None:
    from visup.commands.models import write_picture
    from visup.percepts.taught.drawing_views import taught_views_sheet

    write_picture(out, taught_views_sheet(result.views))
