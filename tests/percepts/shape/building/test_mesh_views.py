"""What matching says of a view is what the renderer's camera shows: one convention on both sides."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from visup.agent.model.orientation import orientations, swing_and_roll
from visup.evaluation.motion.mask_scores import iou
from visup.percepts.shape.building.database_builder import build_database
from visup.percepts.shape.building.mesh_views import render_views

trimesh = pytest.importorskip("trimesh", reason="views of meshes need the extra 'render'")
pytest.importorskip("embreex", reason="views of meshes need the extra 'render'")


def asymmetric_mesh() -> object:
    """A convex solid without any symmetry."""
    rng = np.random.default_rng(5)
    return trimesh.convex.convex_hull(rng.normal(size=(14, 3)) * [3.0, 1.5, 0.8])


def projected(mesh: object, orientation: NDArray[np.float64], size: int = 600) -> NDArray[np.bool_]:
    """The silhouette of a convex solid: the hull of its corners as the camera sees them."""
    seen = np.asarray(mesh.vertices) @ orientation.T  # type: ignore[attr-defined]
    flat = seen[:, :2] - (seen[:, :2].max(axis=0) + seen[:, :2].min(axis=0)) / 2
    scale = 0.8 * size / np.ptp(flat, axis=0).max()
    hull = cv2.convexHull(np.round(flat * scale + size / 2).astype(np.int32))
    out = np.zeros((size, size), np.uint8)
    cv2.fillConvexPoly(out, hull, 1)
    return out.astype(bool)


def cropped(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    cropped = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    small = cv2.resize(cropped.astype(np.uint8) * 255, (64, 64), interpolation=cv2.INTER_AREA)
    return np.asarray(small > 127)


@pytest.mark.parametrize("seed", range(4))
def test_a_rendered_view_agrees_with_its_orientation(seed: int) -> None:
    mesh = asymmetric_mesh()
    direction = np.random.default_rng(seed).normal(size=3)
    direction /= np.linalg.norm(direction)
    rendered = cropped(render_views(mesh, direction[None], 480)[0].mask)
    upright = projected(mesh, orientations(direction, 0.0))
    assert iou(rendered, cropped(upright)) > 0.97
    assert iou(rendered, cropped(upright[:, ::-1])) < 0.95


@pytest.mark.parametrize("behind", [False, True])
@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
def test_a_match_recovers_the_rendered_orientation(
    behind: bool, turn: float, tmp_path: Path
) -> None:
    mesh = asymmetric_mesh()
    mesh.export(tmp_path / "solid.ply")  # type: ignore[attr-defined]
    database = build_database(tmp_path / "one.db", [tmp_path / "solid.ply"], views=24)
    view = database.views[7]
    assert view.direction is not None
    direction = -np.array(view.direction) if behind else np.array(view.direction)
    true = orientations(direction, turn)
    match = database.query(projected(mesh, true)).matches[0]
    assert match.direction is not None
    assert match.terms.mirrored == behind
    told = orientations(match.direction, match.rotation)
    swing, roll = swing_and_roll(told, true)
    assert np.degrees(swing) < 1e-3
    assert abs(np.degrees(roll)) < 4
