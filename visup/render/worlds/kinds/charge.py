"""`charge`: a vehicle drives to a charger and stays at it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    random_view,
    stage_spans,
    truncated,
)
from visup.render.worlds.motion import (
    eased,
    frame_at,
    frame_times,
    make_poses,
    path_positions,
    quadratic_bezier,
    trapezoidal_profile,
)
from visup.render.worlds.viewpoint import first_in_view, sees_all
from visup.render.worlds.world import (
    FPS,
    SIZE,
    Contact,
    Motion,
    Poses,
    RigidBody,
    StageSpan,
    Surface,
    TaskTruth,
    Viewpoint,
    World,
)

OUTCOMES = ("ok", "miss", "ram", "leave", "retry", "short", "in_progress")
VEHICLE, CHARGER, BYSTANDER, DECOY = 2, 3, 7, 6
Doubles = NDArray[np.float64]

TASK = """\
# charge.task: the vehicle drives to the charger and stays at it.
<charge>   ::= <approach> <docked>
<approach> ::= converging(vehicle, charger)
<docked>   ::= touching(vehicle, charger) for {hold} s
"""

STRICT_TASK = (
    TASK.replace("charge.task", "charge_strict.task").replace("at it.", "at it without moving it.")
    + "never moving(charger)\n"
)

RETRY_TASK = """\
# charge_retry.task: as charge.task, but the vehicle may back off and try again.
<charge_with_retry> ::= <approach> (<docked> | <back_off> <charge_with_retry>)
<approach> ::= converging(vehicle, charger)
<docked>   ::= touching(vehicle, charger) for {hold} s
<back_off> ::= diverging(vehicle, charger)
"""


@dataclass(frozen=True, slots=True, eq=False)
class ChargeLayout:
    """Positions of the charger and of the vehicle, metres.

    Attributes:
        charger: (x, y).
        ahead: (2,) unit, the heading in which the vehicle docks.
        start: (x, y) of the vehicle's centre at the start.
        dock: (x, y) of its centre when it touches the charger.
        length: Length of the vehicle.
    """

    charger: Doubles
    ahead: Doubles
    start: Doubles
    dock: Doubles
    length: float


@dataclass(frozen=True, slots=True, eq=False)
class VehiclePath:
    """The vehicle's path: (F, 2) positions, (F,) headings, and the times of events, seconds.

    `near` is when it is at the charger (or nearest to it), `off` when it backs off, `again` when it starts
    another attempt; the last two are past the end if they do not happen.
    """

    at: Doubles
    heading: Doubles
    near: float
    off: float
    again: float
    docked: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a vehicle is to charge; `outcome` is one of `OUTCOMES`."""
    colour = pick_colour(rng, bool(rng.random() < 0.7))
    solid, length = machines.vehicle(rng, colour)
    post, front = machines.charger(rng, distinct_colour(rng, [colour]))
    hold = int(rng.choice([2, 3]))
    begin, duration = float(rng.uniform(0.4, 1.5)), float(rng.uniform(12.0, 14.8))
    frames = frames_until(duration)
    layout, view = _layout(rng, length, front, frames)
    drive = _drive(rng, layout, outcome, begin, frames)
    seen = _in_view(view, drive, frames)
    truth = _truth(outcome, drive, max(begin, seen), duration, hold)
    if outcome == "in_progress":
        end = float(rng.uniform(0.55, 0.85)) * (drive.near - seen) + seen
        truth, frames = truncated(truth, end), frames_until(end)
    surface = Surface("grain", 0.3, float(rng.uniform(0.05, 0.2)), random_seed(rng))
    posts = _post_poses(layout, drive, outcome)
    bodies = [
        RigidBody(
            "vehicle",
            solid,
            make_poses(np.column_stack([drive.at, np.zeros(len(drive.at))]), drive.heading),
            VEHICLE,
            surface,
        ),
        RigidBody("charger", post, posts, CHARGER, surface),
        *_surroundings(rng, layout, post, frames),
    ]
    name, text = _task(rng, outcome)
    script = Script(
        bodies, view, (name, text.format(hold=hold)), ("vehicle", "charger"), truth, frames
    )
    return complete_world(rng, "charge", script)


def _task(rng: np.random.Generator, outcome: str) -> tuple[str, str]:
    if outcome == "ram":
        return "charge_strict", STRICT_TASK
    if outcome == "retry" or (outcome == "ok" and rng.random() < 0.25):
        return "charge_retry", RETRY_TASK
    return "charge", TASK


def _layout(
    rng: np.random.Generator, length: float, front: float, frames: int
) -> tuple[ChargeLayout, Viewpoint]:
    """Positions with the charger in view; the vehicle may start out of view."""
    for _ in range(2000):
        side = rng.choice([-1.0, 1.0])
        charger = np.array([side * rng.uniform(0.7, 1.7), rng.uniform(-0.7, 1.0)])
        angle = rng.uniform(-0.5, 0.5) + (0 if side > 0 else np.pi)
        ahead = np.array([np.cos(angle), np.sin(angle)])
        dock = charger - (front + length / 2) * ahead
        start = np.array([-side * rng.uniform(1.3, 4.2), rng.uniform(-1.2, 1.2)])
        view = _view(rng, frames)
        points = [[*charger, 0], [*charger, 1.2], [*dock, 0], [*(charger + ahead), 0]]
        if sees_all(view, points, SIZE, 0.08):
            return ChargeLayout(charger, ahead, start, dock, length), view
    return ChargeLayout(charger, ahead, start, dock, length), view


def _view(rng: np.random.Generator, frames: int) -> Viewpoint:
    side, elevation = rng.uniform(-0.6, 0.6), np.radians(rng.uniform(18, 50))
    distance = float(rng.uniform(4.5, 6.2))
    aim = np.array([0.0, 0.0, 0.4])
    return random_view(rng, aim + distance * direction_from_angles(side, elevation), aim, frames)


def _drive(
    rng: np.random.Generator, layout: ChargeLayout, outcome: str, begin: float, frames: int
) -> VehiclePath:
    """The path and its times."""
    t = frame_times(frames)
    near = begin + float(rng.uniform(4.0, 6.0))
    never = t[-1] + 1
    if outcome == "retry":
        return _retry(rng, layout, begin, t)
    if outcome == "miss":
        return _pass_by(rng, layout, begin, t)
    goal = layout.dock
    if outcome == "short":
        goal = layout.dock - rng.uniform(0.55, 0.9) * layout.ahead
    path = _approach_path(layout, goal)
    ramp = 0.2
    share = trapezoidal_profile(t, begin, near, ramp)
    at, heading = path_positions(path, share)
    if outcome == "ram":
        push = eased(t, [(near - 0.25, 0.0), (near + 0.75, float(rng.uniform(0.35, 0.7)))])
        at, heading = path_positions(path, np.clip((t - begin) / (near - begin), 0, 1))
        past = np.where(t > near, push - push[min(frame_at(near), len(t) - 1)], 0)
        at = at + np.clip(past, 0, None)[:, None] * layout.ahead
    off = never
    if outcome == "leave":
        off = near + float(rng.uniform(0.7, 1.1))
        back = eased(t, [(off, 0.0), (off + 2.5, float(rng.uniform(1.0, 1.6)))])
        at = at - back[:, None] * layout.ahead
    return VehiclePath(at, heading, near, off, never, near if outcome not in ("short",) else never)


def _retry(rng: np.random.Generator, layout: ChargeLayout, begin: float, t: Doubles) -> VehiclePath:
    """The vehicle misses the charger, backs off, tries again and docks."""
    first = begin + float(rng.uniform(2.6, 3.4))
    off = first + float(rng.uniform(0.4, 0.7))
    again = off + float(rng.uniform(1.8, 2.3))
    docked = again + float(rng.uniform(2.2, 2.8))
    path = _approach_path(layout, layout.dock - rng.uniform(0.3, 0.5) * layout.ahead)
    at, heading = path_positions(path, trapezoidal_profile(t, begin, first))
    # Back along its path, then to the dock itself.
    back = float(rng.uniform(0.9, 1.3))
    shift = eased(t, [(off, 0.0), (again, -back)])
    at = at + shift[:, None] * layout.ahead
    rest = eased(t, [(again + 0.3, 0.0), (docked, 1.0)])[:, None]
    at = at + rest * (layout.dock - at[min(frame_at(again) + 2, len(t) - 1)])
    return VehiclePath(at, heading, first, off, again + 0.3, docked)


def _pass_by(
    rng: np.random.Generator, layout: ChargeLayout, begin: float, t: Doubles
) -> VehiclePath:
    """The vehicle drives past the charger, in front of or behind it."""
    across = np.array([-layout.ahead[1], layout.ahead[0]])
    if across[1] > 0:
        across = -across
    # Mostly on the viewer's side, where the charger is not hidden for long.
    side = across if rng.random() < 0.7 else -across
    beside = layout.charger + rng.uniform(0.75, 1.1) * side
    beyond = beside + rng.uniform(1.2, 3.0) * layout.ahead
    path = np.concatenate(
        [quadratic_bezier(layout.start, beside - 1.5 * layout.ahead, beside), [beyond]]
    )
    end = begin + float(rng.uniform(5.5, 7.5))
    at, heading = path_positions(path, trapezoidal_profile(t, begin, end, 0.12))
    gap = np.linalg.norm(at - layout.charger, axis=1)
    nearest = float(t[int(gap.argmin())])
    never = t[-1] + 1
    return VehiclePath(at, heading, nearest, never, never, never)


def _approach_path(layout: ChargeLayout, goal: Doubles) -> Doubles:
    """A curve that ends in a straight line, so that the nose meets the charger squarely."""
    straight = goal - 0.7 * layout.ahead
    curve = quadratic_bezier(layout.start, straight - 1.0 * layout.ahead, straight)
    return np.concatenate([curve, [goal]])


def _in_view(view: Viewpoint, drive: VehiclePath, frames: int) -> float:
    """When the centre of the vehicle is first in view, seconds."""
    first = first_in_view(view, np.column_stack([drive.at, np.full(len(drive.at), 0.2)]), SIZE)
    return (frames if first is None else first) / FPS


def _post_poses(layout: ChargeLayout, drive: VehiclePath, outcome: str) -> Poses:
    """The charger, which faces the vehicle; it is pushed back if rammed."""
    yaw = float(np.arctan2(-layout.ahead[1], -layout.ahead[0]))
    if outcome != "ram":
        return make_poses([*layout.charger, 0.0], yaw)
    past = np.clip((drive.at - layout.dock) @ layout.ahead, 0, None)
    at = layout.charger + past[:, None] * layout.ahead
    tip = np.clip(past / 0.5, 0, 1) * 0.12
    return make_poses(np.column_stack([at, np.zeros(len(at))]), yaw, -tip)


def _truth(outcome: str, drive: VehiclePath, begin: float, end: float, hold: int) -> TaskTruth:
    """Ground truth."""
    touch = (Contact("vehicle", "charger", drive.docked, min(drive.off, end)),)
    stages: tuple[StageSpan, ...] = stage_spans(("approach", begin, drive.near))
    moves: tuple[Motion, ...] = (Motion("vehicle", begin, drive.near),)
    docked = ("docked", drive.near, min(drive.near + hold, end))
    if outcome in ("ok", "in_progress"):
        return TaskTruth(outcome, "succeeded", (*stages, *stage_spans(docked)), (), touch, moves)
    if outcome == "retry":
        stages += stage_spans(
            ("back_off", drive.off, drive.again),
            ("approach", drive.again, drive.docked),
            ("docked", drive.docked, min(drive.docked + hold, end)),
        )
        touch = (Contact("vehicle", "charger", drive.docked, end),)
        return TaskTruth(outcome, "succeeded", stages, (), touch, moves)
    if outcome == "short":
        stages = stage_spans(("approach", begin, end, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), (), moves)
    stages += stage_spans((*docked, "failing"))
    if outcome == "ram":
        moves += (Motion("charger", drive.near, drive.near + 0.7),)
        alerts = {"never moving": drive.near + 0.3}
        return TaskTruth(outcome, "failed", stages, ("failed", "interrupted"), touch, moves, alerts)
    return TaskTruth(outcome, "failed", stages, (), touch if outcome == "leave" else (), moves)


def _surroundings(
    rng: np.random.Generator, layout: ChargeLayout, post: object, frames: int
) -> list[RigidBody]:
    indoors = rng.random() < 0.6
    found = list(hall(rng, float(rng.uniform(2.6, 5.0))) if indoors else meadow(rng))
    occupied = clutter.free_corridor(layout.start, layout.dock, 1.6)
    occupied += clutter.free_corridor(
        layout.charger - 2 * layout.ahead, layout.charger + 3 * layout.ahead, 2.6
    )
    found += clutter.scattered(rng, int(rng.integers(0, 5)), 0.2, (-3.5, 3.5, -2.5, 2.2), occupied)
    if rng.random() < 0.2:
        y = float(rng.uniform(1.7, 2.3))
        side = float(rng.choice([-1, 1]))
        found += clutter.passer_by(rng, frames, (-4.5 * side, y), (4.5 * side, y), BYSTANDER)
    return found
