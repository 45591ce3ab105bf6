"""`pick`: a robot arm takes a part from a table and puts it on a tray or into a bin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.render.meshes.solids import Colour, Solid, box, join, lathe
from visup.render.worlds.assets import clutter
from visup.render.worlds.assets.robot import (
    RobotDesign,
    TipTrajectory,
    hand_poses,
    random_robot,
    robot_bodies,
)
from visup.render.worlds.assets.scenery import (
    distinct_colour,
    pick_colour,
    random_seed,
    tabletop,
)
from visup.render.worlds.kinds import pick_tasks
from visup.render.worlds.kinds.kind import (
    Script,
    complete_world,
    direction_from_angles,
    frames_until,
    random_view,
    truncated,
)
from visup.render.worlds.motion import (
    carried,
    dropped,
    eased,
    frame_at,
    frame_times,
    make_poses,
    static_pose,
)
from visup.render.worlds.viewpoint import sees_all
from visup.render.worlds.world import SIZE, Poses, RigidBody, Surface, Viewpoint, World

OUTCOMES = ("ok", "drop", "never", "miss", "wrong_place", "retry", "in_progress")
GRIPPER, PART, FIXTURE, ARM, DECOY = 2, 3, 4, 5, 6
AMBIGUOUS_OUTCOMES = ("never", "miss")
"""Outcomes for which a supervisor without a time limit may also report a task in progress."""

Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PickLayout:
    """Positions on the table, metres.

    Attributes:
        robot: The arm.
        part: (x, y) of the part at the start.
        target: (x, y) of the centre of the fixture.
        astray: (x, y) beside the fixture, for a part put in the wrong place.
        half_width: Half the part's width.
        part_height: The part's height.
        floor_height: Height of the fixture's floor.
        home: (x, y, z) rest position of the tip.
    """

    robot: RobotDesign
    part: Doubles
    target: Doubles
    astray: Doubles
    half_width: float
    part_height: float
    floor_height: float
    home: Doubles


@dataclass(frozen=True, slots=True)
class PickTimes:
    """Times of events, seconds; past the end for those that do not happen.

    `slip` and `again` belong to a failed first attempt; the others follow each other.
    """

    begin: float
    arrive: float
    slip: float
    again: float
    grasp: float
    lift: float
    carry: float
    place: float
    release: float
    leave: float
    end: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a part is picked, or is not; `outcome` is one of `OUTCOMES`."""
    robot, half_width = _robot(rng), float(rng.uniform(0.034, 0.05))
    part_colour = pick_colour(rng)
    part, part_height = clutter.random_part(rng, half_width, part_colour)
    fixture, floor_height = _fixture(
        rng, half_width, distinct_colour(rng, [part_colour, robot.colour])
    )
    times = random_times(rng, outcome)
    frames = frames_until(times.end)
    layout, view = _layout(rng, robot, (half_width, part_height, floor_height), frames)
    trajectory = tip_trajectory(rng, layout, times, outcome, frames)
    hand = hand_poses(robot, trajectory)
    poses, drop_s = part_poses(rng, layout, times, hand, outcome)
    whole = bool(rng.random() < 0.6)
    surface = Surface("grain", 0.05, float(rng.uniform(0.02, 0.2)), random_seed(rng))
    bodies = [
        *robot_bodies(robot, trajectory, "gripper", GRIPPER, GRIPPER if whole else ARM),
        RigidBody("part", part, poses, PART, surface),
        RigidBody("fixture", fixture, static_pose(*layout.target), FIXTURE, surface),
        *_surroundings(rng, layout, part, surface),
    ]
    truth, name, text = pick_tasks.truth_and_task(rng, times, outcome, drop_s)
    if outcome == "in_progress":
        end = float(rng.uniform(times.lift + 0.8, times.place - 0.4))
        truth, frames = truncated(truth, end), frames_until(end)
    script = Script(bodies, view, (name, text), ("gripper", "part", "fixture"), truth, frames)
    return complete_world(rng, "pick", script)


def random_times(rng: np.random.Generator, outcome: str) -> PickTimes:
    """Times of the events."""
    begin = float(rng.uniform(0.4, 1.4))
    arrive = begin + float(rng.uniform(2.0, 3.2))
    slip = again = arrive
    if outcome == "retry":
        slip = arrive + float(rng.uniform(0.5, 0.8))
        again = slip + float(rng.uniform(1.0, 1.4))
        arrive_again = again + float(rng.uniform(1.0, 1.4))
    else:
        arrive_again = arrive
    grasp = arrive_again + float(rng.uniform(0.25, 0.5))
    lift = grasp + float(rng.uniform(0.4, 0.9))
    carry = lift + float(rng.uniform(0.6, 0.9))
    place = carry + float(rng.uniform(1.9, 3.0))
    release = place + float(rng.uniform(0.4, 0.7))
    leave = release + float(rng.uniform(0.2, 0.4))
    end = leave + float(rng.uniform(2.2, 3.0))
    return PickTimes(begin, arrive, slip, again, grasp, lift, carry, place, release, leave, end)


def tip_trajectory(
    rng: np.random.Generator, layout: PickLayout, times: PickTimes, outcome: str, frames: int
) -> TipTrajectory:
    """The trajectory of the arm."""
    grip = 0.45 * layout.part_height
    aside = layout.part.copy()
    if outcome == "miss":
        angle = rng.uniform(0, 2 * np.pi)
        direction = np.array([np.cos(angle), np.sin(angle)])
        aside += layout.half_width * rng.uniform(3.0, 4.0) * direction
    goal = layout.astray if outcome == "wrong_place" else layout.target
    low = grip if outcome == "wrong_place" else grip + layout.floor_height
    t = times
    above = 0.14 + layout.part_height
    keys = [
        (t.begin, layout.home),
        (t.begin + 0.65 * (t.arrive - t.begin), [*aside, above]),
        (t.arrive, [*aside, grip]),
    ]
    if outcome == "retry":
        keys += [
            (t.slip, [*aside, grip]),
            (t.again, [*aside, above]),
            (t.grasp - 0.3, [*aside, grip]),
        ]
    keys += [
        (t.lift, [*aside, grip]),
        (t.carry, [*aside, above]),
        (t.carry + 0.7 * (t.place - t.carry), [*goal, above + 0.02]),
        (t.place, [*goal, low]),
        (t.leave, [*goal, low]),
        (t.leave + 0.7, [*goal, above]),
        (t.end, layout.home),
    ]
    at = frame_times(frames)
    opening = _opening(layout, times, outcome, frames)
    roll = np.full(frames, rng.uniform(-0.5, 0.5))
    return TipTrajectory(eased(at, keys), opening, roll, np.zeros(frames))


def part_poses(
    rng: np.random.Generator, layout: PickLayout, times: PickTimes, hand: Poses, outcome: str
) -> tuple[Poses, float]:
    """(F, 4, 4) of the part, and when it is dropped (past the end if it is not), seconds."""
    rest = make_poses([*layout.part, 0.0], float(rng.uniform(0, 6.3)))[0]
    frames = len(hand)
    if outcome in AMBIGUOUS_OUTCOMES:
        return np.tile(rest, (frames, 1, 1)), times.end
    poses = carried(rest, hand, frame_at(times.lift), frame_at(times.release))
    # The hand rotates as the arm swings; a part set down is upright nevertheless.
    if outcome != "drop":
        return poses, times.end
    since = times.carry + float(rng.uniform(0.08, 0.2)) * (times.place - times.carry)
    held = carried(rest, hand, frame_at(times.lift), frames)
    tumble = rng.uniform(-0.6, 0.6, 3) * [0.15, 0.15, 1]
    return dropped(held, frame_at(since), 0.0, tumble)[0], since


def _opening(layout: PickLayout, times: PickTimes, outcome: str, frames: int) -> Doubles:
    """(F,) distance between the fingers, metres."""
    open_width, grasp_width = 2 * layout.half_width + 0.05, 2 * layout.half_width
    keys: list[tuple[float, float]] = []
    if outcome == "retry":
        keys = [
            (times.arrive, open_width),
            (times.slip, grasp_width),
            (times.slip + 0.3, open_width),
        ]
        keys += [(times.grasp - 0.3, open_width)]
    else:
        keys = [(times.arrive, open_width)]
    closed_width = (
        open_width - 0.02 if outcome == "never" else grasp_width if outcome != "miss" else 0.02
    )
    keys += [
        (times.grasp, closed_width),
        (times.release - 0.05, closed_width),
        (times.leave, open_width),
    ]
    return eased(frame_times(frames), keys)


def _robot(rng: np.random.Generator) -> RobotDesign:
    side = rng.choice(["back", "left", "right"], p=[0.5, 0.25, 0.25])
    foot = {"back": (0.0, 0.36), "left": (-0.52, 0.12), "right": (0.52, 0.12)}[str(side)]
    shift = rng.uniform(-0.06, 0.06, 2)
    return random_robot(rng, (foot[0] + float(shift[0]), foot[1] + float(shift[1])), 0.78)


def _fixture(rng: np.random.Generator, half_width: float, colour: Colour) -> tuple[Solid, float]:
    """A tray, bin, plate or block, and the height of its floor."""
    if rng.random() < 0.35:
        colour = pick_colour(rng, vivid=False)
    width, depth = (
        half_width * float(rng.uniform(4.2, 5.5)),
        half_width * float(rng.uniform(4.0, 5.0)),
    )
    style = rng.integers(4)
    if style == 0:
        return _open_box(width, depth, half_width * 0.6, colour), 0.008
    if style == 1:
        return _open_box(width, depth, half_width * 1.3, colour), 0.008
    if style == 2:
        r = width / 2
        plate = [(0, 0), (0.7 * r, 0), (r, 0.02), (0.97 * r, 0.026), (0.68 * r, 0.008), (0, 0.008)]
        return lathe(plate, colour, 32), 0.008
    height = half_width * float(rng.uniform(0.4, 0.9))
    return join(box((width * 0.8, depth * 0.8, height), (0, 0, height / 2), colour)), height


def _open_box(width: float, depth: float, height: float, colour: Colour) -> Solid:
    """A box without a lid, standing at z = 0."""
    thickness = 0.008
    return join(
        box((width, depth, thickness), (0, 0, thickness / 2), colour),
        box((thickness, depth, height), (width / 2, 0, height / 2), colour),
        box((thickness, depth, height), (-width / 2, 0, height / 2), colour),
        box((width, thickness, height), (0, depth / 2, height / 2), colour),
        box((width, thickness, height), (0, -depth / 2, height / 2), colour),
    )


def _layout(
    rng: np.random.Generator, robot: RobotDesign, sizes: tuple[float, float, float], frames: int
) -> tuple[PickLayout, Viewpoint]:
    """Positions within reach of the arm and in view, far enough from each other."""
    half_width, part_height, floor_height = sizes
    for _ in range(2000):
        part, target, astray = (rng.uniform([-0.4, -0.3], [0.4, 0.2]) for _ in range(3))
        distances = [
            np.linalg.norm(part - target),
            np.linalg.norm(part - astray),
            np.linalg.norm(target - astray),
        ]
        reach = [np.linalg.norm(np.subtract(p, robot.base)) for p in (part, target, astray)]
        if min(distances) < 0.2 + half_width or distances[0] < 0.3 or distances[2] > 0.42:
            continue
        if min(reach) < 0.26 or max(reach) > 0.62:
            continue
        view = _view(rng, frames)
        home = np.array(
            [
                *(np.asarray(robot.base) + 0.6 * (np.array([0.0, -0.1]) - robot.base)),
                float(rng.uniform(0.3, 0.4)),
            ]
        )
        points = np.array([[*p, z] for p in (part, target, astray) for z in (0, 0.15)])
        if sees_all(view, points, SIZE, 0.12):
            return PickLayout(
                robot, part, target, astray, half_width, part_height, floor_height, home
            ), view
    raise SettingsError("no layout of the table was found", expected="a smaller arm or part")


def _view(rng: np.random.Generator, frames: int) -> Viewpoint:
    side, elevation = rng.uniform(-0.9, 0.9), np.radians(rng.uniform(28, 62))
    distance = float(rng.uniform(1.25, 1.6))
    aim = np.array([0.0, 0.0, 0.08])
    return random_view(rng, aim + distance * direction_from_angles(side, elevation), aim, frames)


def _surroundings(
    rng: np.random.Generator, layout: PickLayout, part: Solid, surface: Surface
) -> list[RigidBody]:
    """The table, clutter, and sometimes a part that looks like the right one."""
    corridors = clutter.free_corridor(layout.part, layout.target, 0.26)
    corridors += clutter.free_corridor(layout.target, layout.astray, 0.26)
    occupied = [*corridors, (*layout.robot.base, 0.2), (*layout.part, 0.2), (*layout.target, 0.2)]
    found = list(tabletop(rng, float(rng.uniform(1.5, 2.2)), 1.15))
    if rng.random() < 0.35:
        for _ in range(60):
            x, y = rng.uniform([-0.45, -0.3], [0.45, 0.3])
            if all(np.hypot(x - a, y - b) > r + layout.half_width for a, b, r in occupied):
                decoy = RigidBody(
                    "decoy", part, static_pose(x, y, 0, rng.uniform(0, 6.3)), DECOY, surface
                )
                found.append(decoy)
                occupied.append((x, y, 2 * layout.half_width))
                break
    count = int(rng.integers(0, 7))
    return found + clutter.scattered(rng, count, 0.03, (-0.7, 0.7, -0.45, 0.5), occupied)
