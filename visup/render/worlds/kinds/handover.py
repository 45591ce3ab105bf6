"""`handover`: one arm hands a bar to another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
from visup.render.worlds.motion import carried, clock, dropped, eased, frame_at, posed
from visup.render.worlds.things import clutter
from visup.render.worlds.things.robot import (
    RobotCourse,
    RobotDesign,
    hand_poses,
    random_robot,
    robot_things,
)
from visup.render.worlds.things.scenery import pick_colour, seed_of, tabletop, unlike
from visup.render.worlds.world import Contact, Course, Motion, Poses, Surface, Thing, World

OUTCOMES = ("ok", "drop", "never", "in_progress")
GIVER, PAYLOAD, RECEIVER, GIVER_ARM, RECEIVER_ARM = 2, 3, 4, 5, 6
LEVEL = 0.26
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
    half, thick = float(rng.uniform(0.085, 0.12)), float(rng.uniform(0.016, 0.026))
    colour = unlike(rng, [giver.colour, receiver.colour])
    times = _times(rng)
    frames = frames_until(times.end)
    meet = np.array([rng.uniform(-0.06, 0.06), rng.uniform(-0.16, 0.02), LEVEL])
    grip = np.array([side * half * 0.72, 0, 0])
    gives = Partner.for_bar(giver, meet - grip, thick)
    takes = Partner.for_bar(receiver, meet + grip, thick)
    first = _giver_course(rng, gives, times, outcome, frames)
    second = _receiver_course(rng, takes, times, outcome, frames)
    hands = hand_poses(giver, first), hand_poses(receiver, second)
    payload, drop_s = _payload_poses(rng, hands, times, outcome, meet)
    surface = Surface("grain", 0.05, float(rng.uniform(0.02, 0.2)), seed_of(rng))
    whole = bool(rng.random() < 0.6)
    aim = np.array([0.0, 0.0, 0.2])
    place = from_around(rng, aim, float(rng.uniform(1.3, 1.6)), (12, 45))
    view = random_view(rng, place, aim, frames)
    things = [
        *robot_things(giver, first, "giver", GIVER, GIVER if whole else GIVER_ARM),
        *robot_things(receiver, second, "receiver", RECEIVER, RECEIVER if whole else RECEIVER_ARM),
        Thing("payload", _bar(rng, half, thick, colour), payload, PAYLOAD, surface),
        *_surroundings(rng, giver, receiver),
    ]
    truth = _course(times, outcome, drop_s)
    if outcome == "in_progress":
        end = float(rng.uniform(times.offer + 0.9, times.take - 0.2))
        truth, frames = cut_short(truth, end), frames_until(end)
    script = Script(
        things, view, ("handover", TASK), ("giver", "payload", "receiver"), truth, frames
    )
    return finished(rng, "handover", script)


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
class Partner:
    """One of the two arms.

    Attributes:
        design: The arm.
        goal: (3,) position of its tip during the handover, metres.
        tight: Distance of its fingers when they hold the bar, metres.
        wide: The same when they do not.
    """

    design: RobotDesign
    goal: Doubles
    tight: float
    wide: float

    @classmethod
    def for_bar(cls, design: RobotDesign, goal: Doubles, thick: float) -> Partner:
        """An arm with fingers for a bar of half a thickness, metres."""
        return cls(design, goal, 2 * thick, 2 * thick + 0.05)

    def random_home(self, rng: np.random.Generator) -> Doubles:
        """(3,) rest position of its tip: on its own side, slightly in front of the foot."""
        x, y = self.design.foot[:2]
        return np.array([0.62 * x, y - 0.12, float(rng.uniform(0.3, 0.4))])


def _giver_course(
    rng: np.random.Generator, arm: Partner, t: HandoverTimes, outcome: str, frames: int
) -> RobotCourse:
    home = arm.random_home(rng)
    keys = [(t.begin, home), (t.reach - 0.3, arm.goal), (t.back, arm.goal), (t.back + 1.8, home)]
    loose = t.reach - 0.05 if outcome == "drop" else t.release
    grip = [(loose, arm.tight), (loose + 0.3, arm.wide)]
    return _course_of(rng, keys, grip if outcome != "never" else [(0.0, arm.tight)], frames)


def _receiver_course(
    rng: np.random.Generator, arm: Partner, t: HandoverTimes, outcome: str, frames: int
) -> RobotCourse:
    home, goal = arm.random_home(rng), arm.goal
    ready = goal + np.array([0.12 * np.sign(arm.design.foot[0]), 0, 0])
    between = t.offer + 0.7 * (t.reach - t.offer)
    leave = t.back + 0.3 if outcome != "never" else t.take + 0.4
    keys = [(t.offer, home), (between, ready), (t.reach, goal), (leave, goal), (leave + 2.0, home)]
    shut = arm.wide - 0.015 if outcome == "never" else arm.tight
    return _course_of(rng, keys, [(t.reach, arm.wide), (t.take, shut)], frames)


def _course_of(
    rng: np.random.Generator,
    keys: list[tuple[float, Doubles]],
    grip: list[tuple[float, float]],
    frames: int,
) -> RobotCourse:
    at = clock(frames)
    lean = np.full(frames, float(rng.uniform(0.8, 1.2)))
    return RobotCourse(eased(at, keys), eased(at, grip), np.full(frames, np.pi / 2), lean)


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
    level = posed(meet)[0]
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


def _bar(rng: np.random.Generator, half: float, thick: float, colour: Colour) -> Solid:
    """A bar along x about its middle."""
    style = rng.integers(3)
    if style == 0:
        return box((2 * half, 2 * thick, 2 * thick), (0, 0, 0), colour)
    rod = cone((-half, 0, 0), (half, 0, 0), thick, None, colour)
    if style == 1:
        return rod
    ring = cone((-0.25 * half, 0, 0), (0.25 * half, 0, 0), 1.25 * thick, None, pick_colour(rng))
    return join(rod, ring)


def _surroundings(
    rng: np.random.Generator, giver: RobotDesign, receiver: RobotDesign
) -> list[Thing]:
    taken = [(0.0, 0.0, 0.2), (*giver.foot, 0.15), (*receiver.foot, 0.15)]
    found = list(tabletop(rng, float(rng.uniform(1.6, 2.2)), 1.1))
    return found + clutter.scattered(
        rng, int(rng.integers(0, 6)), 0.03, (-0.7, 0.7, -0.4, 0.5), taken
    )


def _course(times: HandoverTimes, outcome: str, drop_s: float) -> Course:
    """Ground truth."""
    t = times
    offer = ("offer", t.offer, t.take)
    moves: tuple[Motion, ...] = (Motion("payload", t.begin, t.reach - 0.3),)
    first = Contact("giver", "payload", 0.0, min(t.release, drop_s))
    if outcome == "drop":
        stages = spans(("offer", t.offer, drop_s, "failing"))
        return Course(outcome, "failed", stages, ("failed", "in_progress"), (first,), moves)
    if outcome == "never":
        stages = spans(("offer", t.offer, t.reach), ("take", t.take, t.take + 0.4, "failing"))
        whole = (Contact("giver", "payload", 0.0, t.end),)
        return Course(outcome, "failed", stages, ("failed", "in_progress"), whole, moves)
    stages = spans(offer, ("take", t.take, t.release), ("release", t.release, t.end))
    moves += (Motion("payload", t.back + 0.3, t.back + 2.3),)
    both = (first, Contact("receiver", "payload", t.take, t.end))
    return Course(outcome, "succeeded", stages, (), both, moves)
