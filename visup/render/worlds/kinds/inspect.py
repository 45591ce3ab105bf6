"""`inspect`: a drone or a rover goes round a statue or tower within a range, and leaves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.meshes.spacecraft import mesh
from visup.render.worlds.assets import clutter, machines
from visup.render.worlds.assets.scenery import (
    distinct_colour,
    hall,
    meadow,
    pick_colour,
    random_seed,
)
from visup.render.worlds.kinds.kind import (
    Script,
    complete_world,
    direction_from_angles,
    frames_until,
    stage_spans,
    truncated,
)
from visup.render.worlds.motion import (
    dropped,
    eased,
    frame_at,
    frame_times,
    make_poses,
    static_pose,
)
from visup.render.worlds.viewpoint import (
    first_in_view,
    fixed_camera,
    project,
    with_camera_motion,
)
from visup.render.worlds.world import (
    FPS,
    SIZE,
    Contact,
    Motion,
    Poses,
    RigidBody,
    Surface,
    TaskTruth,
    Viewpoint,
    World,
)

OUTCOMES = ("ok", "touch", "leave", "in_progress")
INSPECTOR, STATION = 2, 3
STATUES = (
    "dog",
    "horse",
    "camel",
    "pig",
    "teapot",
    "chair",
    "lamp",
    "dish",
    "astronaut",
    "espresso",
)
HOLD_S = 5
MIN_CLEAR_GAP_PX = 12
"""Image distance between both, pixels, in flights that are clear of the station."""

Doubles = NDArray[np.float64]

TASK = """\
# inspect_gap.task: the inspector goes round the station within a range, and leaves.
<inspect>    ::= <approach> <fly_around> <retreat>
<approach>   ::= converging(inspector, station)
<fly_around> ::= gap(inspector, station) {range} for {hold} s
<retreat>    ::= diverging(inspector, station) for 1 s
never touching(inspector, station)
"""


@dataclass(frozen=True, slots=True)
class InspectTimes:
    """When it starts, is on its circle, leaves it (or hits the station), and the clip ends, seconds."""

    begin: float
    arrive: float
    leave: float
    end: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a station is inspected; `outcome` is one of `OUTCOMES`."""
    flies = bool(rng.random() < 0.65)
    station, height = _station(rng)
    colour = distinct_colour(rng, [(0.4, 0.4, 0.4)])
    craft, level = _craft(rng, colour, height, flies)
    radius = float(np.linalg.norm(station.vertices[:, :2], axis=1).max() + rng.uniform(0.9, 1.5))
    times = _times(rng, outcome)
    frames = frames_until(times.end)
    standing = static_pose(0, 0, 0, float(rng.uniform(0, 6.3)))
    # Some pass in front of or behind the station, which looks like contact in the image but is not.
    crossing = bool(rng.random() < 0.2)
    for min_elevation_deg in (55, 65, 72, 78, 82, 85):
        view = _view(rng, (radius, height), min_elevation_deg, frames)
        poses, hit_s = _flight(rng, (station, craft), (radius, level), times, outcome, frames)
        gaps = _gaps(view, station, standing, craft, poses)
        free = gaps[: frame_at(min(hit_s - 1.5, times.end))]
        if crossing or free.min() > MIN_CLEAR_GAP_PX:
            break
        radius += 0.12
    seen = (first_in_view(view, poses[:, :3, 3], SIZE) or 0) / FPS
    truth, limit = _truth(replace(times, begin=max(times.begin, seen)), outcome, gaps, hit_s)
    if outcome == "in_progress":
        end = times.arrive + float(rng.uniform(1.5, 3.5))
        truth, frames = truncated(truth, end), frames_until(end)
    wording = "< {} px" if rng.random() < 0.5 else "between 3 px and {} px"
    surface = Surface("grain", 0.4, float(rng.uniform(0.05, 0.3)), random_seed(rng))
    bodies = [
        RigidBody("station", station, standing, STATION, surface),
        RigidBody("inspector", craft, poses, INSPECTOR, surface),
        *_surroundings(rng, radius),
    ]
    script = Script(
        bodies,
        view,
        ("inspect_gap", TASK.format(range=wording.format(limit), hold=HOLD_S)),
        ("inspector", "station"),
        truth,
        frames,
    )
    return complete_world(rng, "inspect", script)


def _station(rng: np.random.Generator) -> tuple[Solid, float]:
    """A statue on a pedestal, or a tower; its height."""
    stone = pick_colour(rng, bool(rng.random() < 0.3))
    if rng.random() < 0.35:
        return _tower(rng, stone)
    solid = mesh(str(rng.choice(STATUES)))
    low, high = solid.vertices.min(axis=0), solid.vertices.max(axis=0)
    size = float(rng.uniform(1.6, 2.4)) / float((high - low).max())
    middle = (low + high) / 2
    foot = float(rng.uniform(0.1, 0.5))
    statue = (
        solid.moved(by=(-middle[0], -middle[1], -low[2])).moved(scale=size).moved(by=(0, 0, foot))
    )
    if rng.random() < 0.7:
        statue = statue.painted(stone)
    pedestal_radius = float(np.linalg.norm(statue.vertices[:, :2], axis=1).max()) * 0.75
    pedestal = cone((0, 0, 0), (0, 0, foot), pedestal_radius, None, pick_colour(rng, vivid=False))
    return join(statue, pedestal), foot + size * float(high[2] - low[2])


def _tower(rng: np.random.Generator, colour: Colour) -> tuple[Solid, float]:
    height, radius = float(rng.uniform(1.4, 2.2)), float(rng.uniform(0.35, 0.6))
    top = pick_colour(rng)
    if rng.random() < 0.5:
        return join(
            cone((0, 0, 0), (0, 0, height), radius, 0.7 * radius, colour),
            cone((0, 0, height), (0, 0, height + 0.4), 0.9 * radius, 0.0, top),
        ), height + 0.4
    return join(
        box((1.6 * radius, 1.6 * radius, height), (0, 0, height / 2), colour),
        box((2 * radius, 2 * radius, 0.2), (0, 0, height + 0.1), top),
    ), height + 0.2


def _craft(
    rng: np.random.Generator, colour: Colour, height: float, flies: bool
) -> tuple[Solid, float]:
    """The inspector and its height."""
    if flies:
        return machines.drone(rng, colour, float(rng.uniform(0.6, 0.9))), height * float(
            rng.uniform(0.35, 0.75)
        )
    return machines.vehicle(rng, colour)[0].moved(scale=0.75), 0.0


def _times(rng: np.random.Generator, outcome: str) -> InspectTimes:
    begin = float(rng.uniform(0.2, 0.9))
    arrive = begin + float(rng.uniform(2.4, 3.4))
    stay = {"leave": rng.uniform(2.0, 3.2), "touch": rng.uniform(2.5, 5.0)}
    leave = arrive + float(stay.get(outcome, rng.uniform(6.3, 7.4)))
    return InspectTimes(begin, arrive, leave, min(leave + float(rng.uniform(2.6, 3.4)), 15.0))


def _view(
    rng: np.random.Generator, sizes: tuple[float, float], min_elevation_deg: float, frames: int
) -> Viewpoint:
    """From high up, so that the circle is visible; no zoom, since the task measures in pixels."""
    radius, height = sizes
    elevation, side = np.radians(rng.uniform(min_elevation_deg, 88)), rng.uniform(0, 2 * np.pi)
    distance = 3.6 * (radius + 0.5)
    aim = np.array([0.0, 0.0, 0.3 * height])
    view = fixed_camera(
        aim + distance * direction_from_angles(side, elevation),
        aim,
        float(rng.uniform(38, 44)),
        frames,
    )
    return with_camera_motion(view, rng, str(rng.choice(["fixed", "fixed", "shaking", "panning"])))


def _flight(
    rng: np.random.Generator,
    solids: tuple[Solid, Solid],
    circle: tuple[float, float],
    times: InspectTimes,
    outcome: str,
    frames: int,
) -> tuple[Poses, float]:
    """(F, 4, 4) of the inspector, and when it hits the station (past the end if it does not), seconds."""
    t = frame_times(frames)
    (station, craft), (radius, level) = solids, circle
    first, turn = rng.uniform(0, 2 * np.pi), rng.choice([-1, 1]) * rng.uniform(0.45, 0.7)
    moving = np.clip(t, times.arrive - 0.8, times.leave + (0.0 if outcome == "touch" else 0.8))
    angle = first + turn * (moving - times.arrive)
    away = radius * float(rng.uniform(1.9, 2.4))
    keys = [(times.begin, away), (times.arrive, radius), (times.leave, radius)]
    if outcome == "touch":
        keys += [(times.leave + 1.8, 0.0)]
    else:
        keys += [(times.leave + 2.4, away)]
    distance = eased(t, keys)
    bob = 0.03 * np.sin(2 * np.pi * t / 1.7) if level else np.zeros(frames)
    at = np.column_stack([distance * np.cos(angle), distance * np.sin(angle), level + bob])
    step = np.gradient(at[:, :2], axis=0)
    heading = np.unwrap(np.arctan2(step[:, 1], step[:, 0])) if not level else angle + np.pi
    poses = make_poses(at, heading)
    if outcome != "touch":
        return poses, times.end + 1
    return _stopped(poses, _first_hit(station, craft, poses), level)


def _first_hit(station: Solid, craft: Solid, poses: Poses) -> int:
    """The first frame in which the craft is within 4 cm of the station."""
    tree = cKDTree(_sample_surface(station, 20_000))
    own = _sample_surface(craft, 500)
    for index, pose in enumerate(poses):
        points = own @ pose[:3, :3].T + pose[:3, 3]
        if tree.query(points)[0].min() < 0.04:
            return index
    return len(poses) - 1


def _sample_surface(solid: Solid, count: int) -> Doubles:
    """(count, 3) points spread evenly over the faces of a solid."""
    rng = np.random.default_rng(0)
    corners = solid.vertices[solid.faces]
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    chosen = corners[rng.choice(len(area), count, p=area / area.sum())]
    return np.asarray(np.einsum("nk,nkd->nd", rng.dirichlet((1, 1, 1), count), chosen))


def _stopped(poses: Poses, hit: int, level: float) -> tuple[Poses, float]:
    """It stops at the impact; a flying craft falls a little later."""
    out = poses.copy()
    out[hit:] = poses[hit]
    since = hit + FPS
    if level and since + 1 < len(out):
        out, _ = dropped(out, since, 0.1, (0.5, 0.4, 0.0))
    return out, hit / FPS


def _gaps(view: Viewpoint, station: Solid, standing: Poses, craft: Solid, poses: Poses) -> Doubles:
    """(F,) approximate distance between their outlines, pixels, for the camera without shake."""
    still_points = project(view, _sample_surface(station, 600) @ standing[0, :3, :3].T, SIZE)
    own = _sample_surface(craft, 200)
    found = []
    for pose in poses:
        points = project(view, own @ pose[:3, :3].T + pose[:3, 3], SIZE)
        found.append(cdist(points, still_points).min())
    return np.array(found)


def _truth(times: InspectTimes, outcome: str, gaps: Doubles, hit_s: float) -> tuple[TaskTruth, int]:
    """Ground truth, and the range in pixels that its user chose."""
    t = frame_times(len(gaps))
    round_about = (t >= times.arrive) & (t <= times.leave)
    limit = int(np.ceil(gaps[round_about].max() * 1.12 / 10) * 10)
    far = t[gaps >= limit]
    # If it is within the range from the start, it has approached when it is on its circle.
    approaching = far[far < times.arrive]
    begin = max(times.begin, approaching[-1]) if len(approaching) else times.arrive
    over = min(far[far > times.leave], default=times.end)
    moves = (Motion("inspector", times.begin, times.end),)
    approach = ("approach", times.begin, begin)
    if outcome == "touch":
        stages = stage_spans(approach, ("fly_around", begin, hit_s, "unsafe"))
        touch = (Contact("inspector", "station", hit_s, times.end),)
        alerts = {"never touching": hit_s}
        return TaskTruth(outcome, "interrupted", stages, (), touch, moves, alerts), limit
    if outcome == "leave":
        stages = stage_spans(approach, ("fly_around", begin, over, "failing"))
        return TaskTruth(outcome, "failed", stages, (), (), moves), limit
    stages = stage_spans(
        approach, ("fly_around", begin, times.leave), ("retreat", times.leave, times.end)
    )
    return TaskTruth(outcome, "succeeded", stages, (), (), moves), limit


def _surroundings(rng: np.random.Generator, radius: float) -> list[RigidBody]:
    indoors = rng.random() < 0.3
    found = list(hall(rng, radius * 3.5) if indoors else meadow(rng))
    side = 2.6 * radius
    corridors = [(0.0, 0.0, 1.8 * radius)]
    return found + clutter.scattered(
        rng, int(rng.integers(0, 6)), 0.2, (-side, side, -side, side), corridors
    )
