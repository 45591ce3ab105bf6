"""Boxes in frames, and their overlap."""

from __future__ import annotations

from dataclasses import dataclass

Box = tuple[float, float, float, float]
"""(x, y, width, height), pixels, y down."""


@dataclass(frozen=True, slots=True)
class Detection:
    """One box in one frame.

    Attributes:
        track: Track number, the same from frame to frame, from 1; 0 where unassigned.
        box: (x, y, width, height), pixels.
        score: Score of the detector, 0 to 1.
        name: Name of its class, or None.
    """

    track: int
    box: Box
    score: float = 1.0
    name: str | None = None


def intersection_over_union(a: Box, b: Box) -> float:
    """Intersection over union, 0 to 1.

    >>> intersection_over_union((0, 0, 10, 10), (5, 0, 10, 10)) == 50 / 150
    True
    """
    width = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    height = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(0.0, width) * max(0.0, height)
    union = a[2] * a[3] + b[2] * b[3] - both
    return both / union if union > 0 else 0.0
