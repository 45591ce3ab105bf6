"""Whether all cameras of a site can be watched, by this machine: the preflight of each, and what it takes."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from visup.agent.model.errors import VisupError
from visup.runs.inputs.preflight import WARNING, preflight
from visup.runs.inputs.speed import Speed, measured_speed
from visup.serving.site.records import Site, SiteCamera
from visup.sinks import open_sink

FRAMES = 15
"""So many frames of each camera are looked at to learn what it takes; a third of them is not counted."""

ENOUGH = 0.8
"""Of the processors no more than this is planned for: scenes are not always as quiet as now."""


@dataclass(frozen=True, slots=True)
class CameraCheck:
    """What is known of a camera beforehand.

    Attributes:
        camera: Which.
        lines: What was found, a sentence each.
        fault: Why it cannot be watched, or None.
        speed: What it takes, or None where that was not measured.
    """

    camera: SiteCamera
    lines: tuple[str, ...]
    fault: VisupError | None
    speed: Speed | None

    @property
    def warnings(self) -> int:
        """How many of the lines are warnings."""
        return sum(line.startswith(WARNING) for line in self.lines)


def check_camera(camera: SiteCamera, *, speed: bool = True) -> CameraCheck:
    """Open a camera's source and sinks, load all that it names, and look at some frames.

    Args:
        camera: Which.
        speed: Whether to measure what it takes.
    """
    lines: list[str] = []
    try:
        lines += preflight(camera.settings)
        for sink in camera.options.sinks:
            open_sink(sink).close()
        measured = measured_speed(camera.settings, FRAMES) if speed else None
    except VisupError as fault:
        return CameraCheck(camera, tuple(lines), fault, None)
    return CameraCheck(camera, tuple(lines), None, measured)


def store_fault(site: Site) -> str | None:
    """Why runs cannot be written to the store, or None."""
    place = site.store
    while not place.exists():
        place = place.parent
    if place.is_dir() and os.access(place, os.W_OK):
        return None
    return (
        f"the store {site.store} cannot be written: {place} is not a folder that you may write to"
    )


def load_lines(checks: Sequence[CameraCheck], processors: int | None = None) -> Iterator[str]:
    """What all cameras take together, and what to change where that is too much.

    Args:
        checks: Of the cameras; those that were not measured do not count.
        processors: How many there are; those of this machine by default.
    """
    count = processors or os.cpu_count() or 1
    measured = [(c.camera, c.speed) for c in checks if c.speed]
    if not measured:
        return
    whole = sum(s.load for _, s in measured)
    yield f"all cameras together use {whole:.1f} of {count} processors"
    for camera, speed in measured:
        if speed.load > 1.0:
            yield (
                f"{WARNING}camera {camera.name}: {speed.wanted:.1f} frames per second are requested, "
                f"{speed.possible:.1f} can be processed; pace = {_pace(ENOUGH * speed.possible)} is feasible"
            )
    if whole > ENOUGH * count and len(measured) > 1:
        share = min(ENOUGH, ENOUGH * count / len(measured))
        each = (f"{c.name} {_pace(min(s.wanted, share * s.possible))}" for c, s in measured)
        yield f"{WARNING}that leaves no reserve; feasible values of pace: {', '.join(each)}"


def speed_line(speed: Speed) -> str:
    """What a camera takes, in words."""
    return (
        f"speed: {speed.possible:.1f} frames per second can be processed, {speed.wanted:.1f} are "
        f"requested: {100 * speed.load:.0f} % of a processor"
    )


def _pace(rate: float) -> str:
    """A rate as one would write it, rounded down to half a frame a second."""
    return f"{max(0.5, int(2 * rate) / 2):g}"
