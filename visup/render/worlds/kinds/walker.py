"""`walker`: a person or a legged robot walks to a mark on the floor and avoids a danger area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.render.meshes.solids import Colour, Solid, ball, box, cone, join
from visup.render.worlds.assets import clutter
from visup.render.worlds.assets.machines import BLACK, STEEL
from visup.render.worlds.assets.scenery import floor, hall, pick_colour, random_seed
from visup.render.worlds.kinds.kind import (
    Script,
    complete_world,
    frames_until,
    random_camera_position,
    stage_spans,
    truncated,
)
from visup.render.worlds.motion import (
    eased,
    frame_times,
    make_poses,
    path_positions,
    quadratic_bezier,
    static_pose,
    trapezoidal_profile,
)
from visup.render.worlds.viewpoint import fixed_camera, project, sees_all
from visup.render.worlds.world import (
    FPS,
    SIZE,
    Motion,
    RigidBody,
    Surface,
    TaskTruth,
    Viewpoint,
    World,
)

OUTCOMES = ("ok", "crosses", "turns_back", "in_progress")
WALKER, BYSTANDER = 2, 7
HOLD_S = 1
FLOOR_OFFSET = 5.0
"""Distance from the origin of floor coordinates to the centre of the scene along both axes, metres."""

Doubles = NDArray[np.float64]

TASK = """\
# visit.task: somebody walks to the mark and stays there, and never sets foot on the danger area.
ground is {ground}
zone mark   is {mark}
zone danger is {danger}

<visit>  ::= <walk> <arrive>
<walk>   ::= moving(walker) ends when inside(walker, mark)
<arrive> ::= inside(walker, mark) for {hold} s

never inside(walker, danger)
"""


@dataclass(frozen=True, slots=True, eq=False)
class WalkLayout:
    """Positions on the floor, metres.

    Attributes:
        start: (x, y) of the start.
        mark: (x, y) of the centre of the mark.
        danger: (x, y) of the centre of the danger area.
        half: Half the side of the mark.
        danger_half: Half the side of the danger area.
    """

    start: Doubles
    mark: Doubles
    danger: Doubles
    half: float
    danger_half: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which somebody walks; `outcome` is one of `OUTCOMES`."""
    begin, duration = float(rng.uniform(0.4, 1.2)), float(rng.uniform(10.5, 13.5))
    frames = frames_until(duration)
    layout, view = _layout(rng, frames)
    positions, heading, arrive = _walk(rng, layout, outcome, begin, frames)
    if rng.random() < 0.65:
        walker = clutter.walking_person(rng, positions, heading, "walker", WALKER)
    else:
        walker = _robot_dog(rng, positions, heading)
    truth, end = _truth(layout, positions, outcome, (begin, arrive, duration))
    if outcome == "in_progress":
        truth, frames = truncated(truth, end), frames_until(end)
    text = TASK.format(
        ground=_ground(view, layout),
        mark=_zone(layout.mark, layout.half),
        danger=_zone(layout.danger, layout.danger_half),
        hold=HOLD_S,
    )
    bodies = [*walker, *_surroundings(rng, layout, len(positions))]
    return complete_world(
        rng, "walker", Script(bodies, view, ("visit", text), ("walker",), truth, frames)
    )


def _layout(rng: np.random.Generator, frames: int) -> tuple[WalkLayout, Viewpoint]:
    """Start, mark and danger area in view, with the danger area on the straight path."""
    for _ in range(2000):
        side = float(rng.choice([-1, 1]))
        start = np.array([-side * rng.uniform(1.8, 3.0), rng.uniform(-1.4, 1.4)])
        mark = np.array([side * rng.uniform(1.4, 2.6), rng.uniform(-1.4, 1.4)])
        danger = (start + mark) / 2 + rng.uniform(-0.3, 0.3, 2)
        halves = rng.uniform([0.7, 0.5], [0.95, 0.7])
        layout = WalkLayout(start, mark, danger, float(halves[0]), float(halves[1]))
        aim = np.array([0.0, 0.0, 0.4])
        place = random_camera_position(rng, aim, float(rng.uniform(8.0, 9.5)), (38, 68))
        # The floor is measured once, so the camera is static.
        view = fixed_camera(place, aim, float(rng.uniform(38, 44)), frames)
        corners = np.concatenate(
            [_corners(mark, layout.half), _corners(danger, layout.danger_half)]
        )
        heads = np.array([[*start, 1.8], [*mark, 1.8], [*start, 0]])
        if sees_all(view, np.concatenate([corners, heads]), SIZE, 0.03):
            break
    return layout, view


def _corners(middle: Doubles, half: float) -> Doubles:
    """(4, 3) corners of a square on the floor, in order."""
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float) * half
    return np.column_stack([middle + square, np.zeros(4)])


def _zone(middle: Doubles, half: float) -> str:
    """The corners of a square on the floor as a task file writes them, in metres."""
    return " ".join(_metres(corner) for corner in _corners(middle, half))


def _metres(point: Doubles) -> str:
    """A point of the floor as a task file writes it, relative to the corner of the floor."""
    return f"({point[0] + FLOOR_OFFSET:.2f} m, {point[1] + FLOOR_OFFSET:.2f} m)"


def _ground(view: Viewpoint, layout: WalkLayout) -> str:
    """The corners of the mark and of the danger area in the image and on the floor."""
    corners = np.concatenate(
        [_corners(layout.mark, layout.half), _corners(layout.danger, layout.danger_half)]
    )
    pixels = np.rint(project(view, corners, SIZE)).astype(int)
    pairs = zip(pixels, corners, strict=True)
    return ", ".join(f"({x}, {y}) = {_metres(corner)}" for (x, y), corner in pairs)


def _walk(
    rng: np.random.Generator, layout: WalkLayout, outcome: str, begin: float, frames: int
) -> tuple[Doubles, Doubles, float]:
    """(F, 2) positions, (F,) headings, and when the goal is reached, seconds."""
    t = frame_times(frames)
    ahead = layout.mark - layout.start
    across = np.array([-ahead[1], ahead[0]]) / np.linalg.norm(ahead)
    # Twice the distance at which to pass: a quadratic curve goes halfway to its control point.
    aside = 2 * (layout.danger_half * 1.42 + rng.uniform(0.35, 0.6))
    if outcome == "crosses":
        aside = 0.0
    through = layout.danger + across * aside * float(rng.choice([-1, 1]))
    path = quadratic_bezier(layout.start, through, layout.mark)
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    arrive = begin + length / float(rng.uniform(0.85, 1.15))
    share = trapezoidal_profile(t, begin, arrive, 0.12)
    positions, heading = path_positions(path, share)
    if outcome == "turns_back":
        turn = begin + (arrive - begin) * float(rng.uniform(0.3, 0.5))
        far = float(np.interp(turn, t, share))
        back = trapezoidal_profile(t, turn + 0.6, 2 * turn + 0.6 - begin, 0.12)
        share = np.where(t < turn, share, far * (1 - back))
        positions, heading = path_positions(path, share)
        heading = heading + eased(t, [(turn, 0.0), (turn + 0.6, np.pi)])
    return positions, heading, arrive


def _robot_dog(rng: np.random.Generator, positions: Doubles, heading: Doubles) -> list[RigidBody]:
    """A robot on four legs."""
    colour: Colour = pick_colour(rng)
    surface = Surface("grain", 0.3, 0.1, random_seed(rng))
    body = join(
        box((0.9, 0.36, 0.22), (0, 0, 0.62), colour),
        box((0.2, 0.22, 0.18), (0.5, 0, 0.72), BLACK),
        ball(0.06, (0.58, 0, 0.74), STEEL, 2),
    )
    leg = join(
        cone((0, 0, 0), (0, 0, -0.5), 0.055, 0.035, BLACK), ball(0.05, (0, 0, -0.52), STEEL, 2)
    )
    steps = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    speed = np.gradient(steps) * FPS
    swing = 0.4 * np.clip(speed, 0, 1) * np.sin(2 * np.pi * steps / 0.8)
    ground = np.column_stack([positions, np.zeros(len(positions))])
    ahead = np.column_stack([np.cos(heading), np.sin(heading), np.zeros(len(heading))])
    side = np.column_stack([-ahead[:, 1], ahead[:, 0], ahead[:, 2]])
    found = [RigidBody("walker", body, make_poses(ground, heading), WALKER, surface)]
    for x, y in ((0.36, 0.2), (0.36, -0.2), (-0.36, 0.2), (-0.36, -0.2)):
        hip = ground + x * ahead + y * side + np.array([0, 0, 0.57])
        found.append(
            RigidBody(
                "walker", leg, make_poses(hip, heading, swing * np.sign(x * y)), WALKER, surface
            )
        )
    return found


def _surroundings(rng: np.random.Generator, layout: WalkLayout, frames: int) -> list[RigidBody]:
    open_air = [floor(rng, 0.0, 80.0, ("speckles", "tiles", "grain"))]
    found = list(hall(rng, float(rng.uniform(4.5, 6.5)))) if rng.random() < 0.6 else open_air
    plain = Surface("plain")
    for middle, half, colour in (
        (layout.mark, layout.half, (0.2, 0.55, 0.25)),
        (layout.danger, layout.danger_half, (0.75, 0.6, 0.1)),
    ):
        # Mostly painted on the floor as a frame.
        if rng.random() < 0.75:
            found.append(RigidBody("paint", _frame(half, colour), static_pose(*middle), 0, plain))
    if rng.random() < 0.25:
        y = float(rng.uniform(2.6, 3.6))
        found += clutter.passer_by(rng, frames, (-5.0, y), (5.0, y), BYSTANDER)
    return found


def _frame(half: float, colour: Colour) -> Solid:
    """Four painted strips, flat on the floor."""
    w = 0.08
    bars = [box((2 * half, w, 0.006), (0, y * (half - w / 2), 0.003), colour) for y in (-1, 1)]
    bars += [box((w, 2 * half, 0.006), (x * (half - w / 2), 0, 0.003), colour) for x in (-1, 1)]
    return join(*bars)


def _truth(
    layout: WalkLayout, positions: Doubles, outcome: str, times: tuple[float, float, float]
) -> tuple[TaskTruth, float]:
    """Ground truth, and where a clip would be cut short."""
    begin, arrive, end = times
    on_mark = _within(positions, layout.mark, layout.half)
    entered = float(np.argmax(on_mark)) / FPS if on_mark.any() else end
    moves = (Motion("walker", begin, arrive),)
    cut = begin + 0.7 * (entered - begin)
    if outcome == "crosses":
        crossed = float(np.argmax(_within(positions, layout.danger, layout.danger_half))) / FPS
        stages = stage_spans(("walk", begin, crossed, "unsafe"))
        return TaskTruth(
            outcome, "interrupted", stages, (), (), moves, {"never inside": crossed}
        ), cut
    if outcome == "turns_back":
        stages = stage_spans(("walk", begin, end, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), (), moves), cut
    stages = stage_spans(("walk", begin, entered), ("arrive", entered, end))
    return TaskTruth(outcome, "succeeded", stages, (), (), moves), cut


def _within(positions: Doubles, middle: Doubles, half: float) -> NDArray[np.bool_]:
    """(F,): whether the feet are in a square."""
    return np.asarray((np.abs(positions - middle) <= half).all(axis=1))
