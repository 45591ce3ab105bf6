"""Rows of the arrays of states and relations of all pairs.

The compiled loops use these enumerations too. A state of an ordered pair has one row for (a, b) and another
for (b, a).

"""

from __future__ import annotations

from enum import IntEnum


class StateRow(IntEnum):
    """Rows of the states with hysteresis.

    The first `BOX_ROWS` are those of plain boxes, from `classify_boxes`.
    """

    EDGES = 0  # order of the edges, eight rows; see `edge_differences`
    DIRECTION = 8
    DISTANCE = 9
    FIRST_AWAY = 10  # QTC-B
    SECOND_AWAY = 11
    FIRST_SIDE = 12  # QTC-C adds these
    SECOND_SIDE = 13
    TREND = 14
    TOUCH = 15
    TOGETHER = 16
    DEPTH = 17
    OUTLINES = 18  # three rows; see `outline_differences`


BOX_ROWS = 14
ROWS = 21
ORDER = slice(StateRow.EDGES, StateRow.DIRECTION)
DIRECTION, DISTANCE = StateRow.DIRECTION, StateRow.DISTANCE
AWAY = slice(StateRow.FIRST_AWAY, StateRow.FIRST_SIDE)
SIDE = slice(StateRow.FIRST_SIDE, StateRow.TREND)
MOVEMENT = slice(StateRow.FIRST_AWAY, StateRow.TREND)
MOTION = slice(StateRow.TREND, StateRow.DEPTH)
MOTION_AND_DEPTH = slice(StateRow.TREND, StateRow.OUTLINES)
OUTLINE = slice(StateRow.OUTLINES, ROWS)


class TableRow(IntEnum):
    """Rows of codes, and of their start times, in the relation table."""

    TREND = 0
    TOUCH = 1
    TOGETHER = 2
    BOXES = 3  # RCC-8 of the boxes
    BOXES_CONVERSE = 4
    GAP = 5
    OUTLINES = 6  # RCC-8 of the outlines
    OUTLINES_CONVERSE = 7
    DEPTH = 8
    FIRST_AWAY = 9
    SECOND_AWAY = 10
    FIRST_SIDE = 11
    SECOND_SIDE = 12
    DISTANCE = 13
    DIRECTION = 14
    DIRECTION_CONVERSE = 15


class ValueRow(IntEnum):
    """Rows of numbers in the relation table: certainties first, then quantities."""

    CERTAIN = 0
    MOST = 1
    TREND_CERTAINTY = 2
    GAP = 3
    RATE = 4
    SIGMA = 5
    RELATIVE_SPEED = 6


class PairQuantity(IntEnum):
    """Tables of all pairs; see `Kinematics`."""

    GAP = 0
    RATE = 1
    SIGMA = 2
    RELATIVE_SPEED = 3
    TIME_TO_CONTACT = 4
