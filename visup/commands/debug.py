"""`visup debug`: visualise intermediate results, for developers of visup."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.terminal.console import make_console

if TYPE_CHECKING:
    from visup.percepts.video import VideoSource
    from visup.runs.runner import RunProgress

app = typer.Typer(
    no_args_is_help=True,
    help="Visualise intermediate results, for developers of visup.",
)

MAX_WIDTH = 1284
"""Width of the video, pixels: two panels and the gap between them."""


@app.callback()
def group() -> None:
    """Visualise intermediate results, for developers of visup."""


@app.command("motion")
def motion(
    source: Annotated[str, typer.Argument(help="Video file, folder of images or mission folder.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Video to write (default: NAME-motion.webm)."),
    ] = None,
    every: Annotated[int, typer.Option(help="Use every n-th frame.")] = 1,
    limit: Annotated[int | None, typer.Option(min=1, help="Use at most this many frames.")] = None,
    fps: Annotated[
        float | None, typer.Option(help="Frame rate, if the source does not state one.")
    ] = None,
) -> None:
    """Write a video of the motion pipeline: constraints, layers, labels, regions."""
    from visup.commands.watch import progress_bar
    from visup.percepts.video import open_source

    target = checked_target(out or Path(f"{_source_name(source)}-motion.webm"))
    console = make_console(soft_wrap=True)
    with (
        open_source(video_of(source), every=every, fps=fps) as video,
        progress_bar(console, "seeing") as advance,
    ):
        written = _write(video, target, limit, advance)
    if video.problem:
        console.print(f"The source: {video.problem}", markup=False)
    console.print(f"{written} frames in {target}", markup=False)


def _write(video: VideoSource, target: Path, limit: int | None, advance: RunProgress) -> int:
    """Segment, draw and write; returns the number of frames written."""
    from itertools import islice

    from visup.percepts.motion.segmenter import MotionSegmenter
    from visup.report.motion_debug.panels import draw_motion
    from visup.report.video import WebmWriter

    segmenter, written = MotionSegmenter(), 0
    limits = [n for n in (_frame_count(video), limit) if n is not None]
    with WebmWriter(target, video.fps / video.every, MAX_WIDTH) as writer:
        for frame in islice(video, limit):
            regions = segmenter.step(frame)
            writer.write(draw_motion(frame, segmenter.trace, regions))
            written += 1
            advance(written, min(limits, default=None))
    return written


def _frame_count(video: VideoSource) -> int | None:
    """The number of frames of a source, if known."""
    return None if video.frame_count is None else -(-video.frame_count // video.every)


def video_of(source: str) -> str:
    """The video of a mission folder, else the source itself."""
    folder = Path(source)
    if (folder / "truth.json").is_file() or (folder / "mission.json").is_file():
        videos = sorted(folder.glob("video.*"))
        return str(videos[0]) if videos else source
    return source


def checked_target(path: Path) -> Path:
    """Refuse a file that cannot be written, before minutes of work are wasted.

    Raises:
        SettingsError: The file is not WebM.
        OutputError: Its folder does not exist.
    """
    from visup.agent.model.errors import OutputError, SettingsError

    if path.suffix != ".webm":
        raise SettingsError(
            f"videos of type {path.suffix or path.name!r} cannot be written on this machine",
            where=str(path),
            expected="a name that ends in .webm",
        )
    if not path.absolute().parent.is_dir():
        raise OutputError("its folder does not exist", where=str(path))
    return path


def _source_name(source: str) -> str:
    """The name of the source, without folder or extension."""
    path = Path(source)
    name = path.parent.name if path.stem in ("video", "frames") else path.stem
    return name or "source"
