"""Points on a surface tell how far a body has turned, and that something else has come in its place."""

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from visup.agent import Frame, Region
from visup.percepts.shape.refinement._pose_fit_jit import _draw, _project
from visup.percepts.shape.refinement.mesh_model import MeshModel, mesh_model
from visup.percepts.shape.refinement.pose_fit import USUAL_FOCAL, PoseFit
from visup.percepts.shape.refinement.pose_refiner import _KnownOrientations
from visup.percepts.shape.refinement.region_image import region_image
from visup.percepts.shape.refinement.surface_motion import (
    FollowedSurface,
    followed_surface,
    surface_image,
)
from visup.render.meshes.spacecraft import spartan
from visup.testing import region_of

SIDE = 240
RADIUS_PX = 70.0
FINER = 4
FAR = USUAL_FOCAL * SIDE / RADIUS_PX


def satellite_mesh() -> MeshModel:
    mesh = spartan()
    return mesh_model("satellite", mesh.vertices, mesh.faces)


def seen(model: MeshModel, turn: NDArray[np.float64], tones: int = 0) -> tuple[Frame, Region]:
    """A picture of a body with a tone of its own on each face, without steps, and its region."""
    side = SIDE * FINER
    points, depth = np.empty((len(model.vertices), 3)), np.empty((side, side))
    number = np.empty((side, side), np.int32)
    place = np.array([side / 2, side / 2, RADIUS_PX * FINER])
    _project(model.vertices, turn, FAR, place, points)
    _draw(points, model.faces, depth, number)
    tone = np.random.default_rng(tones).integers(60, 255, len(model.faces)).astype(np.uint8)
    drawn = np.where(number >= 0, tone[np.maximum(number, 0)], 0).astype(np.uint8)
    grey = cv2.resize(drawn, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    cover = cv2.resize((number >= 0).astype(np.float32), (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    return Frame(0, 0.0, np.repeat(grey[..., None], 3, axis=2)), region_of(cover > 0.5)


def surface_at(model: MeshModel, true: NDArray[np.float64]) -> FollowedSurface:
    frame, region = seen(model, true)
    picture = region_image(frame, region)
    focal = USUAL_FOCAL * SIDE
    surface = followed_surface(frame, region, model, picture, true[None], focal)
    assert surface is not None
    return surface


def apart_deg(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.degrees(Rotation.from_matrix(a @ b.T).magnitude()))


def test_a_rotation_is_measured_to_a_fraction_of_a_degree() -> None:
    """Most surely in the plane; a face seen from ahead tells little of others."""
    model, errors, rolls = satellite_mesh(), [], []
    for seed in range(12):
        before = Rotation.random(random_state=seed).as_matrix()
        axis = np.random.default_rng(seed).normal(size=3)
        axis *= np.radians(4.0) / np.linalg.norm(axis)
        after = Rotation.from_rotvec(axis).as_matrix() @ before
        numbers, (now, *_) = surface_at(model, before).current_orientations(*seen(model, after))
        assert numbers.tolist() == [0]
        errors.append(apart_deg(now, after))
        rolls.append(np.degrees(abs(Rotation.from_matrix(now @ after.T).as_rotvec()[2])))
    assert np.median(errors) < 0.7
    assert np.median(rolls) < 0.25


@pytest.mark.parametrize(("textured", "near"), [(False, True), (True, False)])
def test_corners_of_the_outline_are_tracked_only_on_a_plain_background(
    textured: bool, near: bool
) -> None:
    frame, region = seen(satellite_mesh(), np.eye(3))
    mask = region.full_mask((SIDE, SIDE))
    if textured:
        noise = np.random.default_rng(2).integers(0, 255, (SIDE, SIDE, 3)).astype(np.uint8)
        image = np.where(mask[..., None], frame.image, noise)
        frame = Frame(0, 0.0, image)
    picture = surface_image(frame, region)
    assert picture is not None
    x, y, w, h = region.bbox
    height, width = picture.grey.shape
    at = picture.points + np.array([x + (w - width) / 2, y + (h - height) / 2])
    inner = cv2.erode(mask.view(np.uint8), np.ones((3, 3), np.uint8))
    column, row = np.round(at).astype(int).T
    assert bool((inner[row, column] == 0).any()) == near


def test_another_surface_is_not_followed() -> None:
    model, true = satellite_mesh(), Rotation.random(random_state=1).as_matrix()
    other = Rotation.random(random_state=7).as_matrix()
    numbers, _ = surface_at(model, true).current_orientations(*seen(model, other, tones=3))
    assert not len(numbers)


@pytest.mark.parametrize(("degrees", "worn"), [(3.0, False), (15.0, True)])
def test_a_new_image_is_needed_after_a_large_rotation(degrees: float, worn: bool) -> None:
    true = Rotation.random(random_state=1).as_matrix()
    turned = Rotation.from_rotvec([0.0, np.radians(degrees), 0.0]).as_matrix() @ true
    surface = surface_at(satellite_mesh(), true)
    assert surface.needs_new_image(np.array([0]), turned[None]) is worn
    assert surface.needs_new_image(np.array([], np.intp), np.zeros((0, 3, 3)))


def test_a_search_that_finds_a_followed_orientation_leaves_it_unchanged() -> None:
    known = Rotation.random(2, random_state=1).as_matrix()
    near = Rotation.from_rotvec([0.05, 0.0, 0.0]).as_matrix() @ known[1]
    fits = [PoseFit(near, 0.9, 0.5, 1.0, 4), PoseFit(known[0].T, 0.8, 0.5, 1.0, 3)]
    surface = surface_at(satellite_mesh(), known[0])
    before = _KnownOrientations(known, (5, 6), surface, True)
    (first, second), told = before.with_followed_orientations(fits)
    assert told is None  # the surface says nothing of the second one
    assert before.with_followed_orientations(fits[:1])[1] is surface
    assert first.start == 1
    assert np.array_equal(first.orientation, known[1])
    assert second is fits[1]


def test_the_surface_is_dropped_if_a_search_found_another_orientation() -> None:
    """It began from the second known one, and is far from it now: numbers alone do not tell that."""
    known = Rotation.random(2, random_state=1).as_matrix()
    fits = [PoseFit(known[0], 0.9, 0.5, 1.0, 0), PoseFit(known[0].T, 0.8, 0.5, 1.0, 1)]
    surface = surface_at(satellite_mesh(), known[0])
    assert (
        _KnownOrientations(known, (5, 6), surface, True).with_followed_orientations(fits)[1] is None
    )
