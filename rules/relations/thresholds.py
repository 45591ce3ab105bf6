"""From quantities of pairs to qualitative states: thresholds above the noise, with hysteresis.

Shared by the relations of an agent's objects (`reasoner.py`) and those of plain boxes
(`visup/evaluation/reasoning/boxes.py`). All states of all pairs are in one array of codes, one row per
question; see `rows.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from visup.rules.relations.rows import BOX_ROWS, MOVEMENT
from visup.rules.smoothing.hysteresis import Floats


@dataclass(frozen=True, slots=True)
class ThresholdSettings:
    """Thresholds of the states. Lengths are shares of the image diagonal, except the noise.

    Attributes:
        noise_px: Standard deviation of an edge of a box from frame to frame, pixels.
        level_enter: Edges farther apart than this are no longer level.
        level_exit: Edges nearer than this are level again.
        place_enter: Centres nearer than this coincide.
        place_exit: Centres farther apart than this no longer do.
        cone_slack_deg: Tolerance beyond the edge of a direction's cone, degrees.
        class_slack: Tolerance beyond the end of a distance class, as a share of the limit.
        speed_enter: Speed towards, away or sideways that must be exceeded, diagonals per second.
        speed_exit: Speed below which it ends.
        sigmas_enter: The same in its standard deviations, which must also be exceeded.
        sigmas_exit: Standard deviations below which it also ends.
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


Limits = tuple[float, float, float, float, float, float, float, float, float, float, float]


def limits(s: ThresholdSettings, diagonal: float) -> Limits:
    """Thresholds in the form of `classify_boxes`.

    Args:
        s: Settings.
        diagonal: Image diagonal, pixels.

    Returns:
        Level edges, to leave and to enter; coincidence, to enter and to leave; tolerance of a direction,
        radians; noise; tolerance of a class; speeds to move and to rest, pixels per second and in
        standard deviations.
    """
    return (
        s.level_enter * diagonal,
        s.level_exit * diagonal,
        s.place_enter * diagonal,
        s.place_exit * diagonal,
        radians(s.cone_slack_deg),
        s.noise_px,
        s.class_slack,
        s.speed_enter * diagonal,
        s.speed_exit * diagonal,
        s.sigmas_enter,
        s.sigmas_exit,
    )


def least_durations(s: ThresholdSettings) -> Floats:
    """(BOX_ROWS, 1) least duration of each row before it is accepted, seconds."""
    lasts = np.full((BOX_ROWS, 1), s.state_minimum_s)
    lasts[MOVEMENT] = s.motion_minimum_s
    return lasts
