"""Random missions in orbit: `random_orbit` draws a scenario from a seed.

Drawn are the satellite, its attitude, drift and spin; the side of the arm and its elbow; sun, Earth or stars,
lens, camera shake, exposure and noise; the outcome. Missions that are out of reach or not properly visible
are drawn again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from visup.agent.model.errors import SettingsError
from visup.render.imaging.renderer import Renderer
from visup.render.meshes.spacecraft import mesh
from visup.render.orbits.capture_scripts import OUTCOMES, Approach, capture_script
from visup.render.orbits.unexpected_objects import with_unexpected_object
from visup.render.scenario.optics import (
    Camera,
    CameraKey,
    Earth,
    Light,
    Sensor,
    Shake,
    Stars,
    Texture,
)
from visup.render.scenario.scenario import PoseKey, Scenario, SceneObject, SteadyRotation

ORBIT = "orbit"
"""Name of this kind of random world."""

SATELLITES = ("spartan", "spartan", "relay_satellite", "lander", "station")
"""Meshes of which one is captured, the one of `sts87` in two of five missions."""

ARM, SATELLITE = 2, 3
"""Labels, as in the shared missions."""

SIZE = (480, 360)
FPS = 12.5
"""Image size and frame rate with motion per frame, in pixels, as in missions of 640 x 480 at 25 fps."""

_MAX_TRIES = 200
_PREVIEW_SIZE = (96, 72)
_MIN_AREA_SHARE = 0.012

Vector = NDArray[np.float64]


def random_orbit(seed: int, outcome: str | None = None, size: tuple[int, int] = SIZE) -> Scenario:
    """A mission in orbit; deterministic for a seed, outcome and size.

    Args:
        seed: Random seed.
        outcome: One of `OUTCOMES`; drawn when None.
        size: Of the image, (width, height).

    Raises:
        SettingsError: No such mission was found.
    """
    if outcome is not None and outcome not in OUTCOMES:
        raise SettingsError(
            f"a world of kind {ORBIT!r} cannot go {outcome!r}", expected=", ".join(OUTCOMES)
        )
    rng = np.random.default_rng([seed, *ORBIT.encode()])
    drawn = str(rng.choice(OUTCOMES))
    for _ in range(_MAX_TRIES):
        scenario = _draw_mission(rng, f"{ORBIT}_{seed:04d}_{outcome or drawn}", outcome or drawn)
        if _is_visible(scenario):
            return scenario.resized(size)
    raise SettingsError(f"no mission could be drawn from seed {seed}", expected="another seed")


def _draw_mission(rng: np.random.Generator, name: str, outcome: str) -> Scenario:
    model = str(rng.choice(SATELLITES))
    longest_side = float(np.ptp(mesh(model).vertices, axis=0).max())
    scale = 1.0 if model == "spartan" else rng.uniform(2.6, 3.4) / longest_side
    attitude = Rotation.random(random_state=int(rng.integers(1 << 30)))
    side = rng.uniform(0, 2 * np.pi)
    away = _unit(np.array([rng.uniform(-0.2, 0.1), np.cos(side), np.sin(side)]))
    satellite_position = np.array([rng.uniform(9.5, 12.5), 0.0, 0.0]) - rng.uniform(0.5, 1.0) * away
    points = scale * attitude.apply(mesh(model).vertices)
    contact_point = satellite_position + points[int(np.argmax(points @ away))]
    approach = _approach(rng, contact_point, away, outcome)
    script = capture_script(rng, outcome, approach, satellite_position)
    camera = _camera(rng, approach.end_s)
    # The pose of the track is that at contact: the rotation until then is subtracted.
    rotation_until_contact = Rotation.from_rotvec(
        np.radians(approach.spin.deg_per_s * approach.contact_s)
        * _unit(np.asarray(approach.spin.axis))
    )
    start = _quat(rotation_until_contact.inv() * attitude)
    satellite = SceneObject(
        name="satellite",
        mesh=model,
        label=SATELLITE,
        actor=True,
        model=model,
        scale=scale,
        texture=_texture(rng, model, scale),
        track=tuple(k.model_copy(update={"quat_xyzw": start}) for k in script.satellite),
        spin=script.spins,
        attach=script.attach,
    )
    objects = [satellite, _arm(rng, approach, script.tip)]
    truth = script.truth
    if outcome in ("intruder", "crossing"):
        unexpected, truth = with_unexpected_object(rng, outcome, script, approach, camera)
        objects.append(unexpected)
    return Scenario(
        name=name,
        duration_s=approach.end_s,
        seed=int(rng.integers(1 << 30)),
        camera=camera,
        object=tuple(objects),
        truth=truth,
        **_environment(rng),
    )


def _approach(
    rng: np.random.Generator, contact_point: Vector, away: Vector, outcome: str
) -> Approach:
    contact_s = round(rng.uniform(7.0, 9.0), 2)
    ends = {"short": contact_s - rng.uniform(0.4, 1.5), "aborted": contact_s + 3.0}
    drift = _unit(rng.normal(size=3)) * rng.uniform(0.02, 0.045)
    return Approach(
        contact_point=contact_point,
        away=away,
        tool_direction=_unit(-away + rng.normal(scale=0.25, size=3)),
        start_distance=rng.uniform(1.8, 2.9),
        drift=drift,
        spin=SteadyRotation(
            axis=_rounded(_unit(rng.normal(size=3))), deg_per_s=rng.uniform(0.1, 1.0)
        ),
        contact_s=contact_s,
        end_s=round(ends.get(outcome, contact_s + rng.uniform(6.0, 7.5)), 2),
    )


def _arm(rng: np.random.Generator, approach: Approach, tip: Any) -> SceneObject:
    """The arm: its foot out of view on its side, bending parallel to the image."""
    towards_base = _unit(approach.away + rng.normal(scale=0.2, size=3))
    foot = approach.contact_point + rng.uniform(10.0, 12.0) * towards_base
    yaw_axis = _unit(np.cross([1.0, 0.0, 0.0], towards_base)) * rng.choice([-1.0, 1.0])
    x = _unit(-towards_base - (-towards_base @ yaw_axis) * yaw_axis)
    frame = Rotation.from_matrix(np.stack([x, np.cross(yaw_axis, x), yaw_axis], axis=1))
    return SceneObject(
        name="arm",
        mesh="arm",
        label=ARM,
        actor=True,
        model="arm",
        track=(PoseKey(position=_rounded(foot), quat_xyzw=_quat(frame)),),
        tip=tip,
    )


def _texture(rng: np.random.Generator, model: str, scale: float) -> Texture | None:
    """A texture of foil and panels for a mesh of one colour; the satellite of `sts87` has its own."""
    if model == "spartan":
        return None
    seed = int(rng.integers(1 << 20))
    return Texture(contrast=rng.uniform(0.2, 0.5), size=rng.uniform(0.25, 0.6) / scale, seed=seed)


def _camera(rng: np.random.Generator, end_s: float) -> Camera:
    roll = np.radians(rng.uniform(-15, 15))
    shake = None
    if rng.random() < 0.3:
        shake = Shake(amplitude_deg=rng.uniform(0.005, 0.03), seed=int(rng.integers(1 << 20)))
    up = (0.0, round(float(np.sin(roll)), 5), round(float(np.cos(roll)), 5))
    ahead = CameraKey(position=(0.0, 0.0, 0.0), look_at=(10.0, 0.0, 0.0), up=up)
    aside = CameraKey(
        at_s=end_s, position=(0.0, 0.0, 0.0), look_at=(10.0, rng.normal(0, 0.2), 0.0), up=up
    )
    pans = rng.random() < 0.2
    return Camera(
        fps=FPS,
        fov_vertical_deg=round(rng.uniform(34.0, 42.0), 2),
        track=(ahead, aside) if pans else (ahead,),
        shake=shake,
        smooth=pans,
    )


def _environment(rng: np.random.Generator) -> dict[str, Any]:
    """Light, background and sensor."""
    sun = _unit(np.array([-rng.uniform(0.25, 0.9), *rng.normal(scale=0.6, size=2)]))
    earth = _unit(np.array([rng.uniform(0.2, 0.6), *rng.normal(scale=0.8, size=2)]))
    over_earth = rng.random() < 0.4
    seed = int(rng.integers(1 << 20))
    background = (
        Earth(
            kind="earth",
            altitude_km=rng.uniform(280, 450),
            clouds=rng.uniform(0.3, 0.6),
            brightness=rng.uniform(0.3, 0.6),
            turn_deg_per_s=float(rng.choice([0.0, 0.065])),
            seed=seed,
        )
        if over_earth
        else Stars(seed=seed)
    )
    light = Light(sun=_rounded(sun), earth=_rounded(earth), earthshine=rng.uniform(0.08, 0.25))
    sensor = Sensor(
        exposure=rng.uniform(0.8, 1.1), noise=rng.uniform(1.0, 2.0), blur_px=rng.uniform(0.4, 0.8)
    )
    return {"light": light, "background": background, "sensor": sensor}


def _is_visible(scenario: Scenario) -> bool:
    """Whether the arm reaches, and arm and satellite are visible until it is near, clear of the border."""
    preview = Renderer(scenario.resized(_PREVIEW_SIZE))
    near = max((s.to_s for s in scenario.truth.stage[:1]), default=0.6 * scenario.duration_s)
    try:
        for time in (0.04, 0.5 * near, 0.9 * near, scenario.duration_s):
            mask = preview.mask(int(time * scenario.camera.fps))
            if time < near and not _shows_actors(mask):
                return False
    except SettingsError:
        return False
    return True


def _shows_actors(mask: NDArray[np.uint8]) -> bool:
    inner = mask[1:-1, 1:-1]
    whole = np.count_nonzero(inner == SATELLITE) == np.count_nonzero(mask == SATELLITE)
    return whole and all(np.mean(mask == label) > _MIN_AREA_SHARE for label in (ARM, SATELLITE))


def _quat(rotation: Rotation) -> tuple[float, float, float, float]:
    x, y, z, w = (round(float(v), 6) for v in rotation.as_quat())
    return x, y, z, w


def _rounded(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) for v in vector)
    return x, y, z


def _unit(vector: Vector) -> Vector:
    return np.asarray(vector / np.linalg.norm(vector))
