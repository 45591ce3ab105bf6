"""Geometry and light of rendered images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.render.scenes import IDEAL_SENSOR, box_file, scene, scene_object, sphere_file
from visup.render.imaging.renderer import Renderer, pixel_rays
from visup.render.output.truth import frame_truth
from visup.render.scenario.library import shipped_names, shipped_scenario
from visup.render.scenario.scenario import Scenario

TINY = (96, 72)


@pytest.mark.parametrize("distance", [6.0, 9.0, 15.0])
def test_the_area_of_a_sphere_follows_from_perspective(tmp_path: Path, distance: float) -> None:
    camera = {"size": (640, 480), "track": [{"position": (0, 0, 0), "look_at": (1, 0, 0)}]}
    s = scene([scene_object(sphere_file(tmp_path), (distance, 0, 0))], camera=camera)
    radius = s.camera.focal_px * np.tan(np.arcsin(1 / distance))
    mask = Renderer(s).mask(0)
    assert np.count_nonzero(mask) == pytest.approx(np.pi * radius**2, rel=0.005)


def test_the_camera_has_the_documented_axes(tmp_path: Path) -> None:
    # World y is to the left and z up when looking along x.
    for at, column, row in (((9.0, 1.0, 0.0), -1, 0), ((9.0, 0.0, 1.0), 0, -1)):
        s = scene([scene_object(sphere_file(tmp_path, 0.2), at)])
        ys, xs = np.nonzero(Renderer(s).mask(0))
        shift = s.camera.focal_px / 9.0
        assert xs.mean() - 79.5 == pytest.approx(column * shift, abs=0.1)
        assert ys.mean() - 59.5 == pytest.approx(row * shift, abs=0.1)


def test_a_floating_cube_casts_its_shadow_away_from_the_sun(tmp_path: Path) -> None:
    floor = scene_object(box_file(tmp_path, (20, 20, 0.2), "floor"), (0, 0, -0.1))
    cube = scene_object(box_file(tmp_path, (1, 1, 1)), (0, 0, 2.0), name="cube", label=2)
    camera = {
        "size": (200, 200),
        "track": [{"position": (0, 0, 30), "look_at": (0, 0, 0), "up": (0, 1, 0)}],
    }
    light = {"sun": (1, 0, 1), "earth": (0, 0, 1), "earthshine": 0.1}
    image = Renderer(scene([floor, cube], camera=camera, light=light)).render(0).image
    focal = scene([floor], camera=camera).camera.focal_px

    def grey(x: float, y: float) -> float:
        return float(image[round(99.5 - y / 30 * focal), round(99.5 + x / 30 * focal), 0]) / 255

    lit = 0.6 * (np.sqrt(0.5) + 0.1)
    assert grey(2.0, 0.0) == pytest.approx(lit, abs=0.01)  # on the side of the sun
    assert grey(-2.0, 0.0) == pytest.approx(0.06, abs=0.01)  # two metres off for two metres up
    assert grey(-3.5, 0.0) == pytest.approx(lit, abs=0.01)  # beyond the shadow
    assert grey(-2.0, 1.0) == pytest.approx(lit, abs=0.01)  # beside it


@pytest.mark.parametrize("earthshine", [0.0, 0.2])
def test_only_earthshine_lights_the_side_away_from_the_sun(
    tmp_path: Path, earthshine: float
) -> None:
    light = {"sun": (1, 0, 0), "earth": (0, 0, -1), "earthshine": earthshine}
    s = scene([scene_object(sphere_file(tmp_path), (6.0, 0, 0))], light=light)
    picture = Renderer(s).render(0)
    on = picture.mask == 1
    column = picture.image[:, 79:81, 0].mean(axis=1)[on[:, 79]]
    assert picture.image[on].max() <= np.ceil(255 * 0.6 * earthshine)
    # The side facing the Earth gets more of it: brightness increases downwards.
    assert (np.diff(column[2:-2]) >= 0).all()
    assert (earthshine == 0) == (column.max() == 0)


@settings(max_examples=15, deadline=None)
@given(albedo=st.floats(0.05, 0.95), exposure=st.floats(0.2, 1.0), tilt=st.floats(-1.2, 1.2))
def test_brightness_follows_the_cosine_of_the_angle_to_the_sun(
    tmp_path_factory: pytest.TempPathFactory, albedo: float, exposure: float, tilt: float
) -> None:
    path = box_file(tmp_path_factory.mktemp("box"), (2, 2, 2))
    item = scene_object(path, (6.0, 0, 0), colour=(albedo, albedo, albedo))
    light = {"sun": (-np.cos(tilt), np.sin(tilt), 0), "earthshine": 0.0}
    s = scene([item], light=light, sensor={**IDEAL_SENSOR, "exposure": exposure})
    value = Renderer(s).render(0).image[60, 80, 1]
    assert value == pytest.approx(255 * albedo * exposure * np.cos(tilt), abs=1.0)


@pytest.mark.parametrize("name", shipped_names())
def test_masks_partition_the_visible_pixels(name: str) -> None:
    s = shipped_scenario(name).resized(TINY)
    renderer = Renderer(s)
    labels = {o.name: o.label for o in s.labelled}
    for index in np.linspace(0, s.frame_count - 1, 4).astype(int):
        picture = renderer.render(int(index))
        truth = frame_truth(picture, labels)
        assert picture.image.shape == (72, 96, 3)
        assert set(np.unique(picture.mask)) <= {0, *labels.values()}
        visible = {n: truth[n]["visible_px"] for n in labels}
        assert sum(visible.values()) == np.count_nonzero(picture.mask)
        assert all(visible[n] <= picture.amodal_px[n] for n in labels)
        np.testing.assert_array_equal(picture.mask, renderer.mask(int(index)))


def test_boxes_in_the_truth_enclose_the_masks_exactly() -> None:
    s = shipped_scenario("sts87").resized(TINY)
    picture = Renderer(s).render(100)
    for o in s.labelled:
        x, y, w, h = frame_truth(picture, {o.name: o.label})[o.name]["bbox"]
        inside = picture.mask[y : y + h, x : x + w] == o.label
        assert inside.sum() == (picture.mask == o.label).sum()
        assert inside[0].any()
        assert inside[-1].any()
        assert inside[:, 0].any()
        assert inside[:, -1].any()


def test_the_range_in_the_truth_is_the_distance_in_the_scenario() -> None:
    s = shipped_scenario("sts87").resized(TINY)
    for key in s.object[0].track:
        index = min(round(key.at_s * s.camera.fps), s.frame_count)
        truth = frame_truth(Renderer(s).render(index), {"satellite": 3, "arm": 2})
        assert truth["satellite"]["range_m"] == pytest.approx(
            np.linalg.norm(key.position), abs=1e-4
        )
        assert "range_m" not in truth["arm"]


def test_nearer_objects_occlude_farther_ones(tmp_path: Path) -> None:
    near = scene_object(box_file(tmp_path, (1, 1, 1)), (5.0, 0, 0))
    far = scene_object(sphere_file(tmp_path), (9.0, 0.4, 0), name="far", label=2)
    for objects in ([near, far], [far, near]):
        picture = Renderer(scene(objects)).render(0)
        assert picture.mask[60, 80] == 1
        assert np.count_nonzero(picture.mask == 1) == picture.amodal_px["thing"]
        assert 0 < np.count_nonzero(picture.mask == 2) < picture.amodal_px["far"]


def test_frames_do_not_depend_on_their_order() -> None:
    s = shipped_scenario("over_earth").resized(TINY)
    forward = [Renderer(s).render(k).image.tobytes() for k in (3, 40)]
    other = Renderer(s)
    backward = [other.render(k).image.tobytes() for k in (40, 3)]
    assert forward == backward[::-1]
    reseeded = s.model_copy(update={"seed": s.seed + 1})
    assert Renderer(reseeded).render(3).image.tobytes() != forward[0]


def test_antialiased_edges_measure_areas_with_subpixel_accuracy(tmp_path: Path) -> None:
    s = scene([scene_object(box_file(tmp_path, (2, 2.013, 1.987)), (6.0, 0.011, 0.017))])
    image = Renderer(s).render(0).image[..., 0].astype(float)
    area = (image / image.max()).sum()
    scale = s.camera.focal_px / 5.0
    assert area == pytest.approx(2.013 * 1.987 * scale**2, rel=0.005)
    assert 0 < np.count_nonzero((image > 0) & (image < image.max())) < 4 * 2.1 * scale


def test_an_attached_object_is_fixed_to_the_tip() -> None:
    s = shipped_scenario("capture_succeeds")
    renderer = Renderer(s)
    satellite, arm = s.object[0], s.object[1]
    since = satellite.attach.from_s if satellite.attach else 0.0
    times = np.linspace(since, s.duration_s, 5)
    held = [
        np.linalg.inv(renderer.scene.attachment_frame(arm, t))
        @ renderer.scene.object_pose(satellite, t)
        for t in times
    ]
    for pose in held[1:]:
        np.testing.assert_allclose(pose, held[0], atol=1e-9)


def test_pixel_rays_of_a_scaled_image_cover_the_same_view() -> None:
    s = shipped_scenario("sts87")
    assert_same_corner(s, s.resized((1280, 960)))


def assert_same_corner(a: Scenario, b: Scenario) -> None:
    corners = [pixel_rays(s.camera, np.array([[-0.5, -0.5]]))[0] for s in (a, b)]
    np.testing.assert_allclose(corners[0], corners[1], rtol=1e-6)


def test_a_body_around_the_camera_fills_the_image(tmp_path: Path) -> None:
    s = scene([scene_object(box_file(tmp_path, (4, 4, 4)), (0, 0, 0))])
    assert (Renderer(s).mask(0) == 1).all()


def test_a_body_behind_the_camera_is_invisible(tmp_path: Path) -> None:
    s = scene([scene_object(sphere_file(tmp_path), (-6.0, 0, 0))])
    picture = Renderer(s).render(0)
    assert not picture.mask.any()
    assert picture.amodal_px["thing"] == 0
    assert "bbox" not in frame_truth(picture, {"thing": 1})["thing"]


@settings(max_examples=10, deadline=None)
@given(fov=st.floats(20.0, 60.0), time=st.integers(0, 10))
def test_zoom_equals_another_field_of_view(fov: float, time: int) -> None:
    """A frame of a zooming camera equals that of a camera with the current field of view."""
    track = [{"position": (0, 0, 0), "look_at": (1, 0, 0)}]
    zoom = [{"at_s": 0, "fov_vertical_deg": 30}, {"at_s": 1, "fov_vertical_deg": fov}]
    base = {"size": TINY, "fps": 10, "track": track}
    dog = scene_object("dog", (5, 0, 0))
    back = {"kind": "panorama"}
    zooming = scene([dog], camera={**base, "zoom": zoom}, background=back, duration_s=2)
    now = 30 + (fov - 30) * min(time / 10, 1)
    fixed = scene([dog], camera={**base, "fov_vertical_deg": now}, background=back, duration_s=2)
    a, b = Renderer(zooming).render(time), Renderer(fixed).render(time)
    assert np.array_equal(a.mask, b.mask)
    assert np.array_equal(a.image, b.image)
    assert a.amodal_px == b.amodal_px


@pytest.mark.parametrize("background", [{"kind": "panorama"}, {"kind": "earth", "count": 0}])
def test_light_and_exposure_scale_the_image_alike(background: dict[str, object]) -> None:
    """Half the light at twice the exposure gives the same image, for bodies and background."""
    dog = scene_object("dog", (5, 0, 0), texture={"contrast": 0.5})
    light = {"sun": (-1, 0, 0.5), "earth": (1, 0, -0.4), "earthshine": 0.2}
    plain = scene([dog], light=light, background=background)
    dim = {**light, "track": [{"at_s": 0, "strength": 1}, {"at_s": 1, "strength": 0.5}]}
    twice = {**IDEAL_SENSOR, "track": [{"at_s": 0, "exposure": 1}, {"at_s": 1, "exposure": 2}]}
    changed = scene([dog], light=dim, sensor=twice, background=background)
    dimmed = scene([dog], light=dim, background=background)
    whole, same, half = (
        Renderer(s).render(10).image.astype(float) for s in (plain, changed, dimmed)
    )
    below = whole < 255
    assert whole[below].mean() > 5
    # Which pixels are antialiased depends on contrast, so a few may differ by more.
    assert (abs(same - whole)[below] <= 1).mean() > 0.99
    assert (abs(half - whole / 2)[below] <= 1).mean() > 0.99


def test_a_texture_moves_with_its_body(tmp_path: Path) -> None:
    """Shifted by whole pixels, with the sun behind the camera, a face looks the same."""
    panel = box_file(tmp_path, (0.1, 1.0, 1.0))
    focal = scene([scene_object(panel, (5, 0, 0))]).camera.focal_px
    texture = {"contrast": 0.8, "size": 0.4, "seed": 3}
    images = []
    for shift in (0, 10):
        at = (5.05, -shift * 5.0 / focal, 0.0)
        picture = Renderer(scene([scene_object(panel, at, texture=texture)])).render(0)
        x = slice(70 + shift, 90 + shift)
        images.append(picture.image[50:70, x].astype(float))
    assert images[0].std() > 10
    np.testing.assert_allclose(images[0], images[1], atol=2)
