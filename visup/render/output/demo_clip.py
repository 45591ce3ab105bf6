"""The clip that ships with visup: the scenario ``sts87.toml`` as a video with ground truth.

Run ``python -m visup.render.output.demo_clip`` to render it again after a change to the renderer.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import resources
from pathlib import Path

from visup.render.imaging.renderer import Renderer
from visup.render.output.clip_folder import ClipWriter
from visup.render.output.truth import frame_truth, mission, mission_truth
from visup.render.scenario.library import shipped_scenario

CLIP, RECORD = "sts87.mp4", "sts87.json"


def write_demo_clip(folder: Path, progress: Callable[[int, int], None] | None = None) -> None:
    """Render the demo's scenario into a folder.

    Args:
        folder: Where `CLIP` and `RECORD` are written; the record holds what a supervisor may know
            under ``mission`` and what it must not see under ``truth``.
        progress: Told frames done and frames in all.
    """
    scenario = shipped_scenario("sts87")
    renderer = Renderer(scenario)
    labels = {o.name: o.label for o in scenario.labelled}
    frames = []
    with ClipWriter(folder / CLIP, scenario.camera.fps, scenario.camera.size) as video:
        for index in range(scenario.frame_count):
            frame = renderer.render(index)
            video.write(frame.image)
            frames.append(frame_truth(frame, labels))
            if progress is not None:
                progress(index + 1, scenario.frame_count)
    record = {"mission": mission(scenario), "truth": mission_truth(renderer, frames)}
    text = json.dumps(record, separators=(",", ":"))
    # One frame a line: small, and a change to one frame is a change to one line.
    (folder / RECORD).write_text(text.replace('{"index"', '\n{"index"') + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_demo_clip(Path(str(resources.files("visup") / "data")))
