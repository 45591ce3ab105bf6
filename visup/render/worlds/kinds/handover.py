"""`handover`: one arm hands a bar to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
from visup.render.worlds.motion import carried, dropped, eased, frame_at, frame_times, make_poses
from visup.render.worlds.world import Contact, Motion, Poses, RigidBody, Surface, TaskTruth, World

OUTCOMES = ("ok", "drop", "never", "in_progress")
GIVER, PAYLOAD, RECEIVER, GIVER_ARM, RECEIVER_ARM = 2, 3, 4, 5, 6
HANDOVER_HEIGHT = 0.26
"""Height at which the bar changes hands, metres."""

Doubles = NDArray[np.float64]

TASK = """\
# handover.task: one arm hands a payload to another.
<handover> ::= <offer> <take> <release>

<offer>    ::= coupled(giver, payload) & converging(receiver, payload)

# Both hold it for a moment, so that it is never free.
<take>     ::= coupled(giver, payload) & coupled(receiver, payload)
<release>  ::= coupled(receiver, payload) & decoupled(giver, payload)
"""


@dataclass(frozen=True, slots=True)
class HandoverTimes:
    """When giver and receiver start, the receiver arrives, grasps, the giver releases, retreats, seconds."""

    begin: float
    offer: float
    reach: float
    take: float
    release: float
    back: float
    end: float


def build(rng: np.random.Generator, outcome: str) -> World:
    """A world in which a bar is handed over; `outcome` is one of `OUTCOMES`."""
    side = float(rng.choice([-1, 1]))
    giver = random_robot(rng, (-0.55 * side, float(rng.uniform(0.0, 0.15))), 0.74)
    receiver = random_robot(rng, (0.55 * side, float(rng.uniform(0.0, 0.15))), 0.74)
    half_length, half_thickness = float(rng.uniform(0.085, 0.12)), float(rng.uniform(0.016, 0.026))
    colour = distinct_colour(rng, [giver.colour, receiver.colour])
    times = _times(rng)
    frames = frames_until(times.end)
    meet = np.array([rng.uniform(-0.06, 0.06), rng.uniform(-0.16, 0.02), HANDOVER_HEIGHT])
    grip = np.array([side * half_length * 0.72, 0, 0])
    gives = HandoverArm.for_bar(giver, meet - grip, half_thickness)
    takes = HandoverArm.for_bar(receiver, meet + grip, half_thickness)
    first = _giver_trajectory(rng, gives, times, outcome, frames)
    second = _receiver_trajectory(rng, takes, times, outcome, frames)
    hands = hand_poses(giver, first), hand_poses(receiver, second)
    payload, drop_s = _payload_poses(rng, hands, times, outcome, meet)
    surface = Surface("grain", 0.05, float(rng.uniform(0.02, 0.2)), random_seed(rng))
    whole = bool(rng.random() < 0.6)
    aim = np.array([0.0, 0.0, 0.2])
    place = random_camera_position(rng, aim, float(rng.uniform(1.3, 1.6)), (12, 45))
    view = random_view(rng, place, aim, frames)
    bodies = [
        *robot_bodies(giver, first, "giver", GIVER, GIVER if whole else GIVER_ARM),
        *robot_bodies(receiver, second, "receiver", RECEIVER, RECEIVER if whole else RECEIVER_ARM),
        RigidBody(
            "payload", _bar(rng, half_length, half_thickness, colour), payload, PAYLOAD, surface
        ),
        *_surroundings(rng, giver, receiver),
    ]
    truth = _truth(times, outcome, drop_s)
    if outcome == "in_progress":
        end = float(rng.uniform(times.offer + 0.9, times.take - 0.2))
        truth, frames = truncated(truth, end), frames_until(end)
    script = Script(
        bodies, view, ("handover", TASK), ("giver", "payload", "receiver"), truth, frames
    )
    return complete_world(rng, "handover", script)


def _times(rng: np.random.Generator) -> HandoverTimes:
    begin = float(rng.uniform(0.3, 0.9))
    offer = begin + float(rng.uniform(0.8, 1.8))
    reach = max(offer, begin + 1.2) + float(rng.uniform(2.0, 2.8))
    take = reach + float(rng.uniform(0.3, 0.5))
    release = take + float(rng.uniform(1.3, 1.8))
    back = release + float(rng.uniform(0.3, 0.5))
    return HandoverTimes(
        begin, offer, reach, take, release, back, back + float(rng.uniform(2.6, 3.4))
    )


@dataclass(frozen=True, slots=True, eq=False)
class HandoverArm:
    """One of the two arms.

    Attributes:
        design: The arm.
        goal: (3,) position of its tip during the handover, metres.
        grasp_width: Distance of its fingers when they hold the bar, metres.
        open_width: The same when they do not.
    """

    design: RobotDesign
    goal: Doubles
    grasp_width: float
    open_width: float

    @classmethod
    def for_bar(cls, design: RobotDesign, goal: Doubles, half_thickness: float) -> HandoverArm:
        """An arm with fingers for a bar of half a thickness, metres."""
        return cls(design, goal, 2 * half_thickness, 2 * half_thickness + 0.05)

    def random_home(self, rng: np.random.Generator) -> Doubles:
        """(3,) rest position of its tip: on its own side, slightly in front of the foot."""
        x, y = self.design.base[:2]
        return np.array([0.62 * x, y - 0.12, float(rng.uniform(0.3, 0.4))])


def _giver_trajectory(
    rng: np.random.Generator, arm: HandoverArm, t: HandoverTimes, outcome: str, frames: int
) -> TipTrajectory:
    home = arm.random_home(rng)
    keys = [(t.begin, home), (t.reach - 0.3, arm.goal), (t.back, arm.goal), (t.back + 1.8, home)]
    release = t.reach - 0.05 if outcome == "drop" else t.release
    grip = [(release, arm.grasp_width), (release + 0.3, arm.open_width)]
    return _trajectory(rng, keys, grip if outcome != "never" else [(0.0, arm.grasp_width)], frames)


def _receiver_trajectory(
    rng: np.random.Generator, arm: HandoverArm, t: HandoverTimes, outcome: str, frames: int
) -> TipTrajectory:
    home, goal = arm.random_home(rng), arm.goal
    ready = goal + np.array([0.12 * np.sign(arm.design.base[0]), 0, 0])
    between = t.offer + 0.7 * (t.reach - t.offer)
    leave = t.back + 0.3 if outcome != "never" else t.take + 0.4
    keys = [(t.offer, home), (between, ready), (t.reach, goal), (leave, goal), (leave + 2.0, home)]
    closed_width = arm.open_width - 0.015 if outcome == "never" else arm.grasp_width
    return _trajectory(rng, keys, [(t.reach, arm.open_width), (t.take, closed_width)], frames)


def _trajectory(
    rng: np.random.Generator,
    keys: list[tuple[float, Doubles]],
    grip: list[tuple[float, float]],
    frames: int,
) -> TipTrajectory:
    at = frame_times(frames)
    lean = np.full(frames, float(rng.uniform(0.8, 1.2)))
    return TipTrajectory(eased(at, keys), eased(at, grip), np.full(frames, np.pi / 2), lean)


def _payload_poses(
    rng: np.random.Generator,
    hands: tuple[Poses, Poses],
    times: HandoverTimes,
    outcome: str,
    meet: Doubles,
) -> tuple[Poses, float]:
    """(F, 4, 4) of the bar, and when it is dropped (past the end if it is not), seconds.

    The bar is level during the handover; before it moves with the giver, afterwards with the receiver.
    """
    (giver, receiver), t = hands, times
    frames = len(giver)
    change = frame_at(t.reach - 0.25)
    level = make_poses(meet)[0]
    with_giver = giver @ np.linalg.inv(giver[min(change, frames - 1)]) @ level
    if outcome == "never":
        return with_giver, t.end + 1
    if outcome == "drop":
        since = frame_at(t.reach)
        fallen, _ = dropped(with_giver, since, 0.025, rng.uniform(-0.8, 0.8, 3) * [0.3, 0.3, 1])
        return fallen, t.reach
    after = carried(level, receiver, min(frame_at(t.release), frames - 1), frames)
    whole = with_giver.copy()
    whole[frame_at(t.release) :] = after[frame_at(t.release) :]
    return whole, t.end + 1


def _bar(
    rng: np.random.Generator, half_length: float, half_thickness: float, colour: Colour
) -> Solid:
    """A bar along x about its middle."""
    style = rng.integers(3)
    if style == 0:
        return box((2 * half_length, 2 * half_thickness, 2 * half_thickness), (0, 0, 0), colour)
    rod = cone((-half_length, 0, 0), (half_length, 0, 0), half_thickness, None, colour)
    if style == 1:
        return rod
    ring = cone(
        (-0.25 * half_length, 0, 0),
        (0.25 * half_length, 0, 0),
        1.25 * half_thickness,
        None,
        pick_colour(rng),
    )
    return join(rod, ring)


def _surroundings(
    rng: np.random.Generator, giver: RobotDesign, receiver: RobotDesign
) -> list[RigidBody]:
    occupied = [(0.0, 0.0, 0.2), (*giver.base, 0.15), (*receiver.base, 0.15)]
    found = list(tabletop(rng, float(rng.uniform(1.6, 2.2)), 1.1))
    return found + clutter.scattered(
        rng, int(rng.integers(0, 6)), 0.03, (-0.7, 0.7, -0.4, 0.5), occupied
    )


def _truth(times: HandoverTimes, outcome: str, drop_s: float) -> TaskTruth:
    """Ground truth."""
    t = times
    offer = ("offer", t.offer, t.take)
    moves: tuple[Motion, ...] = (Motion("payload", t.begin, t.reach - 0.3),)
    first = Contact("giver", "payload", 0.0, min(t.release, drop_s))
    if outcome == "drop":
        stages = stage_spans(("offer", t.offer, drop_s, "failing"))
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), (first,), moves)
    if outcome == "never":
        stages = stage_spans(("offer", t.offer, t.reach), ("take", t.take, t.take + 0.4, "failing"))
        whole = (Contact("giver", "payload", 0.0, t.end),)
        return TaskTruth(outcome, "failed", stages, ("failed", "in_progress"), whole, moves)
    stages = stage_spans(offer, ("take", t.take, t.release), ("release", t.release, t.end))
    moves += (Motion("payload", t.back + 0.3, t.back + 2.3),)
    both = (first, Contact("receiver", "payload", t.take, t.end))
    return TaskTruth(outcome, "succeeded", stages, (), both, moves)
