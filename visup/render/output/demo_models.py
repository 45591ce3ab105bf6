"""The model database of the demo: 20 objects and 633 views, like the paper's (section 7).

The satellite and the distractors are rendered from all around; the arm, which is never seen whole, is
known by four exemplars of its silhouettes in the demo's own clip (paper, section 7.2).

Run ``python -m visup.render.output.demo_models`` to make the shipped file anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh
from numpy.typing import NDArray

from visup.percepts.shape.building.database_builder import mesh_file_views, silhouette_views
from visup.percepts.shape.building.mesh_views import half_sphere_directions
from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.index.view_records import NewView
from visup.render.imaging.renderer import Renderer
from visup.render.meshes.distractors import DISTRACTORS
from visup.render.meshes.spacecraft import mesh
from visup.render.scenario.library import shipped_scenario

MODELS = "demo.models"
"""Name of the shipped file, in ``visup/data``."""

TOTAL_VIEWS = 633
ARM_VIEWS = 4
SPARTAN_VIEWS = 22
FRAME_STEP = 10
"""Frames of the clip between silhouettes of the arm that are clustered."""


def view_counts() -> dict[str, int]:
    """How many views each of the 20 models has: 633 in all."""
    others = ["payload_bay", *sorted(DISTRACTORS)]
    remaining = TOTAL_VIEWS - ARM_VIEWS - SPARTAN_VIEWS
    base_count, extra = divmod(remaining, len(others))
    counts = {name: base_count + (number < extra) for number, name in enumerate(others)}
    return {"spartan": SPARTAN_VIEWS, "arm": ARM_VIEWS, **counts}


def rendered_views(name: str, count: int) -> list[NewView]:
    """Views of one of the meshes from directions spread evenly over a hemisphere."""
    solid = mesh(name)
    with TemporaryDirectory() as folder:
        # Through a file, like any user's mesh, so that both are treated alike.
        path = Path(folder) / f"{name}.ply"
        trimesh.Trimesh(solid.vertices, solid.faces, process=False).export(path)
        # Symmetric views are not merged, to have as many as the paper.
        return mesh_file_views(path, half_sphere_directions(count))


def arm_masks(step: int = FRAME_STEP) -> list[NDArray[np.bool_]]:
    """Silhouettes of the arm in the demo's clip, (H, W) bool each, cut by the border of the image."""
    scenario = shipped_scenario("sts87")
    label = next(o.label for o in scenario.object if o.name == "arm")
    renderer = Renderer(scenario)
    return [renderer.mask(k) == label for k in range(0, scenario.frame_count, step)]


def demo_views() -> Iterator[list[NewView]]:
    """The views of each model in turn, in the order of `view_counts`."""
    for name, count in view_counts().items():
        if name == "arm":
            yield silhouette_views(name, arm_masks(), count)
        else:
            yield rendered_views(name, count)


def build_demo_database(
    path: Path | str, progress: Callable[[int, int, str], None] | None = None
) -> ModelDatabase:
    """Build the demo's model database from the meshes in code.

    Args:
        path: Where it is written.
        progress: Told how many models are done, of how many, and the name of the last.

    Returns:
        The database; the same for every call.

    Raises:
        DatabaseError: The file cannot be written.
    """
    names = list(view_counts())
    database_views: list[NewView] = []
    for number, views in enumerate(demo_views()):
        database_views.extend(views)
        if progress is not None:
            progress(number + 1, len(names), names[number])
    return ModelDatabase.create(path, database_views)


if __name__ == "__main__":
    build_demo_database(Path(str(resources.files("visup") / "data" / MODELS)))
