"""Unexpected objects that come by while an arm is at work, towards the satellite or past it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.render.meshes.spacecraft import mesh
from visup.render.orbits.capture_scripts import SCORED_FROM_S, Approach, CaptureScript
from visup.render.scenario.optics import Camera, Texture
from visup.render.scenario.scenario import (
    AlertTruth,
    PoseKey,
    ScenarioTruth,
    SceneObject,
    StageTruth,
    SteadyRotation,
)

KNOWN_MESHES = ("dish", "astronaut", "station", "airplane", "umbrella", "rocket")
"""Meshes of which one comes by in half of the missions."""

UNKNOWN_MESHES = ("rover", "helicopter", "hammer", "quadcopter", "robot", "teapot")
"""Meshes of which one comes by otherwise; the supervisor has no models of them."""

LABEL = 4

Vector = NDArray[np.float64]


def with_unexpected_object(
    rng: np.random.Generator,
    outcome: str,
    script: CaptureScript,
    approach: Approach,
    camera: Camera,
) -> tuple[SceneObject, ScenarioTruth]:
    """An unexpected object and the ground truth of a mission in which it comes by.

    Args:
        rng: Draws its mesh, direction and time.
        outcome: `intruder` or `crossing`.
        script: The events without it.
        approach: The approach of that script.
        camera: The camera.
    """
    satellite_position = np.asarray(script.satellite[-1].position)
    collides = outcome == "intruder"
    depth_share = 1.0 if collides else rng.uniform(0.5, 0.65)
    aim = depth_share * satellite_position + (0.0 if collides else rng.normal(scale=0.15, size=3))
    name = str(rng.choice((*KNOWN_MESHES, *UNKNOWN_MESHES)))
    size = rng.uniform(1.0, 1.8) if collides else rng.uniform(1.0, 2.0)
    azimuth = np.arctan2(approach.away[2], approach.away[1]) + np.pi + rng.uniform(-1.1, 1.1)
    side = np.array([rng.uniform(-0.12, 0.12), np.cos(azimuth), np.sin(azimuth)])
    distance = _distance_to_border(aim, side, camera) + 0.5 * size
    appears_s = rng.uniform(3.0, 4.5)
    meets_s = approach.end_s + 2.0 if collides else appears_s + rng.uniform(3.0, 4.0)
    velocity = -side * distance / (meets_s - appears_s)
    track = tuple(
        PoseKey(at_s=t, position=_rounded(aim + velocity * (t - meets_s)), euler_deg=turn)
        for turn in [_rounded(rng.uniform(-180, 180, 3))]
        for t in (0.0, approach.end_s)
    )
    spin = SteadyRotation(
        axis=_rounded(rng.normal(size=3)), deg_per_s=round(rng.uniform(0.0, 4.0), 3)
    )
    scale = size / float(np.ptp(mesh(name).vertices, axis=0).max())
    unexpected = SceneObject(
        name="intruder",
        mesh=name,
        label=LABEL,
        model=UNKNOWN_OBJECT if name in UNKNOWN_MESHES else name,
        scale=scale,
        texture=Texture(contrast=0.35, size=0.2 * size / scale, seed=int(rng.integers(1 << 20))),
        track=track,
        spin=(spin,),
    )
    truth = _truth_with_object(script.truth, appears_s, approach.end_s, collides=collides)
    return unexpected, truth


def _truth_with_object(
    truth: ScenarioTruth, appears_s: float, end_s: float, *, collides: bool
) -> ScenarioTruth:
    """Ground truth once an unexpected object appears: it was not expected, and it may collide."""
    alerts = [AlertTruth(kind="unexpected_object", from_s=appears_s)]
    stages: tuple[StageTruth, ...] = ()
    if collides:
        colliding = ("intruder", "satellite")
        alerts.append(
            AlertTruth(kind="collision_course", from_s=appears_s + 2.0, objects=colliding)
        )
        stages = (StageTruth(stage="approach", from_s=SCORED_FROM_S, to_s=end_s, outcome="unsafe"),)
    return truth.model_copy(
        update={"verdict": "interrupted", "alert": tuple(alerts), "stage": stages}
    )


def _distance_to_border(aim: Vector, side: Vector, camera: Camera) -> float:
    """Metres from a point along a direction to the image border, at the point's depth."""
    half_height = aim[0] * np.tan(np.radians(camera.fov_vertical_deg) / 2)
    halves = np.array([half_height * camera.size[0] / camera.size[1], half_height])
    with np.errstate(divide="ignore"):
        steps = (np.sign(side[1:]) * halves - aim[1:]) / side[1:]
    return float(max(steps.min(), 0.5))


def _rounded(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) for v in vector)
    return x, y, z
