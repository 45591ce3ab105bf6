"""Small scenes for tests: bodies of known shape in front of a camera that looks along x."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from visup.render.scenario.scenario import Scenario

IDEAL_SENSOR = {"noise": 0.0, "blur_px": 0.0, "black": 0.0, "gamma": 1.0}


def scene(objects: list[dict[str, Any]], **changes: Any) -> Scenario:
    base: dict[str, Any] = {
        "name": "scene",
        "duration_s": 1.0,
        "camera": {
            "size": (160, 120),
            "fps": 10.0,
            "track": [{"position": (0, 0, 0), "look_at": (1, 0, 0)}],
        },
        "light": {"sun": (-1, 0, 0), "earth": (0, 0, -1), "earthshine": 0.1},
        "background": {"kind": "stars", "count": 0},
        "sensor": IDEAL_SENSOR,
        "object": objects,
    }
    return Scenario.model_validate({**base, **changes})


def scene_object(mesh: str | Path, at: tuple[float, float, float], **more: Any) -> dict[str, Any]:
    return {"name": "thing", "mesh": str(mesh), "label": 1, "track": [{"position": at}], **more}


def sphere_file(folder: Path, radius: float = 1.0) -> Path:
    path = folder / "sphere.ply"
    trimesh.creation.icosphere(subdivisions=5, radius=radius).export(path)
    return path


def box_file(folder: Path, size: tuple[float, float, float], name: str = "box") -> Path:
    path = folder / f"{name}.ply"
    trimesh.creation.box(extents=np.asarray(size)).export(path)
    return path
