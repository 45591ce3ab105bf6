"""From quantities of pairs to qualitative states: thresholds above the noise, with hysteresis.

Shared by the relations of an agent's objects (`relations.py`) and those of plain boxes
(`boxes.py`). All states of all pairs stand in one array of codes, a row for each question, so that
one latch holds them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from visup.rules.direction import directions
from visup.rules.distance import classes, signed_gap, sizes
from visup.rules.latch import UNKNOWN, WITHIN, Codes, Floats, hold_sign
from visup.rules.pairs import pairs
from visup.rules.qtc import components
from visup.rules.rcc8 import edge_differences

ORDER, DIRECTION, DISTANCE = slice(0, 8), 8, 9
AWAY, SIDE = slice(10, 12), slice(12, 14)
MOVEMENT = slice(10, 14)
JUDGED = 14
"""Rows of codes: order of edges (8), direction, distance class, QTC-B (2) and its sides (2)."""


@dataclass(frozen=True, slots=True)
class JudgeSettings:
    """Thresholds of what is judged here. Lengths are shares of the image diagonal but for the noise.

    Attributes:
        noise_px: Standard deviation of an edge of a box from frame to frame, pixels.
        level_enter: Edges farther apart than this are no longer level.
        level_exit: Edges nearer than this are level again.
        place_enter: Centres nearer than this come to one place.
        place_exit: Centres farther apart than this are at two places.
        cone_slack_deg: How far beyond the edge of its cone a direction is kept, degrees.
        class_slack: How far beyond the end of its class a distance keeps it, share of the limit.
        speed_enter: Speed towards, away, to a side that must be exceeded, diagonals per second.
        speed_exit: Speed below which it ends.
        sigmas_enter: How many of its standard deviations it must exceed, too.
        sigmas_exit: Below how many it ends, too.
        state_minimum_s: Least duration of orders of edges, directions and distance classes.
        motion_minimum_s: Least duration of movements.
    """

    noise_px: float = 0.5
    level_enter: float = 0.0044
    level_exit: float = 0.0006
    place_enter: float = 0.004
    place_exit: float = 0.01
    cone_slack_deg: float = 5.0
    class_slack: float = 0.1
    speed_enter: float = 0.001
    speed_exit: float = 0.0005
    sigmas_enter: float = 5.0
    sigmas_exit: float = 2.5
    state_minimum_s: float = 0.2
    motion_minimum_s: float = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Quantities:
    """What states are judged by; NaN is unknown.

    Attributes:
        differences: (8, P) pixels, of the boxes' edges; see `edge_differences`.
        places: (M, 2) centres of the boxes, pixels.
        gap: (P,) distance of the boxes, pixels, negative the depth of their overlap.
        size: (P,) pixels; see `sizes`.
        speeds: (4, P) pixels per second: of each away from the other, then across; see `components`.
        sigma: (4, P) their standard deviation.
    """

    differences: Floats
    places: Floats
    gap: Floats
    size: Floats
    speeds: Floats
    sigma: Floats


def quantities(
    boxes: Floats,
    velocities: Floats,
    spread: Floats,
    noise_px: float,
) -> Quantities:
    """Everything that is judged, of boxes and the velocities of their centres.

    Args:
        boxes: (M, 4) x, y, width, height, pixels; NaN for what is not seen.
        velocities: (M, 2) pixels per second; NaN unknown.
        spread: (M,) standard deviation of a component.
        noise_px: Of an edge, pixels.
    """
    differences = edge_differences(boxes)
    places = boxes[:, :2] + 0.5 * boxes[:, 2:]
    speeds, length = components(places, velocities)
    # The line between the places is noisy too, the more so the shorter it is.
    turn = 2.0 * noise_px**2 / np.maximum(length * length, 1.0)
    speed = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
    both = np.array(pairs(len(boxes)) * 2)
    sigma = np.sqrt((spread * spread)[both] + speed[both] * turn)
    return Quantities(differences, places, signed_gap(differences), sizes(boxes), speeds, sigma)


def wanted(before: Codes, q: Quantities, s: JudgeSettings, diagonal: float) -> Codes:
    """What the quantities say now, in view of what was believed before.

    Args:
        before: (JUDGED, P) codes believed so far.
        q: Quantities.
        s: Thresholds.
        diagonal: Image diagonal, pixels.

    Returns:
        (JUDGED, P) codes.
    """
    codes = np.empty((JUDGED, before.shape[1]), dtype=np.int8)
    codes[ORDER] = hold_sign(
        q.differences, before[ORDER], s.level_enter * diagonal, s.level_exit * diagonal
    )
    codes[DIRECTION] = directions(
        q.places,
        before[DIRECTION],
        (s.place_enter * diagonal, s.place_exit * diagonal),
        np.deg2rad(s.cone_slack_deg),
        s.noise_px,
    )
    codes[DISTANCE] = classes(q.gap, q.size, before[DISTANCE], s.class_slack, s.noise_px)
    enter = np.maximum(s.speed_enter * diagonal, s.sigmas_enter * q.sigma)
    leave = np.maximum(s.speed_exit * diagonal, s.sigmas_exit * q.sigma)
    codes[MOVEMENT] = moving_sign(q.speeds, before[MOVEMENT], enter, leave)
    return codes


def moving_sign(speed: Floats, before: Codes, enter: Floats, leave: Floats) -> Codes:
    """Signs of speeds: what is not known yet is at rest until the speed exceeds `enter`."""
    return hold_sign(speed, np.where(before == UNKNOWN, np.int8(WITHIN), before), enter, leave)


def least_durations(s: JudgeSettings) -> Floats:
    """(JUDGED, 1) seconds that each row must last before it is believed."""
    lasts = np.full((JUDGED, 1), s.state_minimum_s)
    lasts[MOVEMENT] = s.motion_minimum_s
    return lasts
