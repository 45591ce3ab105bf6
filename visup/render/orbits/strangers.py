"""Unexpected objects that come by while an arm is at work, towards the satellite or past it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.render.meshes.spacecraft import mesh
from visup.render.orbits.courses import SCORED_FROM_S, Approach, CaptureCourse
from visup.render.scenario.optics import Camera, Texture
from visup.render.scenario.scenario import (
    AlertTruth,
    PoseKey,
    ScenarioTruth,
    SceneObject,
    StageTruth,
    SteadyRotation,
)

KNOWN = ("dish", "astronaut", "station", "airplane", "umbrella", "rocket")
"""Meshes of which one comes by in half of the missions."""

HIDDEN = ("rover", "helicopter", "hammer", "quadcopter", "robot", "teapot")
"""Meshes of which one comes by otherwise; the supervisor has no models of them."""

LABEL = 4

Vector = NDArray[np.float64]


def with_stranger(
    rng: np.random.Generator,
    outcome: str,
    course: CaptureCourse,
    approach: Approach,
    camera: Camera,
) -> tuple[SceneObject, ScenarioTruth]:
    """An unexpected object and the ground truth of a mission in which it comes by.

    Args:
        rng: Draws its mesh, direction and time.
        outcome: `intruder` or `crossing`.
        course: The events without it.
        approach: The approach of that course.
        camera: The camera.
    """
    middle = np.asarray(course.satellite[-1].position)
    collides = outcome == "intruder"
    nearer = 1.0 if collides else rng.uniform(0.5, 0.65)
    aim = nearer * middle + (0.0 if collides else rng.normal(scale=0.15, size=3))
    name = str(rng.choice((*KNOWN, *HIDDEN)))
    size = rng.uniform(1.0, 1.8) if collides else rng.uniform(1.0, 2.0)
    bearing = np.arctan2(approach.away[2], approach.away[1]) + np.pi + rng.uniform(-1.1, 1.1)
    side = np.array([rng.uniform(-0.12, 0.12), np.cos(bearing), np.sin(bearing)])
    way = _to_border(aim, side, camera) + 0.5 * size
    shows_s = rng.uniform(3.0, 4.5)
    meets_s = approach.end_s + 2.0 if collides else shows_s + rng.uniform(3.0, 4.0)
    velocity = -side * way / (meets_s - shows_s)
    track = tuple(
        PoseKey(at_s=t, position=_rounded(aim + velocity * (t - meets_s)), euler_deg=turn)
        for turn in [_rounded(rng.uniform(-180, 180, 3))]
        for t in (0.0, approach.end_s)
    )
    spin = SteadyRotation(
        axis=_rounded(rng.normal(size=3)), deg_per_s=round(rng.uniform(0.0, 4.0), 3)
    )
    scale = size / float(np.ptp(mesh(name).vertices, axis=0).max())
    stranger = SceneObject(
        name="intruder",
        mesh=name,
        label=LABEL,
        model=UNKNOWN_OBJECT if name in HIDDEN else name,
        scale=scale,
        texture=Texture(contrast=0.35, size=0.2 * size / scale, seed=int(rng.integers(1 << 20))),
        track=track,
        spin=(spin,),
    )
    return stranger, _disturbed(course.truth, shows_s, approach.end_s, collides=collides)


def _disturbed(
    truth: ScenarioTruth, shows_s: float, end_s: float, *, collides: bool
) -> ScenarioTruth:
    """Ground truth once an unexpected object appears: it was not expected, and it may collide."""
    alerts = [AlertTruth(kind="unexpected_object", from_s=shows_s)]
    stages: tuple[StageTruth, ...] = ()
    if collides:
        met = ("intruder", "satellite")
        alerts.append(AlertTruth(kind="collision_course", from_s=shows_s + 2.0, objects=met))
        stages = (StageTruth(stage="approach", from_s=SCORED_FROM_S, to_s=end_s, outcome="unsafe"),)
    return truth.model_copy(
        update={"verdict": "interrupted", "alert": tuple(alerts), "stage": stages}
    )


def _to_border(aim: Vector, side: Vector, camera: Camera) -> float:
    """Metres from a point along a direction to the image border, at the point's depth."""
    reach = aim[0] * np.tan(np.radians(camera.fov_vertical_deg) / 2)
    halves = np.array([reach * camera.size[0] / camera.size[1], reach])
    with np.errstate(divide="ignore"):
        steps = (np.sign(side[1:]) * halves - aim[1:]) / side[1:]
    return float(max(steps.min(), 0.5))


def _rounded(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) for v in vector)
    return x, y, z
