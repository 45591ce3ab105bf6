"""`bench`: an arm puts two parts onto a base, one after the other; a part may be taken away again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.assets import clutter
from visup.render.worlds.assets.robot import (
    RobotDesign,
    TipTrajectory,
    hand_poses,
    random_robot,
    robot_bodies,
)
from visup.render.worlds.assets.scenery import distinct_colour, pick_colour, random_seed, tabletop
from visup.render.worlds.kinds.kind import (
    Script,
    complete_world,
    frames_until,
    random_camera_position,
    random_view,
    stage_spans,
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
from visup.render.worlds.world import (
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

OUTCOMES = ("ok", "wrong_order", "drop", "taken_away", "in_progress")
BLOCK, CAP, BASE, ARM = 2, 3, 4, 5
Doubles = NDArray[np.float64]

TASK = """\
# assemble.task: the block is put on the base, after it the cap, and both stay there.
<assemble>    ::= <bring_block> <block_on> <bring_cap> <cap_on>

<bring_block> ::= converging(block, base)
<block_on>    ::= touching(block, base) for 0.5 s
<bring_cap>   ::= converging(cap, base)
<cap_on>      ::= touching(cap, base) for 3 s
"""


@dataclass(frozen=True, slots=True)
class Transfer:
    """One part is taken from a place and put on another; times in seconds.

    Attributes:
        start: (x, y, z) of the part's foot at the start.
        goal: (x, y, z) of its goal.
        reach: When the hand sets out for it.
        grasp: When it is grasped.
        lift: When it is lifted.
        place: When it is placed on its goal.
        release: When the hand leaves it.
    """

    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    reach: float
    grasp: float
    lift: float
    place: float
    release: float


@dataclass(frozen=True, slots=True, eq=False)
class BenchLayout:
    """Positions on the table, (x, y) each, and the height of the base, metres."""

    block: Doubles
    cap: Doubles
    base: Doubles
    base_height: float
    half_width: float
    part_heights: tuple[float, float]


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which parts are assembled; `outcome` is one of `OUTCOMES`."""
    robot = random_robot(rng, (float(rng.uniform(-0.1, 0.1)), 0.38), 0.78)
    half_width = float(rng.uniform(0.034, 0.044))
    first, second = pick_colour(rng), pick_colour(rng)
    second = distinct_colour(rng, [first])
    block, block_height = clutter.random_part(rng, half_width, first)
    cap, cap_height = clutter.random_part(rng, half_width, second)
    base_height = float(rng.uniform(0.02, 0.05))
    frames = frames_until(14.9)
    layout, view = _layout(
        rng, robot, (half_width, base_height, (block_height, cap_height)), frames
    )
    steps = _transfers(rng, layout, outcome)
    trajectory = _tip_trajectory(rng, robot, layout, steps, frames)
    hand = hand_poses(robot, trajectory)
    parts, drop_s = _parts(rng, layout, steps, hand, outcome)
    surface = Surface("grain", 0.05, float(rng.uniform(0.02, 0.2)), random_seed(rng))
    base = _base(rng, half_width, base_height, distinct_colour(rng, [first, second]))
    bodies = [
        *robot_bodies(robot, trajectory, "arm", ARM, ARM),
        RigidBody("block", block, parts[0], BLOCK, surface),
        RigidBody("cap", cap, parts[1], CAP, surface),
        RigidBody("base", base, static_pose(*layout.base), BASE, surface),
        *_surroundings(rng, robot, layout),
    ]
    truth = _truth(outcome, steps, drop_s, frames / 15)
    if outcome == "in_progress":
        end = float(rng.uniform(steps[0].release + 0.2, steps[1].place - 0.4))
        truth, frames = truncated(truth, end), frames_until(end)
    script = Script(bodies, view, ("assemble", TASK), ("block", "cap", "base"), truth, frames)
    return complete_world(rng, "bench", script)


def _layout(
    rng: np.random.Generator,
    robot: RobotDesign,
    sizes: tuple[float, float, tuple[float, float]],
    frames: int,
) -> tuple[BenchLayout, Viewpoint]:
    """Positions within reach and in view."""
    half_width, base_height, part_heights = sizes
    for _ in range(3000):
        positions = rng.uniform([-0.42, -0.32], [0.42, 0.12], (3, 2))
        apart = [np.linalg.norm(positions[a] - positions[b]) for a, b in ((0, 1), (0, 2), (1, 2))]
        reach = np.linalg.norm(positions - robot.base, axis=1)
        if apart[0] < 0.14 or min(apart[1:]) < 0.27 or reach.min() < 0.28 or reach.max() > 0.6:
            continue
        aim = np.array([0.0, -0.05, 0.06])
        view = random_view(
            rng,
            random_camera_position(rng, aim, float(rng.uniform(1.2, 1.5)), (28, 60), 0.9),
            aim,
            frames,
        )
        if sees_all(view, [[*p, z] for p in positions for z in (0, 0.15)], SIZE, 0.12):
            return BenchLayout(
                positions[0], positions[1], positions[2], base_height, half_width, part_heights
            ), view
    raise SettingsError("no layout of the bench was found", expected="smaller parts")


def _transfers(rng: np.random.Generator, layout: BenchLayout, outcome: str) -> list[Transfer]:
    """The transfers, in order: block and cap, or the reverse, and perhaps one taken away again."""
    shift = np.array([1.25 * layout.half_width, 0.0])
    on = [
        (*(layout.base - shift), layout.base_height),
        (*(layout.base + shift), layout.base_height),
    ]
    lies = [(*layout.block, 0.0), (*layout.cap, 0.0)]
    order = (1, 0) if outcome == "wrong_order" else (0, 1)
    time, found = float(rng.uniform(0.3, 0.8)), []
    for k in order:
        found.append(_timed(rng, lies[k], on[k], time))
        time = found[-1].release + 0.25
    if outcome == "taken_away":
        found.append(_timed(rng, on[1], (*layout.cap, 0.0), found[-1].release - 0.1))
    return found


def _timed(
    rng: np.random.Generator,
    start: tuple[float, float, float],
    goal: tuple[float, float, float],
    time: float,
) -> Transfer:
    grasp = time + float(rng.uniform(1.4, 1.8))
    lift = grasp + float(rng.uniform(0.25, 0.4))
    place = lift + float(rng.uniform(1.8, 2.3))
    return Transfer(start, goal, time, grasp, lift, place, place + float(rng.uniform(0.35, 0.5)))


def _tip_trajectory(
    rng: np.random.Generator,
    robot: RobotDesign,
    layout: BenchLayout,
    steps: list[Transfer],
    frames: int,
) -> TipTrajectory:
    """The trajectory of the arm: from part to base, again, and home."""
    home = np.array([0.5 * robot.base[0], 0.1, float(rng.uniform(0.3, 0.38))])
    grip = 0.45 * min(layout.part_heights)
    grip_offset, clearance = np.array([0.0, 0.0, grip]), np.array([0.0, 0.0, 0.13])
    keys, fingers = [(steps[0].reach, home)], []
    open_width, grasp_width = 2 * layout.half_width + 0.04, 2 * layout.half_width
    for s in steps:
        low, on = np.array(s.start) + grip_offset, np.array(s.goal) + grip_offset
        middle = (s.lift + s.place) / 2
        keys += [
            (s.grasp - 0.75, low + clearance),
            (s.grasp - 0.2, low),
            (s.lift, low),
            (middle, (low + on) / 2 + clearance),
            (s.place - 0.4, on + clearance / 2),
            (s.place, on),
            (s.release, on),
            (s.release + 0.35, on + clearance),
        ]
        fingers += [
            (s.grasp - 0.2, open_width),
            (s.grasp, grasp_width),
            (s.place + 0.1, grasp_width),
            (s.release, open_width),
        ]
    # Transfers may overlap: keys after the start of the next one are left out.
    keys = [
        k for k, after in zip(keys, [*keys[1:], (np.inf, home)], strict=True) if k[0] < after[0]
    ]
    keys.append((keys[-1][0] + 1.6, home))
    at = frame_times(frames)
    roll = np.full(frames, float(rng.uniform(-0.4, 0.4)))
    return TipTrajectory(eased(at, keys), eased(at, fingers), roll, np.zeros(frames))


def _parts(
    rng: np.random.Generator,
    layout: BenchLayout,
    steps: list[Transfer],
    hand: Poses,
    outcome: str,
) -> tuple[tuple[Poses, Poses], float]:
    """Poses of block and cap, and when one is dropped (past the end if none is), seconds."""
    first, second = steps[:2]
    if outcome == "wrong_order":
        first, second = second, first
    drop_s = len(hand) / 15 + 1
    block, cap = (_moved(rng, s, hand) for s in (first, second))
    if outcome == "drop":
        drop_s = second.lift + float(rng.uniform(0.14, 0.25)) * (second.place - second.lift)
        held = carried(cap[0], hand, frame_at(second.lift), len(hand))
        cap, _ = dropped(held, frame_at(drop_s), 0.0, rng.uniform(-0.5, 0.5, 3) * [0.1, 0.1, 1])
    if outcome == "taken_away":
        since = frame_at(steps[2].lift)
        away = carried(cap[since], hand, since, frame_at(steps[2].place))
        away[frame_at(steps[2].place) :, 2, 3] = 0.0
        cap = np.concatenate([cap[:since], away[since:]])
    return (block, cap), drop_s


def _moved(rng: np.random.Generator, step: Transfer, hand: Poses) -> Poses:
    rest = make_poses(step.start, float(rng.uniform(0, 6.3)))[0]
    poses = carried(rest, hand, frame_at(step.lift), frame_at(step.place))
    # Released slightly above: it comes to rest on the base.
    poses[frame_at(step.place) :, 2, 3] = step.goal[2]
    return poses


def _base(rng: np.random.Generator, half_width: float, height: float, colour: Colour) -> Solid:
    """A plate or block with room for both parts side by side."""
    width, depth = half_width * 6.0, half_width * float(rng.uniform(3.0, 4.2))
    plate = box((width, depth, height), (0, 0, height / 2), colour)
    if rng.random() < 0.5:
        return plate
    knob = cone(
        (0, 0.5 * depth, 0), (0, 0.5 * depth, height * 1.3), 0.25 * half_width, None, colour
    )
    return join(plate, knob)


def _surroundings(
    rng: np.random.Generator, robot: RobotDesign, layout: BenchLayout
) -> list[RigidBody]:
    occupied = clutter.free_corridor(layout.block, layout.base, 0.22)
    occupied += clutter.free_corridor(layout.cap, layout.base, 0.22)
    occupied += [(*robot.base, 0.2), (*layout.base, 0.22)]
    found = list(tabletop(rng, float(rng.uniform(1.5, 2.2)), 1.15))
    count = int(rng.integers(0, 6))
    return found + clutter.scattered(rng, count, 0.03, (-0.7, 0.7, -0.45, 0.5), occupied)


def _truth(outcome: str, steps: list[Transfer], drop_s: float, end: float) -> TaskTruth:
    """Ground truth."""
    a, b = steps[:2]
    touch: tuple[Contact, ...]
    if outcome == "wrong_order":
        # The cap comes first: the first stage requires something else.
        stages = stage_spans(("bring_block", a.lift, a.place, "failing"))
        touch = (Contact("cap", "base", a.place, end), Contact("block", "base", b.place, end))
        moves = (Motion("cap", a.lift, a.place), Motion("block", b.lift, b.place))
        return TaskTruth(outcome, "failed", stages, (), touch, moves)
    moves = (Motion("block", a.lift, a.place), Motion("cap", b.lift, min(b.place, drop_s + 0.4)))
    touch = (Contact("block", "base", a.place, end),)
    stages = stage_spans(("bring_block", a.lift, a.place), ("block_on", a.place, b.lift))
    if outcome == "drop":
        stages += stage_spans(("bring_cap", b.lift, drop_s, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), touch, moves)
    stages += stage_spans(("bring_cap", b.lift, b.place))
    if outcome == "taken_away":
        away = steps[2].lift
        stages += stage_spans(("cap_on", b.place, away, "failing"))
        touch += (Contact("cap", "base", b.place, away),)
        return TaskTruth(
            outcome, "failed", stages, (), touch, (*moves, Motion("cap", away, steps[2].place))
        )
    touch += (Contact("cap", "base", b.place, end),)
    return TaskTruth(
        outcome, "succeeded", (*stages, *stage_spans(("cap_on", b.place, end))), (), touch, moves
    )
