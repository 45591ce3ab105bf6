"""Stars, the Earth, and the sensor."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from visup.render.imaging.background import (
    ATMOSPHERE_KM,
    EARTH_RADIUS_KM,
    clouds,
    earth,
    panorama,
    stars,
)
from visup.render.imaging.sensor import expose
from visup.render.imaging.texture import pattern
from visup.render.scenario.optics import Camera, CameraKey, Earth, Light, Panorama, Sensor, Stars

CAMERA = Camera(size=(120, 120), track=(CameraKey(position=(0, 0, 0), look_at=(1, 0, 0)),))


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 1000), angles=st.tuples(*[st.floats(-3, 3)] * 3))
def test_stars_are_fixed_in_the_world(seed: int, angles: tuple[float, float, float]) -> None:
    pose = Rotation.from_euler("xyz", angles)
    rolled = pose * Rotation.from_euler("z", 90, degrees=True)
    sky = Stars(seed=seed, count=3000)
    upright = stars(CAMERA, pose.as_matrix(), sky)
    turned = stars(CAMERA, rolled.as_matrix(), sky)
    np.testing.assert_allclose(np.rot90(upright), turned, atol=1e-4)
    assert upright.max() > 0


def radiance_at(angle: float, altitude: float) -> tuple[np.ndarray, bool]:
    """Radiance, and whether a ray at an angle from straight down (radians) hits Earth or atmosphere."""
    ray = np.array([[np.sin(angle), 0, -np.cos(angle)]], np.float32)
    settings = Earth(kind="earth", altitude_km=altitude)
    light, met = earth(ray, np.eye(3), settings, Light(sun=(0, 0, 1)))
    return light[0], bool(met[0])


@pytest.mark.parametrize("altitude", [250.0, 400.0, 5000.0])
def test_the_limb_is_at_its_geometric_angle(altitude: float) -> None:
    far = EARTH_RADIUS_KM + altitude
    limb = np.arcsin(EARTH_RADIUS_KM / far)
    top = np.arcsin((EARTH_RADIUS_KM + ATMOSPHERE_KM) / far)
    assert radiance_at(limb - 0.001, altitude)[1]
    assert radiance_at((limb + top) / 2, altitude)[1]
    assert not radiance_at(top + 0.001, altitude)[1]
    assert not radiance_at(np.pi, altitude)[1]
    # The air fades towards space.
    glow = [radiance_at(limb + k * (top - limb), altitude)[0].mean() for k in (0.1, 0.5, 0.9)]
    assert glow[0] > glow[1] > glow[2] > 0


def test_more_clouds_cover_more() -> None:
    at = np.random.default_rng(0).uniform(-0.3, 0.3, (4000, 2))
    cover = [clouds(at, 0.3, amount, 1).mean() for amount in (0.0, 0.3, 0.6, 1.0)]
    assert cover == sorted(cover)
    assert cover[0] < 0.1
    assert cover[-1] > 0.7


@settings(max_examples=20, deadline=None)
@given(
    level=st.floats(0.0, 1.5),
    exposure=st.floats(0.2, 3.0),
    gamma=st.floats(1.0, 2.5),
    black=st.floats(0, 20),
)
def test_uniform_light_gives_the_expected_grey(
    level: float, exposure: float, gamma: float, black: float
) -> None:
    sensor = Sensor(exposure=exposure, gamma=gamma, black=black, noise=0)
    image = expose(np.full((8, 8, 3), level, np.float32), sensor, 0, 0)
    expected = black + min(1.0, level * exposure) ** (1 / gamma) * (255 - black)
    assert image.dtype == np.uint8
    assert (abs(image - expected) <= 0.51).all()


def test_noise_has_its_standard_deviation_and_depends_on_seed_and_frame() -> None:
    flat = np.full((200, 200, 3), 0.2, np.float32)
    sensor = Sensor(noise=3.0, blur_px=0)
    a, same, next_frame, other = (
        expose(flat, sensor, *key).astype(float) for key in ((1, 0), (1, 0), (1, 1), (2, 0))
    )
    assert np.std(a) == pytest.approx(3.0, rel=0.05)
    assert np.array_equal(a, same)
    assert abs(np.corrcoef(a[..., 0].ravel(), next_frame[..., 0].ravel())[0, 1]) < 0.03
    assert not np.array_equal(a, other)


def test_the_panorama_is_fixed_and_blends_its_colours() -> None:
    random = np.random.default_rng(0)
    rays = random.standard_normal((5000, 3))
    rays = (rays / np.linalg.norm(rays, axis=1, keepdims=True)).astype(np.float32)
    wall = Panorama(kind="panorama", colours=((0.1, 0.2, 0.3), (0.5, 0.4, 0.6)))
    drawn = panorama(rays, wall)
    assert np.array_equal(drawn, panorama(rays, wall))
    assert (drawn >= np.array([0.3, 0.2, 0.1]) - 1e-6).all()  # BGR
    assert (drawn <= np.array([0.6, 0.4, 0.5]) + 1e-6).all()
    assert (drawn.std(axis=0) > 0.02).all()
    other = panorama(rays, wall.model_copy(update={"seed": 1}))
    assert abs(np.corrcoef(drawn[:, 0], other[:, 0])[0, 1]) < 0.3


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 50), at=st.tuples(*[st.floats(-50, 50)] * 3))
def test_the_pattern_is_smooth_and_within_its_range(
    seed: int, at: tuple[float, float, float]
) -> None:
    points = np.array(at) + np.linspace(0, 1, 400)[:, None] * np.array([1.0, 0.4, -0.3])
    values = pattern(points, seed)
    assert (abs(values) <= 1).all()
    assert abs(np.diff(values)).max() < 0.15
