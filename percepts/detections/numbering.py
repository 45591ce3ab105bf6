"""Numbers for boxes that a detector found frame by frame: the same thing keeps its number."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import log
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from visup.percepts.detections.box_filter import BoxState, begun, expected, updated
from visup.percepts.detections.boxes import Detection, overlap

SURE = 0.5
"""Boxes of this score choose first which things they are; the others go on as what is left (ByteTrack)."""

STARTS = 0.35
"""Least score of a box that may begin a thing: what is no surer must come again several times to be told."""

LEAST_OVERLAP, LEAST_OVERLAP_UNSURE = 0.15, 0.3
"""A box goes on as another when it shares so much of the union with where that is expected. With 0.05
neighbours change numbers, with 0.25 what a poor detector puts off its place begins anew."""

UNSURE_FRAMES = 3
"""For so many frames what was not found may go on as an unsure box."""

PATIENCE_FRAMES = 25
"""What was not found for more frames than that gets a new number when it is found again."""

DOUBT, FOUND_AGAIN, NOT_FOUND, GIVEN_UP = -2.0, 1.0, -1.0, -3.0
"""Log odds that a thing is there: before a box is seen, and what each box at its expected place and each miss
add (a box of nothing seldom comes twice); a thing that was never told is given up below the last of them.
Where coming again adds 2, boxes of nothing are told too often: MOTA of simulated streets falls by 0.06."""


@dataclass(slots=True)
class _Thing:
    """A thing with a number.

    Attributes:
        state: Where it was last, and how it moved.
        name: What it is said to be.
        frame: When it was last found.
        odds: Log odds that it is there.
        told: Its number, 0 until it is believed to be there.
    """

    state: BoxState
    name: str | None
    frame: int
    odds: float
    told: int = 0


@dataclass(slots=True)
class BoxNumbering:
    """Numbers boxes from frame to frame, each where a thing that goes on as it went would be.

    Sure boxes are assigned first so that they overlap the most in all with where things are expected (Kuhn
    1955), then unsure ones to what is left, as in ByteTrack (Zhang et al. 2022). A thing is told once the
    scores of its boxes, and that they come again, make it more likely than not; boxes of what is not believed
    to be there are left out. Two things of one kind that hide each other may change numbers; a tracker
    that looks at the picture does better, and its numbers are kept as they are.
    """

    _things: list[_Thing] = field(default_factory=list)
    _next: int = 1

    def number(self, frame: int, found: Sequence[Detection]) -> tuple[Detection, ...]:
        """The boxes of a frame that are believed, each with its number.

        Args:
            frame: Index of the frame; it grows from call to call.
            found: Its boxes. If any of them has a number, all are given back as they are.
        """
        if any(d.track for d in found):
            return tuple(found)
        self._forget(frame)
        owner = self._assigned(frame, found)
        for thing in self._things:
            if thing.frame < frame:
                thing.odds += NOT_FOUND
        for place, d in enumerate(found):
            if place not in owner and d.score >= STARTS:
                owner[place] = _Thing(begun(d.box), d.name, frame, _log_odds(d.score) + DOUBT)
                self._things.append(owner[place])
        self._things = [t for t in self._things if t.told or t.odds > GIVEN_UP]
        return tuple(self._told(owner[p], d) for p, d in enumerate(found) if _is_told(owner.get(p)))

    def save(self) -> Mapping[str, Any]:
        """The state to resume from, as plain values."""
        things = [[*_rows(t.state), t.name, t.frame, t.odds, t.told] for t in self._things]
        return {"things": things, "next": self._next}

    def load(self, state: Mapping[str, Any]) -> None:
        """Take on what another numbering remembered."""
        self._next = int(state["next"])
        self._things = [
            _Thing(BoxState(*map(np.array, rows[:3])), *rows[3:]) for rows in state["things"]
        ]

    def _assigned(self, frame: int, found: Sequence[Detection]) -> dict[int, _Thing]:
        """Place of a box -> the thing that goes on as it; sure boxes first, and things that were told."""
        ahead = [expected(t.state, frame - t.frame) for t in self._things]
        left = set(range(len(self._things)))
        sure = [p for p, d in enumerate(found) if d.score >= SURE]
        unsure = [p for p, d in enumerate(found) if d.score < SURE]
        owner: dict[int, _Thing] = {}
        told = {i for i in left if self._things[i].told}
        rounds = (
            (sure, told, LEAST_OVERLAP),
            (unsure, {i for i in told if self._is_fresh(i, frame)}, LEAST_OVERLAP_UNSURE),
            (sure, left - told, LEAST_OVERLAP),
            (unsure, left - told, LEAST_OVERLAP_UNSURE),
        )
        for all_, things, least in rounds:
            rows, places = sorted(left & things), [p for p in all_ if p not in owner]
            for i, p in _pairs(
                rows, places, lambda i, p: self._shared(i, ahead[i], found[p]), least
            ):
                owner[p] = self._things[i]
                self._see(owner[p], ahead[i], frame, found[p])
                left.discard(i)
        return owner

    def _is_fresh(self, i: int, frame: int) -> bool:
        return frame - self._things[i].frame <= UNSURE_FRAMES

    def _shared(self, i: int, ahead: BoxState, d: Detection) -> float:
        return overlap(ahead.box, d.box) if d.name == self._things[i].name else 0.0

    def _see(self, thing: _Thing, ahead: BoxState, frame: int, d: Detection) -> None:
        thing.state, thing.frame = updated(ahead, d.box), frame
        thing.odds += FOUND_AGAIN + _log_odds(d.score)

    def _told(self, thing: _Thing, d: Detection) -> Detection:
        """A box with the number of its thing, which is given one when it is told first."""
        if not thing.told:
            thing.told, self._next = self._next, self._next + 1
        return replace(d, track=thing.told)

    def _forget(self, frame: int) -> None:
        self._things = [t for t in self._things if frame - t.frame <= PATIENCE_FRAMES + 1]


def _rows(state: BoxState) -> list[Any]:
    return [a.tolist() for a in (state.place, state.speed, state.spread)]


def _is_told(thing: _Thing | None) -> bool:
    return thing is not None and (thing.told > 0 or thing.odds > 0)


def _log_odds(score: float) -> float:
    sure = min(max(score, 0.02), 0.98)
    return log(sure / (1 - sure))


def _pairs(
    rows: Sequence[int],
    columns: Sequence[int],
    shared: Callable[[int, int], float],
    least: float,
) -> list[tuple[int, int]]:
    """Rows and columns that belong together: those that share the most in all, each pair at least so much."""
    if not (rows and columns):
        return []
    table = np.array([[shared(r, c) for c in columns] for r in rows])
    table[table < least] = 0.0
    chosen = zip(*linear_sum_assignment(table, maximize=True), strict=True)
    return [(rows[i], columns[j]) for i, j in chosen if table[i, j] > 0]
