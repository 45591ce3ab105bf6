"""Numbers for boxes that a detector found frame by frame: the same thing keeps its number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from visup.percepts.detections.boxes import Box, Detection, overlap

LEAST_OVERLAP = 0.2
"""A box goes on as another when they share so much of their union. At a tenth neighbours in a queue change
numbers, at a half what runs loses its own."""

PATIENCE_FRAMES = 10
"""What was not found for more frames than that gets a new number when it is found again."""


@dataclass(slots=True)
class _Numbered:
    """The last box that had a number, and how it moved, pixels a frame."""

    box: Box
    name: str | None
    frame: int
    motion: tuple[float, float] = (0.0, 0.0)

    def expected(self, frame: int) -> Box:
        x, y, w, h = self.box
        later = frame - self.frame
        return (x + later * self.motion[0], y + later * self.motion[1], w, h)


@dataclass(slots=True)
class BoxNumbering:
    """Numbers boxes from frame to frame, each where a thing that goes on as it went would be.

    Boxes are assigned to numbers so that they overlap the most in all (Kuhn 1955), as in SORT (Bewley et
    al. 2016) without its filter. It costs what that costs: two things of one kind that hide each other may
    change numbers. A tracker that looks at the picture does better; its numbers are kept as they are.
    """

    _known: dict[int, _Numbered] = field(default_factory=dict)
    _next: int = 1

    def number(self, frame: int, found: Sequence[Detection]) -> tuple[Detection, ...]:
        """The boxes of a frame, each with its number.

        Args:
            frame: Index of the frame; it grows from call to call.
            found: Its boxes. If any of them has a number, all are given back as they are.
        """
        if any(d.track for d in found):
            return tuple(found)
        self._forget(frame)
        tracks = self._assigned(frame, found)
        numbered = []
        for place, detection in enumerate(found):
            track = tracks.get(place) or self._fresh()
            self._see(track, frame, detection)
            numbered.append(replace(detection, track=track))
        return tuple(numbered)

    def save(self) -> Mapping[str, Any]:
        """What must be remembered to go on, as plain values."""
        known = {i: [list(k.box), k.name, k.frame, list(k.motion)] for i, k in self._known.items()}
        return {"known": known, "next": self._next}

    def load(self, state: Mapping[str, Any]) -> None:
        """Take on what another numbering remembered."""
        self._next = int(state["next"])
        self._known = {
            int(i): _Numbered(tuple(box), name, int(frame), tuple(motion))
            for i, (box, name, frame, motion) in state["known"].items()
        }

    def _assigned(self, frame: int, found: Sequence[Detection]) -> dict[int, int]:
        """Place of a box -> its number, for those that go on."""
        tracks = sorted(self._known)
        if not (tracks and found):
            return {}
        shared = self._overlaps(frame, found, tracks)
        rows, columns = linear_sum_assignment(shared, maximize=True)
        pairs = zip(rows.tolist(), columns.tolist(), strict=True)
        return {r: tracks[c] for r, c in pairs if shared[r, c] >= LEAST_OVERLAP}

    def _overlaps(
        self, frame: int, found: Sequence[Detection], tracks: Sequence[int]
    ) -> NDArray[np.float64]:
        """(boxes, numbers): how far each box lies where each number is expected; names must agree."""
        known = [self._known[t] for t in tracks]
        return np.array(
            [
                [overlap(d.box, k.expected(frame)) if d.name == k.name else 0.0 for k in known]
                for d in found
            ]
        )

    def _see(self, track: int, frame: int, detection: Detection) -> None:
        before = self._known.get(track)
        motion = (0.0, 0.0)
        if before is not None and frame > before.frame:
            steps = frame - before.frame
            motion = tuple(
                (now + side / 2 - then - past / 2) / steps
                for now, side, then, past in zip(
                    detection.box[:2],
                    detection.box[2:],
                    before.box[:2],
                    before.box[2:],
                    strict=True,
                )
            )  # type: ignore[assignment]  # of two places
        self._known[track] = _Numbered(detection.box, detection.name, frame, motion)

    def _forget(self, frame: int) -> None:
        self._known = {
            i: k for i, k in self._known.items() if frame - k.frame <= PATIENCE_FRAMES + 1
        }

    def _fresh(self) -> int:
        self._next += 1
        return self._next - 1
