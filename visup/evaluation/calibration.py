"""Calibration of confidences: reliability and expected calibration error.

Of all statements with 80 % confidence, 80 % should be correct. Confidences are binned; the error is the mean
difference between a bin's accuracy and its mean confidence, weighted by its size
(Naeini, Cooper and Hauskrecht, "Obtaining Well Calibrated Probabilities Using Bayesian Binning", 2015).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

BINS = 10

Counts = list[list[float]]
"""For each bin: count, sum of confidences, number of correct statements."""


@dataclass(slots=True)
class Calibration:
    """Counts of statements by confidence."""

    _bins: Counts = field(default_factory=lambda: [[0.0, 0.0, 0.0] for _ in range(BINS)])

    def add(self, confidence: float, correct: bool) -> None:
        """Count one statement; `confidence` is 0 to 1."""
        row = self._bins[min(BINS - 1, max(0, int(confidence * BINS)))]
        row[0] += 1
        row[1] += confidence
        row[2] += correct

    def join(self, counts: Sequence[Sequence[float]]) -> None:
        """Add the counts of another calibration."""
        for row, other in zip(self._bins, counts, strict=True):
            for k, value in enumerate(other):
                row[k] += value

    def counts(self) -> Counts:
        """The counts, for `join`."""
        return [list(row) for row in self._bins]

    def error(self) -> float | None:
        """Expected calibration error, 0 to 1, or None without counts."""
        total = sum(count for count, _, _ in self._bins)
        return (
            sum(abs(expected - correct) for _, expected, correct in self._bins) / total
            if total
            else None
        )

    def table(self) -> list[dict[str, float]]:
        """One row for each non-empty bin: count, mean confidence, accuracy."""
        return [
            {"count": count, "confidence": expected / count, "right": correct / count}
            for count, expected, correct in self._bins
            if count
        ]
