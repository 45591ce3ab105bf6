"""Allen's relations along an image axis, and TPCC of three objects, by their names.

They use the current boxes and centres alone, without hysteresis: edges nearer than `LEVEL_TOLERANCE` are
level, and directions within `STRAIGHT_DEG` of straight ahead, back or sideways are straight. They may
flicker at a limit; `for` and `in 3 of 5 samples` steady them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from visup.agent import Presence
from visup.rules.calculi.allen import NAMES as ALLEN_NAMES
from visup.rules.formula.truth import MAYBE, NO, YES
from visup.rules.geometry.regions import image_diagonal
from visup.rules.predicates.snapshot import Codes, Floats, Snapshot

LEVEL_TOLERANCE = 0.0025
"""Image diagonals; the mean of the two thresholds of RCC-8 of boxes."""
STRAIGHT_DEG = 5.0
ALLEN_RELATIONS = tuple(ALLEN_NAMES.values())
TPCC_RELATIONS = (
    *(f"{near}{sector}" for near in "cd" for sector in (
        "sf", "fl", "lf", "sl", "lb", "bl", "sb", "br", "rb", "sr", "rf", "fr")),
    "sam",
)  # fmt: skip
"""Closer to the relatum than the origin (`c`) or not (`d`), then the sector: `lf` is left, rather front."""

_SIGNS: Mapping[str, tuple[int, int, int, int]] = MappingProxyType(
    {
        "before": (-1, -1, -1, -1),
        "meets": (-1, -1, 0, -1),
        "overlaps": (-1, -1, 1, -1),
        "finished_by": (-1, 0, 1, -1),
        "contains": (-1, 1, 1, -1),
        "starts": (0, -1, 1, -1),
        "equal": (0, 0, 1, -1),
        "started_by": (0, 1, 1, -1),
        "during": (1, -1, 1, -1),
        "finishes": (1, 0, 1, -1),
        "overlapped_by": (1, 1, 1, -1),
        "met_by": (1, 1, 1, 0),
        "after": (1, 1, 1, 1),
    }
)
"""Signs of start - start, end - end, end of a - start of b, start of a - end of b."""

PairEvaluator = Callable[[Snapshot, str], Codes]


def allen_evaluator(axis: int) -> PairEvaluator:
    """The evaluation of Allen's relations along an axis: 0 to the right, 1 down."""

    def evaluate(facts: Snapshot, relation: str) -> Codes:
        begin, end = _spans(facts, axis)
        level = LEVEL_TOLERANCE * image_diagonal(facts.mind.frame_size)
        differences = (
            begin[:, None] - begin,
            end[:, None] - end,
            end[:, None] - begin,
            begin[:, None] - end,
        )
        holds = np.ones((len(begin), len(begin)), bool)
        for difference, wanted in zip(differences, _SIGNS[relation], strict=True):
            holds &= _sign(difference, level) == wanted
        return _codes(holds, np.isnan(differences[0]))

    return evaluate


def _spans(facts: Snapshot, axis: int) -> tuple[Floats, Floats]:
    """Starts and ends of boxes along an axis, pixels; NaN when out of view."""
    boxes = np.array([b.region.bbox for b in facts.beliefs], dtype=float).reshape(-1, 4)
    boxes[~_seen(facts)] = np.nan
    return boxes[:, axis], boxes[:, axis] + boxes[:, 2 + axis]


def _sign(difference: Floats, level: float) -> NDArray[np.int8]:
    """-1, 0 within the tolerance, or 1; arbitrary where unknown, which is masked later."""
    with np.errstate(invalid="ignore"):
        return np.where(np.abs(difference) <= level, 0, np.sign(difference)).astype(np.int8)


def tpcc_codes(facts: Snapshot, relation: str) -> Codes:
    """The TPCC relation of the third object to the line from the first to the second."""
    centres = np.array([b.region.centroid for b in facts.beliefs], dtype=float).reshape(-1, 2)
    centres[~_seen(facts)] = np.nan
    ahead = centres[None, :] - centres[:, None]  # from a to b
    to_third = centres[None, None, :] - centres[None, :, None]  # from b to c
    direction, distance = ahead[:, :, None], np.linalg.norm(to_third, axis=3)
    cross = direction[..., 0] * to_third[..., 1] - direction[..., 1] * to_third[..., 0]
    dot = (direction * to_third).sum(axis=3)
    # Positive to the left, since y points down in images.
    angle = np.degrees(np.arctan2(-cross, dot))
    level = LEVEL_TOLERANCE * image_diagonal(facts.mind.frame_size)
    coincides = distance <= level
    if relation == "sam":
        return _codes(coincides, np.isnan(distance))
    is_close = distance < np.linalg.norm(ahead, axis=2)[:, :, None]
    holds = _in_sector(angle, relation[1:]) & (is_close == (relation[0] == "c")) & ~coincides
    return _codes(holds, np.isnan(angle + distance))


_STRAIGHT = {"sf": 0.0, "sl": 90.0, "sb": 180.0, "sr": -90.0}
_BETWEEN = {
    "fl": (0.0, 45.0),
    "lf": (45.0, 90.0),
    "lb": (90.0, 135.0),
    "bl": (135.0, 180.0),
    "br": (-180.0, -135.0),
    "rb": (-135.0, -90.0),
    "rf": (-90.0, -45.0),
    "fr": (-45.0, 0.0),
}


def _in_sector(turn: Floats, sector: str) -> NDArray[np.bool_]:
    """Whether directions are in a sector of TPCC, or on one of its straight lines."""
    straight = np.min([np.abs((turn - a + 180) % 360 - 180) for a in _STRAIGHT.values()], axis=0)
    if sector in _STRAIGHT:
        return np.asarray(np.abs((turn - _STRAIGHT[sector] + 180) % 360 - 180) <= STRAIGHT_DEG)
    low, high = _BETWEEN[sector]
    return np.asarray((straight > STRAIGHT_DEG) & (turn > low) & (turn <= high))


def _seen(facts: Snapshot) -> NDArray[np.bool_]:
    return np.array([b.presence is Presence.SEEN for b in facts.beliefs], dtype=bool)


def _codes(holds: NDArray[np.bool_], unknown: NDArray[np.bool_]) -> Codes:
    return np.where(unknown, MAYBE, np.where(holds, YES, NO)).astype(np.int8)
