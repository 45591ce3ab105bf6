"""Scripts of a capture: trajectories of arm, satellite and unexpected object, with ground truth.

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
FAILURE_VISIBLE_AFTER_S = 0.8
"""Seconds after which a failure is visible."""


@dataclass(frozen=True, slots=True, eq=False)
class Approach:
    """The approach with which all scripts begin: the arm's tip moves towards a point on the satellite.

    Attributes:
        contact_point: (3,) point of contact.
        away: (3,) unit, from the satellite back along the tip's path.
        tool_direction: (3,) direction of the end effector.
        start_distance: Metres between tip and contact at the start.
        drift: (3,) velocity of the satellite before contact, metres per second.
        spin: Its rotation until then.
        contact_s: Time of contact, also if it does not happen.
        end_s: End of the clip.
    """

    contact_point: Vector
    away: Vector
    tool_direction: Vector
    start_distance: float
    drift: Vector
    spin: SteadyRotation
    contact_s: float
    end_s: float

    @property
    def speed(self) -> float:
        """Metres per second of the tip towards the satellite."""
        return self.start_distance / self.contact_s

    def satellite_at(self, time: float, contact_position: Vector) -> Vector:
        """Position of the satellite before contact, relative to that at contact."""
        return np.asarray(contact_position + (time - self.contact_s) * self.drift)

    def tip_at(self, time: float) -> Vector:
        """Position of the tip during the approach, extrapolated after it."""
        return np.asarray(self.contact_point + (self.contact_s - time) * self.speed * self.away)


@dataclass(frozen=True, slots=True, eq=False)
class CaptureScript:
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


def capture_script(
    rng: np.random.Generator, outcome: str, approach: Approach, contact_position: Vector
) -> CaptureScript:
    """The script of an outcome, without an unexpected object.

    Args:
        rng: Draws the free parameters.
        outcome: One of `OUTCOMES`.
        approach: How it begins.
        contact_position: (3,) position of the satellite's origin at contact.
    """
    if outcome == "lost":
        return _lost(rng, approach, contact_position)
    if outcome == "aborted":
        return _aborted(rng, approach, contact_position)
    if outcome == "short":
        return _short(approach, contact_position)
    return _captured(rng, approach, contact_position)


def _short(approach: Approach, contact_position: Vector) -> CaptureScript:
    """The arm approaches until the clip ends."""
    end = approach.end_s
    truth = ScenarioTruth(
        verdict="in_progress",
        stage=(_stage("approach", SCORED_FROM_S, end, "complete"),),
        spin_of="satellite",
    )
    tip = _tip_keys([(0.0, approach.tip_at(0.0)), (end, approach.tip_at(end))], approach)
    return CaptureScript(
        tip, _drifting(approach, contact_position, end), (approach.spin,), None, truth
    )


def _captured(
    rng: np.random.Generator, approach: Approach, contact_position: Vector
) -> CaptureScript:
    """The arm grasps the satellite and carries it off."""
    contact_time, end = approach.contact_s, approach.end_s
    side = _perpendicular(rng, approach.away)
    goal_point = approach.contact_point + (end - contact_time - 1.0) * rng.uniform(0.14, 0.3) * side
    keys = [(0.0, approach.tip_at(0.0)), (contact_time, approach.contact_point)]
    keys += [(contact_time + 1.0, approach.contact_point), (end, goal_point)]
    truth = ScenarioTruth(
        verdict="succeeded",
        stage=(
            _stage("approach", SCORED_FROM_S, contact_time, "complete"),
            _stage("captured", contact_time, end, "complete"),
        ),
        coupling=(CouplingTruth(kind="coupled", objects=("arm", "satellite"), at_s=contact_time),),
        spin_of="satellite",
    )
    attach = Attachment(to="arm", from_s=contact_time)
    track = _drifting(approach, contact_position, contact_time)
    return CaptureScript(_tip_keys(keys, approach), track, (approach.spin,), attach, truth)


def _lost(rng: np.random.Generator, approach: Approach, contact_position: Vector) -> CaptureScript:
    """The arm knocks the satellite away, and it tumbles."""
    contact_time, end = approach.contact_s, approach.end_s
    push = -approach.away * rng.uniform(0.14, 0.3) + rng.uniform(0, 0.12) * _perpendicular(
        rng, approach.away
    )
    track = _drifting(approach, contact_position, contact_time)
    track = (
        *track,
        PoseKey(at_s=end, position=_rounded(contact_position + (end - contact_time) * push)),
    )
    tumbling = SteadyRotation(
        axis=_rounded(_unit(rng.normal(size=3))),
        deg_per_s=float(rng.uniform(2, 5)),
        from_s=contact_time,
    )
    retreat_point = (
        approach.contact_point
        + (end - contact_time - 1.5) * rng.uniform(0.02, 0.08) * approach.away
    )
    keys = [(0.0, approach.tip_at(0.0)), (contact_time, approach.contact_point)]
    keys += [(contact_time + 1.5, approach.contact_point), (end, retreat_point)]
    truth = ScenarioTruth(
        verdict="failed",
        stage=(
            _stage("approach", SCORED_FROM_S, contact_time, "complete"),
            _stage("captured", contact_time, end, "failing"),
        ),
        alert=(AlertTruth(kind="stage_failing", from_s=contact_time + FAILURE_VISIBLE_AFTER_S),),
        spin_of="satellite",
    )
    return CaptureScript(_tip_keys(keys, approach), track, (approach.spin, tumbling), None, truth)


def _aborted(
    rng: np.random.Generator, approach: Approach, contact_position: Vector
) -> CaptureScript:
    """The arm draws back before contact."""
    turn = approach.contact_s * rng.uniform(0.6, 0.8)
    end = approach.end_s
    near_point = approach.tip_at(turn)
    far_point = near_point + (end - turn) * approach.speed * approach.away
    tip = _tip_keys([(0.0, approach.tip_at(0.0)), (turn, near_point), (end, far_point)], approach)
    truth = ScenarioTruth(
        verdict="failed",
        stage=(_stage("approach", SCORED_FROM_S, end, "failing"),),
        alert=(AlertTruth(kind="stage_failing", from_s=turn + FAILURE_VISIBLE_AFTER_S),),
        spin_of="satellite",
    )
    return CaptureScript(
        tip, _drifting(approach, contact_position, end), (approach.spin,), None, truth
    )


def _drifting(approach: Approach, contact_position: Vector, until: float) -> tuple[PoseKey, ...]:
    return tuple(
        PoseKey(at_s=t, position=_rounded(approach.satellite_at(t, contact_position)))
        for t in (0.0, until)
    )


def _tip_keys(keys: Sequence[tuple[float, Vector]], approach: Approach) -> tuple[TipKey, ...]:
    tool_direction = _rounded(approach.tool_direction)
    return tuple(TipKey(at_s=t, position=_rounded(p), direction=tool_direction) for t, p in keys)


def _stage(
    stage: str, from_s: float, to_s: float, outcome: Literal["complete", "failing", "unsafe"]
) -> StageTruth:
    return StageTruth(stage=stage, from_s=from_s, to_s=to_s, outcome=outcome)


def _rounded(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 5) for v in vector)
    return x, y, z


def _unit(vector: Vector) -> Vector:
    return np.asarray(vector / np.linalg.norm(vector))


def _perpendicular(rng: np.random.Generator, away: Vector) -> Vector:
    """(3,) unit, perpendicular to a direction and mostly parallel to the image."""
    drawn = rng.normal(size=3) * (0.4, 1.0, 1.0)
    return _unit(drawn - (drawn @ away) * away)
