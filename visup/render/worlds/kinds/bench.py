"""`bench`: an arm puts two parts onto a base, one after the other; a part may be taken away again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SettingsError
from visup.render.meshes.solids import Colour, Solid, box, cone, join
from visup.render.worlds.kinds.kind import (
    Script,
    cut_short,
    finished,
    frames_until,
    from_around,
    random_view,
    spans,
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
from visup.render.worlds.things.scenery import pick_colour, seed_of, tabletop, unlike
from visup.render.worlds.viewpoint import shows
from visup.render.worlds.world import (
    SIZE,
    Contact,
    Course,
    Motion,
    Poses,
    Surface,
    Thing,
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
        close: When it is grasped.
        lift: When it is lifted.
        place: When it is placed on its goal.
        loose: When the hand leaves it.
    """

    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    reach: float
    close: float
    lift: float
    place: float
    loose: float


@dataclass(frozen=True, slots=True, eq=False)
class BenchLayout:
    """Positions on the table, (x, y) each, and the height of the base, metres."""

    block: Doubles
    cap: Doubles
    base: Doubles
    high: float
    half: float
    tall: tuple[float, float]


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which parts are assembled; `outcome` is one of `OUTCOMES`."""
    robot = random_robot(rng, (float(rng.uniform(-0.1, 0.1)), 0.38), 0.78)
    half = float(rng.uniform(0.034, 0.044))
    first, second = pick_colour(rng), pick_colour(rng)
    second = unlike(rng, [first])
    block, tall = clutter.random_part(rng, half, first)
    cap, tall_cap = clutter.random_part(rng, half, second)
    high = float(rng.uniform(0.02, 0.05))
    frames = frames_until(14.9)
    layout, view = _layout(rng, robot, (half, high, (tall, tall_cap)), frames)
    steps = _transfers(rng, layout, outcome)
    course = _tip(rng, robot, layout, steps, frames)
    hand = hand_poses(robot, course)
    parts, drop_s = _parts(rng, layout, steps, hand, outcome)
    surface = Surface("grain", 0.05, float(rng.uniform(0.02, 0.2)), seed_of(rng))
    base = _base(rng, half, high, unlike(rng, [first, second]))
    things = [
        *robot_things(robot, course, "arm", ARM, ARM),
        Thing("block", block, parts[0], BLOCK, surface),
        Thing("cap", cap, parts[1], CAP, surface),
        Thing("base", base, still(*layout.base), BASE, surface),
        *_surroundings(rng, robot, layout),
    ]
    truth = _course(outcome, steps, drop_s, frames / 15)
    if outcome == "in_progress":
        end = float(rng.uniform(steps[0].loose + 0.2, steps[1].place - 0.4))
        truth, frames = cut_short(truth, end), frames_until(end)
    script = Script(things, view, ("assemble", TASK), ("block", "cap", "base"), truth, frames)
    return finished(rng, "bench", script)


def _layout(
    rng: np.random.Generator,
    robot: RobotDesign,
    sizes: tuple[float, float, tuple[float, float]],
    frames: int,
) -> tuple[BenchLayout, Viewpoint]:
    """Positions within reach and in view."""
    half, high, tall = sizes
    for _ in range(3000):
        places = rng.uniform([-0.42, -0.32], [0.42, 0.12], (3, 2))
        apart = [np.linalg.norm(places[a] - places[b]) for a, b in ((0, 1), (0, 2), (1, 2))]
        reach = np.linalg.norm(places - robot.foot, axis=1)
        if apart[0] < 0.14 or min(apart[1:]) < 0.27 or reach.min() < 0.28 or reach.max() > 0.6:
            continue
        aim = np.array([0.0, -0.05, 0.06])
        view = random_view(
            rng, from_around(rng, aim, float(rng.uniform(1.2, 1.5)), (28, 60), 0.9), aim, frames
        )
        if shows(view, [[*p, z] for p in places for z in (0, 0.15)], SIZE, 0.12):
            return BenchLayout(places[0], places[1], places[2], high, half, tall), view
    raise SettingsError("no layout of the bench was found", expected="smaller parts")


def _transfers(rng: np.random.Generator, layout: BenchLayout, outcome: str) -> list[Transfer]:
    """The transfers, in order: block and cap, or the reverse, and perhaps one taken away again."""
    shift = np.array([1.25 * layout.half, 0.0])
    on = [(*(layout.base - shift), layout.high), (*(layout.base + shift), layout.high)]
    lies = [(*layout.block, 0.0), (*layout.cap, 0.0)]
    order = (1, 0) if outcome == "wrong_order" else (0, 1)
    time, found = float(rng.uniform(0.3, 0.8)), []
    for k in order:
        found.append(_timed(rng, lies[k], on[k], time))
        time = found[-1].loose + 0.25
    if outcome == "taken_away":
        found.append(_timed(rng, on[1], (*layout.cap, 0.0), found[-1].loose - 0.1))
    return found


def _timed(
    rng: np.random.Generator,
    start: tuple[float, float, float],
    goal: tuple[float, float, float],
    time: float,
) -> Transfer:
    close = time + float(rng.uniform(1.4, 1.8))
    lift = close + float(rng.uniform(0.25, 0.4))
    place = lift + float(rng.uniform(1.8, 2.3))
    return Transfer(start, goal, time, close, lift, place, place + float(rng.uniform(0.35, 0.5)))


def _tip(
    rng: np.random.Generator,
    robot: RobotDesign,
    layout: BenchLayout,
    steps: list[Transfer],
    frames: int,
) -> RobotCourse:
    """The arm's course: from part to base, again, and home."""
    home = np.array([0.5 * robot.foot[0], 0.1, float(rng.uniform(0.3, 0.38))])
    grip = 0.45 * min(layout.tall)
    held, rise = np.array([0.0, 0.0, grip]), np.array([0.0, 0.0, 0.13])
    keys, fingers = [(steps[0].reach, home)], []
    wide, tight = 2 * layout.half + 0.04, 2 * layout.half
    for s in steps:
        low, on = np.array(s.start) + held, np.array(s.goal) + held
        middle = (s.lift + s.place) / 2
        keys += [
            (s.close - 0.75, low + rise),
            (s.close - 0.2, low),
            (s.lift, low),
            (middle, (low + on) / 2 + rise),
            (s.place - 0.4, on + rise / 2),
            (s.place, on),
            (s.loose, on),
            (s.loose + 0.35, on + rise),
        ]
        fingers += [
            (s.close - 0.2, wide),
            (s.close, tight),
            (s.place + 0.1, tight),
            (s.loose, wide),
        ]
    # Transfers may overlap: keys after the start of the next one are left out.
    keys = [
        k for k, after in zip(keys, [*keys[1:], (np.inf, home)], strict=True) if k[0] < after[0]
    ]
    keys.append((keys[-1][0] + 1.6, home))
    at = clock(frames)
    zero = np.zeros(frames)
    return RobotCourse(
        eased(at, keys), eased(at, fingers), zero + float(rng.uniform(-0.4, 0.4)), zero
    )


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
    rest = posed(step.start, float(rng.uniform(0, 6.3)))[0]
    poses = carried(rest, hand, frame_at(step.lift), frame_at(step.place))
    # Released slightly above: it comes to rest on the base.
    poses[frame_at(step.place) :, 2, 3] = step.goal[2]
    return poses


def _base(rng: np.random.Generator, half: float, high: float, colour: Colour) -> Solid:
    """A plate or block with room for both parts side by side."""
    wide, deep = half * 6.0, half * float(rng.uniform(3.0, 4.2))
    plate = box((wide, deep, high), (0, 0, high / 2), colour)
    if rng.random() < 0.5:
        return plate
    knob = cone((0, 0.5 * deep, 0), (0, 0.5 * deep, high * 1.3), 0.25 * half, None, colour)
    return join(plate, knob)


def _surroundings(rng: np.random.Generator, robot: RobotDesign, layout: BenchLayout) -> list[Thing]:
    taken = clutter.corridor(layout.block, layout.base, 0.22)
    taken += clutter.corridor(layout.cap, layout.base, 0.22)
    taken += [(*robot.foot, 0.2), (*layout.base, 0.22)]
    found = list(tabletop(rng, float(rng.uniform(1.5, 2.2)), 1.15))
    count = int(rng.integers(0, 6))
    return found + clutter.scattered(rng, count, 0.03, (-0.7, 0.7, -0.45, 0.5), taken)


def _course(outcome: str, steps: list[Transfer], drop_s: float, end: float) -> Course:
    """Ground truth."""
    a, b = steps[:2]
    touch: tuple[Contact, ...]
    if outcome == "wrong_order":
        # The cap comes first: the first stage requires something else.
        stages = spans(("bring_block", a.lift, a.place, "failing"))
        touch = (Contact("cap", "base", a.place, end), Contact("block", "base", b.place, end))
        moves = (Motion("cap", a.lift, a.place), Motion("block", b.lift, b.place))
        return Course(outcome, "failed", stages, (), touch, moves)
    moves = (Motion("block", a.lift, a.place), Motion("cap", b.lift, min(b.place, drop_s + 0.4)))
    touch = (Contact("block", "base", a.place, end),)
    stages = spans(("bring_block", a.lift, a.place), ("block_on", a.place, b.lift))
    if outcome == "drop":
        stages += spans(("bring_cap", b.lift, drop_s, "failing"))
        return Course(outcome, "failed", stages, ("failed", "in_progress"), touch, moves)
    stages += spans(("bring_cap", b.lift, b.place))
    if outcome == "taken_away":
        away = steps[2].lift
        stages += spans(("cap_on", b.place, away, "failing"))
        touch += (Contact("cap", "base", b.place, away),)
        return Course(
            outcome, "failed", stages, (), touch, (*moves, Motion("cap", away, steps[2].place))
        )
    touch += (Contact("cap", "base", b.place, end),)
    return Course(
        outcome, "succeeded", (*stages, *spans(("cap_on", b.place, end))), (), touch, moves
    )
