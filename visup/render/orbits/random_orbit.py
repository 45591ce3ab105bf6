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
from visup.render.orbits.courses import OUTCOMES, Approach, course_of
from visup.render.orbits.strangers import with_stranger
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

_TRIES = 200
_SMALL = (96, 72)
_LEAST_SHARE = 0.012

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
    for _ in range(_TRIES):
        scenario = _drawn(rng, f"{ORBIT}_{seed:04d}_{outcome or drawn}", outcome or drawn)
        if _is_well_seen(scenario):
            return scenario.resized(size)
    raise SettingsError(f"no mission could be drawn from seed {seed}", expected="another seed")


def _drawn(rng: np.random.Generator, name: str, outcome: str) -> Scenario:
    model = str(rng.choice(SATELLITES))
    long = float(np.ptp(mesh(model).vertices, axis=0).max())
    scale = 1.0 if model == "spartan" else rng.uniform(2.6, 3.4) / long
    lie = Rotation.random(random_state=int(rng.integers(1 << 30)))
    side = rng.uniform(0, 2 * np.pi)
    away = _unit(np.array([rng.uniform(-0.2, 0.1), np.cos(side), np.sin(side)]))
    middle = np.array([rng.uniform(9.5, 12.5), 0.0, 0.0]) - rng.uniform(0.5, 1.0) * away
    points = scale * lie.apply(mesh(model).vertices)
    contact = middle + points[int(np.argmax(points @ away))]
    approach = _approach(rng, contact, away, outcome)
    course = course_of(rng, outcome, approach, middle)
    camera = _camera(rng, approach.end_s)
    # The pose of the track is that at contact: the rotation until then is subtracted.
    turned = Rotation.from_rotvec(
        np.radians(approach.spin.deg_per_s * approach.touch_s)
        * _unit(np.asarray(approach.spin.axis))
    )
    start = _quat(turned.inv() * lie)
    satellite = SceneObject(
        name="satellite",
        mesh=model,
        label=SATELLITE,
        actor=True,
        model=model,
        scale=scale,
        texture=_grain(rng, model, scale),
        track=tuple(k.model_copy(update={"quat_xyzw": start}) for k in course.satellite),
        spin=course.spins,
        attach=course.attach,
    )
    things = [satellite, _arm(rng, approach, course.tip)]
    truth = course.truth
    if outcome in ("intruder", "crossing"):
        stranger, truth = with_stranger(rng, outcome, course, approach, camera)
        things.append(stranger)
    return Scenario(
        name=name,
        duration_s=approach.end_s,
        seed=int(rng.integers(1 << 30)),
        camera=camera,
        object=tuple(things),
        truth=truth,
        **_surroundings(rng),
    )


def _approach(rng: np.random.Generator, contact: Vector, away: Vector, outcome: str) -> Approach:
    touch = round(rng.uniform(7.0, 9.0), 2)
    ends = {"short": touch - rng.uniform(0.4, 1.5), "aborted": touch + 3.0}
    drift = _unit(rng.normal(size=3)) * rng.uniform(0.02, 0.045)
    return Approach(
        contact=contact,
        away=away,
        pointing=_unit(-away + rng.normal(scale=0.25, size=3)),
        begin=rng.uniform(1.8, 2.9),
        drift=drift,
        spin=SteadyRotation(
            axis=_place(_unit(rng.normal(size=3))), deg_per_s=rng.uniform(0.1, 1.0)
        ),
        touch_s=touch,
        end_s=round(ends.get(outcome, touch + rng.uniform(6.0, 7.5)), 2),
    )


def _arm(rng: np.random.Generator, approach: Approach, tip: Any) -> SceneObject:
    """The arm: its foot out of view on its side, bending parallel to the image."""
    out = _unit(approach.away + rng.normal(scale=0.2, size=3))
    foot = approach.contact + rng.uniform(10.0, 12.0) * out
    yaw_axis = _unit(np.cross([1.0, 0.0, 0.0], out)) * rng.choice([-1.0, 1.0])
    x = _unit(-out - (-out @ yaw_axis) * yaw_axis)
    frame = Rotation.from_matrix(np.stack([x, np.cross(yaw_axis, x), yaw_axis], axis=1))
    return SceneObject(
        name="arm",
        mesh="arm",
        label=ARM,
        actor=True,
        model="arm",
        track=(PoseKey(position=_place(foot), quat_xyzw=_quat(frame)),),
        tip=tip,
    )


def _grain(rng: np.random.Generator, model: str, scale: float) -> Texture | None:
    """A texture of foil and panels for a mesh of one colour; the satellite of `sts87` has its own."""
    if model == "spartan":
        return None
    seed = int(rng.integers(1 << 20))
    return Texture(contrast=rng.uniform(0.2, 0.5), size=rng.uniform(0.25, 0.6) / scale, seed=seed)


def _camera(rng: np.random.Generator, end_s: float) -> Camera:
    lean = np.radians(rng.uniform(-15, 15))
    shake = None
    if rng.random() < 0.3:
        shake = Shake(amplitude_deg=rng.uniform(0.005, 0.03), seed=int(rng.integers(1 << 20)))
    up = (0.0, round(float(np.sin(lean)), 5), round(float(np.cos(lean)), 5))
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


def _surroundings(rng: np.random.Generator) -> dict[str, Any]:
    """Light, background and sensor."""
    sun = _unit(np.array([-rng.uniform(0.25, 0.9), *rng.normal(scale=0.6, size=2)]))
    earth = _unit(np.array([rng.uniform(0.2, 0.6), *rng.normal(scale=0.8, size=2)]))
    over_earth = rng.random() < 0.4
    seed = int(rng.integers(1 << 20))
    behind = (
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
    light = Light(sun=_place(sun), earth=_place(earth), earthshine=rng.uniform(0.08, 0.25))
    sensor = Sensor(
        exposure=rng.uniform(0.8, 1.1), noise=rng.uniform(1.0, 2.0), blur_px=rng.uniform(0.4, 0.8)
    )
    return {"light": light, "background": behind, "sensor": sensor}


def _is_well_seen(scenario: Scenario) -> bool:
    """Whether the arm reaches, and arm and satellite are visible until it is near, clear of the border."""
    small = Renderer(scenario.resized(_SMALL))
    near = max((s.to_s for s in scenario.truth.stage[:1]), default=0.6 * scenario.duration_s)
    try:
        for time in (0.04, 0.5 * near, 0.9 * near, scenario.duration_s):
            mask = small.mask(int(time * scenario.camera.fps))
            if time < near and not _shows(mask):
                return False
    except SettingsError:
        return False
    return True


def _shows(mask: NDArray[np.uint8]) -> bool:
    inner = mask[1:-1, 1:-1]
    whole = np.count_nonzero(inner == SATELLITE) == np.count_nonzero(mask == SATELLITE)
    return whole and all(np.mean(mask == label) > _LEAST_SHARE for label in (ARM, SATELLITE))


def _quat(rotation: Rotation) -> tuple[float, float, float, float]:
    x, y, z, w = (round(float(v), 6) for v in rotation.as_quat())
    return x, y, z, w


def _place(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) for v in vector)
    return x, y, z


def _unit(vector: Vector) -> Vector:
    return np.asarray(vector / np.linalg.norm(vector))
