"""Matches the regions of two chunks over the frames that both processed, and renumbers percepts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import Any

from visup.agent import Depth, Hypothesis, Observation, Percept, Region
from visup.agent.model.fast_replace import replace
from visup.rules.geometry.regions import shared_pixels

MIN_OVERLAP = 0.5
"""Least IoU, over all frames with both regions, at which they are the same."""


class RegionMatcher:
    """Matches the regions of two observers of the same frames."""

    def __init__(self) -> None:
        self._shared: Counter[tuple[int, int]] = Counter()
        self._union: Counter[tuple[int, int]] = Counter()

    def add(self, before: Iterable[Region], after: Iterable[Region]) -> None:
        """Add one frame.

        Args:
            before: Regions of the observer whose ids are retained.
            after: Regions of the other observer.
        """
        for a, b in product(before, after):
            both = shared_pixels(a, b)
            self._shared[a.id, b.id] += both
            self._union[a.id, b.id] += int(a.area + b.area) - both

    def same(self) -> dict[int, int]:
        """Ids of the other observer -> retained ids, one to one, matched greedily by overlap."""
        overlaps = {p: n / self._union[p] for p, n in self._shared.items() if n}
        best = sorted(overlaps, key=lambda p: (-overlaps[p], p))
        found: dict[int, int] = {}
        for old, new in best:
            is_free = new not in found and old not in found.values()
            if is_free and overlaps[old, new] >= MIN_OVERLAP:
                found[new] = old
        return found


@dataclass(slots=True)
class RegionNumbers:
    """The ids of one chunk's regions in the whole run.

    Attributes:
        known: Id in the chunk -> id in the run.
        last: The highest id assigned in the run so far.
        since: Id in the run -> since when it has been in view, by the first chunk that saw it.
    """

    known: dict[int, int] = field(default_factory=dict)
    last: int = 0
    since: dict[int, float | None] = field(default_factory=dict)

    def renumbered(self, observation: Observation) -> Observation:
        """The same observation with the ids of the run; new regions get new ids."""
        reports = tuple(
            replace(report, percepts=tuple(map(self._percept, report.percepts)))
            for report in observation.reports
        )
        return replace(observation, reports=reports)

    def _id(self, region: int) -> int:
        if region not in self.known:
            self.last += 1
            self.known[region] = self.last
        return self.known[region]

    def _percept(self, percept: Percept) -> Percept:
        return replace(percept, value=self._value(percept.value))

    def _value(self, value: Any) -> Any:
        if isinstance(value, Region):
            number = self._id(value.id)
            since = self.since.setdefault(number, value.visible_since)
            return replace(value, id=number, visible_since=since)
        if isinstance(value, Hypothesis | Depth):
            return replace(value, region_id=self._id(value.region_id))
        if isinstance(value, Mapping) and isinstance(value.get("region_id"), int):
            return {**value, "region_id": self._id(value["region_id"])}
        return value
