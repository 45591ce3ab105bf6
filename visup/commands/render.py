"""`visup render`: render a scenario file or a random world, with masks and ground truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.terminal.console import make_console

if TYPE_CHECKING:
    from visup.render.scenario.scenario import Scenario

SIZE_FORM = "WIDTHxHEIGHT, such as 320x240"


def render(
    out: Annotated[Path, typer.Option(help="Folder for the result; new or empty.")],
    scenario: Annotated[
        str | None,
        typer.Argument(help="Scenario file (TOML), or the name of a shipped scenario."),
    ] = None,
    container: Annotated[
        str, typer.Option(help="Container of the video: mp4, avi or webm.")
    ] = "mp4",
    size: Annotated[str | None, typer.Option(help=f"Override the image size: {SIZE_FORM}.")] = None,
    random: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Instead of a scenario, render a random world of this kind, such as pick or orbit.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of a random world.")] = 0,
    outcome: Annotated[
        str | None, typer.Option(help="Outcome of a random world, such as ok; random by default.")
    ] = None,
) -> None:
    """Render a scenario or a random world: a video, a mask for each frame, and the ground truth."""
    require_renderer()
    if (scenario is None) == (random is None):
        from visup.agent.model.errors import SettingsError

        raise SettingsError(
            "there is nothing to render" if random is None else "there are two things to render",
            expected="a scenario, or --random KIND",
        )
    if random is not None:
        _render_random(random, seed, outcome, out, size)
    elif scenario is not None:
        _render_scenario(scenario, out, container, size)


def _render_random(kind: str, seed: int, outcome: str | None, out: Path, size: str | None) -> None:
    from dataclasses import replace

    from rich.progress import Progress

    from visup.render.orbits.random_orbit import ORBIT
    from visup.render.worlds.kinds.catalogue import random_world
    from visup.render.worlds.writer import write_world

    if kind == ORBIT:
        _render_orbit(seed, outcome, out, size)
        return
    world = random_world(kind, seed, outcome)
    if size is not None:
        world = replace(world, size=parse_size(size))
    with Progress(transient=True) as bar:
        task = bar.add_task("frames", total=world.frames)
        truth = write_world(world, out, lambda done, _: bar.update(task, completed=done))
    summary = f"{world.frames} frames of {kind}, which goes {truth['outcome']!r}, in {out}"
    make_console().print(summary, highlight=False)


def _render_orbit(seed: int, outcome: str | None, out: Path, size: str | None) -> None:
    from visup.render.orbits.random_orbit import random_orbit

    scenario = random_orbit(seed, outcome)
    _write(scenario if size is None else scenario.resized(parse_size(size)), out, "mp4")


def _render_scenario(name: str, out: Path, container: str, size: str | None) -> None:
    from visup.render.scenario.library import find_scenario

    scenario = find_scenario(name)
    _write(scenario if size is None else scenario.resized(parse_size(size)), out, container)


def _write(scenario: Scenario, out: Path, container: str) -> None:
    from rich.progress import Progress

    from visup.render.output.writer import write_mission

    with Progress(transient=True) as bar:
        task = bar.add_task("frames", total=scenario.frame_count)
        write_mission(
            scenario,
            out,
            f".{container.lstrip('.')}",
            lambda done, _: bar.update(task, completed=done),
        )
    make_console().print(
        f"{scenario.frame_count} frames of {scenario.name} in {out}", highlight=False
    )


def require_renderer() -> None:
    """Refuse to go on unless the renderer is installed.

    Raises:
        ExtraMissingError: It is not.
    """
    try:
        import embreex  # noqa: F401
        import trimesh  # noqa: F401
    except ImportError as error:
        from visup.agent.model.errors import ExtraMissingError

        raise ExtraMissingError("visup render", "render") from error


def parse_size(text: str) -> tuple[int, int]:
    """(width, height) from a text such as ``320x240``.

    Raises:
        SettingsError: The text is not a size, or a side is not within 16 and 8192 pixels.
    """
    from visup.agent.model.errors import SettingsError

    width, _, height = text.partition("x")
    if width.isdecimal() and height.isdecimal():
        size = int(width), int(height)
        if all(16 <= side <= 8192 for side in size):
            return size
    raise SettingsError(
        f"{text!r} is not an image size", expected=f"{SIZE_FORM}, from 16 to 8192 pixels"
    )
