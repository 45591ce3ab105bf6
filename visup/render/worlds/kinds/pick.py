"""`pick`: a robot arm takes a part from a table and puts it on a tray or into a bin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.render.meshes.solids import Colour, Solid, box, join, lathe
from visup.render.worlds.kinds import pick_tasks
from visup.render.worlds.kinds.kind import (
    Script,
    bearing,
    cut_short,
    finished,
    frames_until,
    random_view,
)
from visup.render.worlds.motion import carried, clock, dropped, eased, frame_at, posed, still
from visup.render.worlds.things import clutter
from visup.render.worlds.things.robot import (
    RobotCourse,
    RobotDesign,
    hand_poses,
    random_robot,
    robot_things,
)
from visup.render.worlds.things.scenery import (
    pick_colour,
    seed_of,
    tabletop,
    unlike,
)
from visup.render.worlds.viewpoint import shows
from visup.render.worlds.world import SIZE, Poses, Surface, Thing, Viewpoint, World

OUTCOMES = ("ok", "drop", "never", "miss", "wrong_place", "retry", "in_progress")
GRIPPER, PART, FIXTURE, ARM, DECOY = 2, 3, 4, 5, 6
DOUBTFUL = ("never", "miss")
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
        half: Half the part's width.
        tall: The part's height.
        bottom: Height of the fixture's floor.
        home: (x, y, z) rest position of the tip.
    """

    robot: RobotDesign
    part: Doubles
    target: Doubles
    astray: Doubles
    half: float
    tall: float
    bottom: float
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
    close: float
    lift: float
    carry: float
    place: float
    release: float
    leave: float
    end: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a part is picked, or is not; `outcome` is one of `OUTCOMES`."""
    robot, half = _robot(rng), float(rng.uniform(0.034, 0.05))
    part_colour = pick_colour(rng)
    part, tall = clutter.random_part(rng, half, part_colour)
    fixture, bottom = _fixture(rng, half, unlike(rng, [part_colour, robot.colour]))
    times = random_times(rng, outcome)
    frames = frames_until(times.end)
    layout, view = _layout(rng, robot, (half, tall, bottom), frames)
    course = tip_course(rng, layout, times, outcome, frames)
    hand = hand_poses(robot, course)
    poses, drop_s = part_poses(rng, layout, times, hand, outcome)
    whole = bool(rng.random() < 0.6)
    surface = Surface("grain", 0.05, float(rng.uniform(0.02, 0.2)), seed_of(rng))
    things = [
        *robot_things(robot, course, "gripper", GRIPPER, GRIPPER if whole else ARM),
        Thing("part", part, poses, PART, surface),
        Thing("fixture", fixture, still(*layout.target), FIXTURE, surface),
        *_surroundings(rng, layout, part, surface),
    ]
    truth, name, text = pick_tasks.course_and_task(rng, times, outcome, drop_s)
    if outcome == "in_progress":
        end = float(rng.uniform(times.lift + 0.8, times.place - 0.4))
        truth, frames = cut_short(truth, end), frames_until(end)
    script = Script(things, view, (name, text), ("gripper", "part", "fixture"), truth, frames)
    return finished(rng, "pick", script)


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
    close = arrive_again + float(rng.uniform(0.25, 0.5))
    lift = close + float(rng.uniform(0.4, 0.9))
    carry = lift + float(rng.uniform(0.6, 0.9))
    place = carry + float(rng.uniform(1.9, 3.0))
    release = place + float(rng.uniform(0.4, 0.7))
    leave = release + float(rng.uniform(0.2, 0.4))
    end = leave + float(rng.uniform(2.2, 3.0))
    return PickTimes(begin, arrive, slip, again, close, lift, carry, place, release, leave, end)


def tip_course(
    rng: np.random.Generator, layout: PickLayout, times: PickTimes, outcome: str, frames: int
) -> RobotCourse:
    """The arm's course."""
    grip = 0.45 * layout.tall
    aside = layout.part.copy()
    if outcome == "miss":
        angle = rng.uniform(0, 2 * np.pi)
        aside += layout.half * rng.uniform(3.0, 4.0) * np.array([np.cos(angle), np.sin(angle)])
    goal = layout.astray if outcome == "wrong_place" else layout.target
    low = grip if outcome == "wrong_place" else grip + layout.bottom
    t = times
    above = 0.14 + layout.tall
    keys = [
        (t.begin, layout.home),
        (t.begin + 0.65 * (t.arrive - t.begin), [*aside, above]),
        (t.arrive, [*aside, grip]),
    ]
    if outcome == "retry":
        keys += [
            (t.slip, [*aside, grip]),
            (t.again, [*aside, above]),
            (t.close - 0.3, [*aside, grip]),
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
    at = clock(frames)
    zero = np.zeros(frames)
    return RobotCourse(
        eased(at, keys),
        _opening(layout, times, outcome, frames),
        zero + rng.uniform(-0.5, 0.5),
        zero,
    )


def part_poses(
    rng: np.random.Generator, layout: PickLayout, times: PickTimes, hand: Poses, outcome: str
) -> tuple[Poses, float]:
    """(F, 4, 4) of the part, and when it is dropped (past the end if it is not), seconds."""
    rest = posed([*layout.part, 0.0], float(rng.uniform(0, 6.3)))[0]
    frames = len(hand)
    if outcome in DOUBTFUL:
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
    wide, tight = 2 * layout.half + 0.05, 2 * layout.half
    keys: list[tuple[float, float]] = []
    if outcome == "retry":
        keys = [(times.arrive, wide), (times.slip, tight), (times.slip + 0.3, wide)]
        keys += [(times.close - 0.3, wide)]
    else:
        keys = [(times.arrive, wide)]
    shut = wide - 0.02 if outcome == "never" else tight if outcome != "miss" else 0.02
    keys += [(times.close, shut), (times.release - 0.05, shut), (times.leave, wide)]
    return eased(clock(frames), keys)


def _robot(rng: np.random.Generator) -> RobotDesign:
    side = rng.choice(["back", "left", "right"], p=[0.5, 0.25, 0.25])
    foot = {"back": (0.0, 0.36), "left": (-0.52, 0.12), "right": (0.52, 0.12)}[str(side)]
    shift = rng.uniform(-0.06, 0.06, 2)
    return random_robot(rng, (foot[0] + float(shift[0]), foot[1] + float(shift[1])), 0.78)


def _fixture(rng: np.random.Generator, half: float, colour: Colour) -> tuple[Solid, float]:
    """A tray, bin, plate or block, and the height of its floor."""
    if rng.random() < 0.35:
        colour = pick_colour(rng, vivid=False)
    wide, deep = half * float(rng.uniform(4.2, 5.5)), half * float(rng.uniform(4.0, 5.0))
    style = rng.integers(4)
    if style == 0:
        return _open_box(wide, deep, half * 0.6, colour), 0.008
    if style == 1:
        return _open_box(wide, deep, half * 1.3, colour), 0.008
    if style == 2:
        r = wide / 2
        plate = [(0, 0), (0.7 * r, 0), (r, 0.02), (0.97 * r, 0.026), (0.68 * r, 0.008), (0, 0.008)]
        return lathe(plate, colour, 32), 0.008
    high = half * float(rng.uniform(0.4, 0.9))
    return join(box((wide * 0.8, deep * 0.8, high), (0, 0, high / 2), colour)), high


def _open_box(wide: float, deep: float, high: float, colour: Colour) -> Solid:
    """A box without a lid, standing at z = 0."""
    t = 0.008
    return join(
        box((wide, deep, t), (0, 0, t / 2), colour),
        box((t, deep, high), (wide / 2, 0, high / 2), colour),
        box((t, deep, high), (-wide / 2, 0, high / 2), colour),
        box((wide, t, high), (0, deep / 2, high / 2), colour),
        box((wide, t, high), (0, -deep / 2, high / 2), colour),
    )


def _layout(
    rng: np.random.Generator, robot: RobotDesign, sizes: tuple[float, float, float], frames: int
) -> tuple[PickLayout, Viewpoint]:
    """Positions within reach of the arm and in view, far enough from each other."""
    half, tall, bottom = sizes
    for _ in range(2000):
        part, target, astray = (rng.uniform([-0.4, -0.3], [0.4, 0.2]) for _ in range(3))
        apart = [
            np.linalg.norm(part - target),
            np.linalg.norm(part - astray),
            np.linalg.norm(target - astray),
        ]
        reach = [np.linalg.norm(np.subtract(p, robot.foot)) for p in (part, target, astray)]
        if min(apart) < 0.2 + half or apart[0] < 0.3 or apart[2] > 0.42:
            continue
        if min(reach) < 0.26 or max(reach) > 0.62:
            continue
        view = _view(rng, frames)
        home = np.array(
            [
                *(np.asarray(robot.foot) + 0.6 * (np.array([0.0, -0.1]) - robot.foot)),
                float(rng.uniform(0.3, 0.4)),
            ]
        )
        points = np.array([[*p, z] for p in (part, target, astray) for z in (0, 0.15)])
        if shows(view, points, SIZE, 0.12):
            return PickLayout(robot, part, target, astray, half, tall, bottom, home), view
    raise SettingsError("no layout of the table was found", expected="a smaller arm or part")


def _view(rng: np.random.Generator, frames: int) -> Viewpoint:
    side, high = rng.uniform(-0.9, 0.9), np.radians(rng.uniform(28, 62))
    far = float(rng.uniform(1.25, 1.6))
    aim = np.array([0.0, 0.0, 0.08])
    return random_view(rng, aim + far * bearing(side, high), aim, frames)


def _surroundings(
    rng: np.random.Generator, layout: PickLayout, part: Solid, surface: Surface
) -> list[Thing]:
    """The table, clutter, and sometimes a part that looks like the right one."""
    ways = clutter.corridor(layout.part, layout.target, 0.26)
    ways += clutter.corridor(layout.target, layout.astray, 0.26)
    taken = [*ways, (*layout.robot.foot, 0.2), (*layout.part, 0.2), (*layout.target, 0.2)]
    found = list(tabletop(rng, float(rng.uniform(1.5, 2.2)), 1.15))
    if rng.random() < 0.35:
        for _ in range(60):
            x, y = rng.uniform([-0.45, -0.3], [0.45, 0.3])
            if all(np.hypot(x - a, y - b) > r + layout.half for a, b, r in taken):
                decoy = Thing("decoy", part, still(x, y, 0, rng.uniform(0, 6.3)), DECOY, surface)
                found.append(decoy)
                taken.append((x, y, 2 * layout.half))
                break
    count = int(rng.integers(0, 7))
    return found + clutter.scattered(rng, count, 0.03, (-0.7, 0.7, -0.45, 0.5), taken)
