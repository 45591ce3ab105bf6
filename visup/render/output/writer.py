"""Writing a mission folder: video, masks, ``mission.json``, ``truth.json``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from visup.render.imaging.renderer import Renderer
from visup.render.output.clip_folder import (
    ClipWriter,
    check_container,
    make_clip_folder,
    write_file,
    write_mask,
)
from visup.render.output.truth import frame_truth, mission, mission_truth
from visup.render.scenario.scenario import Scenario


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
        The content of ``truth.json``.

    Raises:
        OutputError: The folder cannot be written, or is not empty.
        SettingsError: The scenario cannot be rendered.
    """
    check_container(container)
    renderer = Renderer(scenario)
    labels = {o.name: o.label for o in scenario.labelled}
    make_clip_folder(out)
    frames = []
    with ClipWriter(out / f"video{container}", scenario.camera.fps, scenario.camera.size) as video:
        for index in range(scenario.frame_count):
            frame = renderer.render(index)
            video.write(frame.image)
            write_mask(out, index, frame.mask)
            frames.append(frame_truth(frame, labels))
            if progress is not None:
                progress(index + 1, scenario.frame_count)
    truth = mission_truth(renderer, frames)
    _write_json(out / "truth.json", truth)
    _write_json(out / "mission.json", mission(scenario))
    return truth


def _write_json(path: Path, record: dict[str, Any]) -> None:
    write_file(path, (json.dumps(record, indent=1) + "\n").encode())
