"""Courses of a capture: trajectories of arm, satellite and unexpected object, with ground truth.

World as in the shipped `sts87`: metres, the camera at the origin looks along x, y to the left, z up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from visup.render.scenario.scenario import (
    AlertTruth,
    Attachment,
    CouplingTruth,
    PoseKey,
    ScenarioTruth,
    StageTruth,
    SteadyRotation,
    TipKey,
)

Vector = NDArray[np.float64]
Verdict = Literal["succeeded", "failed", "interrupted", "in_progress"]

OUTCOMES = ("ok", "lost", "aborted", "intruder", "crossing", "short")
"""Captured; knocked away; the arm draws back; an unexpected object approaches the satellite, or passes in
front of it; the clip ends before contact."""

SCORED_FROM_S = 2.0
SHOWS_AFTER_S = 0.8
"""Seconds after which a failure is visible."""


@dataclass(frozen=True, slots=True, eq=False)
class Approach:
    """The approach with which all courses begin: the arm's tip moves towards a point on the satellite.

    Attributes:
        contact: (3,) point of contact.
        away: (3,) unit, from the satellite back along the tip's path.
        pointing: (3,) direction of the end effector.
        begin: Metres between tip and contact at the start.
        drift: (3,) velocity of the satellite before contact, metres per second.
        spin: Its rotation until then.
        touch_s: Time of contact, also if it does not happen.
        end_s: End of the clip.
    """

    contact: Vector
    away: Vector
    pointing: Vector
    begin: float
    drift: Vector
    spin: SteadyRotation
    touch_s: float
    end_s: float

    @property
    def speed(self) -> float:
        """Metres per second of the tip towards the satellite."""
        return self.begin / self.touch_s

    def satellite_at(self, time: float, at_touch: Vector) -> Vector:
        """Position of the satellite before contact, relative to that at contact."""
        return np.asarray(at_touch + (time - self.touch_s) * self.drift)

    def tip_at(self, time: float) -> Vector:
        """Position of the tip during the approach, extrapolated after it."""
        return np.asarray(self.contact + (self.touch_s - time) * self.speed * self.away)


@dataclass(frozen=True, slots=True, eq=False)
class CaptureCourse:
    """The events of a mission.

    Attributes:
        tip: Keys of the arm's tip.
        satellite: Keys of the satellite.
        spins: Its rotations.
        attach: From when on the arm holds it.
        truth: Ground truth.
    """

    tip: tuple[TipKey, ...]
    satellite: tuple[PoseKey, ...]
    spins: tuple[SteadyRotation, ...]
    attach: Attachment | None
    truth: ScenarioTruth


def course_of(
    rng: np.random.Generator, outcome: str, approach: Approach, at_touch: Vector
) -> CaptureCourse:
    """The course of an outcome, without an unexpected object.

    Args:
        rng: Draws the free parameters.
        outcome: One of `OUTCOMES`.
        approach: How it begins.
        at_touch: (3,) position of the satellite's origin at contact.
    """
    if outcome == "lost":
        return _lost(rng, approach, at_touch)
    if outcome == "aborted":
        return _aborted(rng, approach, at_touch)
    if outcome == "short":
        return _short(approach, at_touch)
    return _captured(rng, approach, at_touch)


def _short(approach: Approach, at_touch: Vector) -> CaptureCourse:
    """The arm approaches until the clip ends."""
    end = approach.end_s
    truth = ScenarioTruth(
        verdict="in_progress",
        stage=(_stage("approach", SCORED_FROM_S, end, "complete"),),
        spin_of="satellite",
    )
    tip = _tip([(0.0, approach.tip_at(0.0)), (end, approach.tip_at(end))], approach)
    return CaptureCourse(tip, _drifting(approach, at_touch, end), (approach.spin,), None, truth)


def _captured(rng: np.random.Generator, approach: Approach, at_touch: Vector) -> CaptureCourse:
    """The arm grasps the satellite and carries it off."""
    touch, end = approach.touch_s, approach.end_s
    side = _across(rng, approach.away)
    goal = approach.contact + (end - touch - 1.0) * rng.uniform(0.14, 0.3) * side
    keys = [(0.0, approach.tip_at(0.0)), (touch, approach.contact)]
    keys += [(touch + 1.0, approach.contact), (end, goal)]
    truth = ScenarioTruth(
        verdict="succeeded",
        stage=(
            _stage("approach", SCORED_FROM_S, touch, "complete"),
            _stage("captured", touch, end, "complete"),
        ),
        coupling=(CouplingTruth(kind="coupled", objects=("arm", "satellite"), at_s=touch),),
        spin_of="satellite",
    )
    attach = Attachment(to="arm", from_s=touch)
    track = _drifting(approach, at_touch, touch)
    return CaptureCourse(_tip(keys, approach), track, (approach.spin,), attach, truth)


def _lost(rng: np.random.Generator, approach: Approach, at_touch: Vector) -> CaptureCourse:
    """The arm knocks the satellite away, and it tumbles."""
    touch, end = approach.touch_s, approach.end_s
    push = -approach.away * rng.uniform(0.14, 0.3) + rng.uniform(0, 0.12) * _across(
        rng, approach.away
    )
    track = _drifting(approach, at_touch, touch)
    track = (*track, PoseKey(at_s=end, position=_place(at_touch + (end - touch) * push)))
    tumble = SteadyRotation(
        axis=_place(_unit(rng.normal(size=3))), deg_per_s=float(rng.uniform(2, 5)), from_s=touch
    )
    back = approach.contact + (end - touch - 1.5) * rng.uniform(0.02, 0.08) * approach.away
    keys = [(0.0, approach.tip_at(0.0)), (touch, approach.contact)]
    keys += [(touch + 1.5, approach.contact), (end, back)]
    truth = ScenarioTruth(
        verdict="failed",
        stage=(
            _stage("approach", SCORED_FROM_S, touch, "complete"),
            _stage("captured", touch, end, "failing"),
        ),
        alert=(AlertTruth(kind="stage_failing", from_s=touch + SHOWS_AFTER_S),),
        spin_of="satellite",
    )
    return CaptureCourse(_tip(keys, approach), track, (approach.spin, tumble), None, truth)


def _aborted(rng: np.random.Generator, approach: Approach, at_touch: Vector) -> CaptureCourse:
    """The arm draws back before contact."""
    turn = approach.touch_s * rng.uniform(0.6, 0.8)
    end = approach.end_s
    near = approach.tip_at(turn)
    gone = near + (end - turn) * approach.speed * approach.away
    tip = _tip([(0.0, approach.tip_at(0.0)), (turn, near), (end, gone)], approach)
    truth = ScenarioTruth(
        verdict="failed",
        stage=(_stage("approach", SCORED_FROM_S, end, "failing"),),
        alert=(AlertTruth(kind="stage_failing", from_s=turn + SHOWS_AFTER_S),),
        spin_of="satellite",
    )
    return CaptureCourse(tip, _drifting(approach, at_touch, end), (approach.spin,), None, truth)


def _drifting(approach: Approach, at_touch: Vector, until: float) -> tuple[PoseKey, ...]:
    return tuple(
        PoseKey(at_s=t, position=_place(approach.satellite_at(t, at_touch))) for t in (0.0, until)
    )


def _tip(keys: Sequence[tuple[float, Vector]], approach: Approach) -> tuple[TipKey, ...]:
    pointing = _place(approach.pointing)
    return tuple(TipKey(at_s=t, position=_place(p), direction=pointing) for t, p in keys)


def _stage(
    stage: str, from_s: float, to_s: float, outcome: Literal["complete", "failing", "unsafe"]
) -> StageTruth:
    return StageTruth(stage=stage, from_s=from_s, to_s=to_s, outcome=outcome)


def _place(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) for v in vector)
    return x, y, z


def _unit(vector: Vector) -> Vector:
    return np.asarray(vector / np.linalg.norm(vector))


def _across(rng: np.random.Generator, away: Vector) -> Vector:
    """(3,) unit, perpendicular to a direction and mostly parallel to the image."""
    drawn = rng.normal(size=3) * (0.4, 1.0, 1.0)
    return _unit(drawn - (drawn @ away) * away)
