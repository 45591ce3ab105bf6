"""Writing a mission folder: video, masks, ``mission.json``, ``truth.json``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import OutputError, SettingsError
from visup.render.imaging.renderer import Renderer
from visup.render.output.truth import frame_truth, mission, mission_truth
from visup.render.scenario.scenario import Scenario

CODECS = {".mp4": "mp4v", ".avi": "MJPG", ".webm": "VP90"}
"""Container -> codec that OpenCV writes and reads everywhere."""


class ClipWriter:
    """A video file that grows frame by frame; a context manager.

    Args:
        path: Its suffix chooses the container, one of `CODECS`.
        fps: Frames per second.
        size: (width, height).

    Raises:
        SettingsError: No such container.
        OutputError: The file cannot be written.
    """

    def __init__(self, path: Path, fps: float, size: tuple[int, int]) -> None:
        _check_container(path.suffix)
        code = cv2.VideoWriter_fourcc(*CODECS[path.suffix])  # type: ignore[attr-defined]
        self._path = path
        self._writer = cv2.VideoWriter(str(path), code, fps, size)
        if not self._writer.isOpened():
            raise OutputError("the video cannot be written", where=str(path))

    def __enter__(self) -> ClipWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.release()

    def write(self, image: NDArray[np.uint8]) -> None:
        """Add one frame, (H, W, 3) uint8, BGR."""
        self._writer.write(image)


def write_mission(
    scenario: Scenario,
    out: Path,
    container: str = ".mp4",
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Render a scenario into a folder.

    Args:
        scenario: What to render.
        out: Folder, new or empty: ``video``, ``masks/00000.png``, ``mission.json``, ``truth.json``.
        container: Suffix of the video, one of `CODECS`.
        progress: Told frames done and frames in all.

    Returns:
        What stands in ``truth.json``.

    Raises:
        OutputError: The folder cannot be written, or something is in it already.
        SettingsError: The scenario cannot be rendered.
    """
    _check_container(container)
    renderer = Renderer(scenario)
    labels = {o.name: o.label for o in scenario.labelled}
    _make_folder(out)
    frames = []
    with ClipWriter(out / f"video{container}", scenario.camera.fps, scenario.camera.size) as video:
        for index in range(scenario.frame_count):
            picture = renderer.picture(index)
            video.write(picture.image)
            _write_mask(out / "masks" / f"{index:05d}.png", picture.mask)
            frames.append(frame_truth(picture, labels))
            if progress is not None:
                progress(index + 1, scenario.frame_count)
    truth = mission_truth(renderer, frames)
    _write_json(out / "truth.json", truth)
    _write_json(out / "mission.json", mission(scenario))
    return truth


def _check_container(suffix: str) -> None:
    if suffix not in CODECS:
        raise SettingsError(
            f"there is no video container {suffix!r}", expected=", ".join(sorted(CODECS))
        )


def _make_folder(out: Path) -> None:
    """Make a folder for a mission; masks of another one would be taken for its own."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            raise OutputError(
                "the folder is not empty", where=str(out), expected="a new or an empty folder"
            )
        (out / "masks").mkdir()
    except OSError as error:
        raise OutputError(f"the folder cannot be made: {error.strerror}", where=str(out)) from error


def _write_mask(path: Path, mask: NDArray[np.uint8]) -> None:
    ok, data = cv2.imencode(".png", mask)
    if not ok:
        raise OutputError("the mask cannot be encoded", where=str(path))
    _write_bytes(path, data.tobytes())


def _write_json(path: Path, record: dict[str, Any]) -> None:
    _write_bytes(path, (json.dumps(record, indent=1) + "\n").encode())


def _write_bytes(path: Path, data: bytes) -> None:
    try:
        path.write_bytes(data)
    except OSError as error:
        raise OutputError(
            f"the file cannot be written: {error.strerror}", where=str(path)
        ) from error
