"""The preflight of a site: whether each camera can be watched, and whether this machine is fast enough."""

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
"""Frames processed to measure the load of a camera; the first third is warm-up and not counted."""

MAX_LOAD = 0.8
"""Share of the processors that may be planned for: scenes are not always as quiet as during the check."""


@dataclass(frozen=True, slots=True)
class CameraCheck:
    """The preflight result of a camera.

    Attributes:
        camera: The camera.
        lines: Findings, a sentence each.
        fault: Why it cannot be watched, or None.
        speed: Its load, or None if not measured.
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
    """Open a camera's source and sinks, load the files it names, and process some frames.

    Args:
        camera: The camera.
        speed: Whether to measure its load.
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
    folder = site.store
    while not folder.exists():
        folder = folder.parent
    if folder.is_dir() and os.access(folder, os.W_OK):
        return None
    return (
        f"the store {site.store} cannot be written: {folder} is not a folder that you may write to"
    )


def load_lines(checks: Sequence[CameraCheck], processors: int | None = None) -> Iterator[str]:
    """The load of all cameras together, and what to change where it is too much.

    Args:
        checks: Checks of the cameras; those without a measured speed do not count.
        processors: Number of processors; by default this machine's.
    """
    count = processors or os.cpu_count() or 1
    measured = [(c.camera, c.speed) for c in checks if c.speed]
    if not measured:
        return
    total_load = sum(s.load for _, s in measured)
    yield f"all cameras together use {total_load:.1f} of {count} processors"
    for camera, speed in measured:
        if speed.load > 1.0:
            yield (
                f"{WARNING}camera {camera.name}: {speed.wanted:.1f} frames per second are requested, "
                f"{speed.possible:.1f} can be processed; "
                f"pace = {_pace(MAX_LOAD * speed.possible)} is feasible"
            )
    if total_load > MAX_LOAD * count and len(measured) > 1:
        share = min(MAX_LOAD, MAX_LOAD * count / len(measured))
        paces = (f"{c.name} {_pace(min(s.wanted, share * s.possible))}" for c, s in measured)
        yield f"{WARNING}that leaves no reserve; feasible values of pace: {', '.join(paces)}"


def speed_line(speed: Speed) -> str:
    """The load of a camera as a sentence."""
    return (
        f"speed: {speed.possible:.1f} frames per second can be processed, {speed.wanted:.1f} are "
        f"requested: {100 * speed.load:.0f} % of a processor"
    )


def _pace(rate: float) -> str:
    """A rate, rounded down to half a frame per second."""
    return f"{max(0.5, int(2 * rate) / 2):g}"
