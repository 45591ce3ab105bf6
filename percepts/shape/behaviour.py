"""The shape behaviour: view hypotheses for each region from its silhouette (paper, sections 4 and 5).

Regions are matched against the database, but not in every frame: a region whose silhouette hardly changed, or
that was matched recently, keeps its hypotheses, and the number of matches per frame is bounded.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent.contract.behaviour import Contract
from visup.agent.contract.contract import COMPILING_HANG_S
from visup.agent.model.events import Directive
from visup.agent.model.records import Frame, Hypothesis, Observation, Percept, Region
from visup.percepts.shape.database.model_database import ModelDatabase, ViewMatch
from visup.percepts.shape.refinement.pose_refiner import PoseRefiner, SizedHypothesis
from visup.percepts.shape.silhouette.silhouette import Silhouette, normalise

_THUMBNAIL_SIDE = 48


@dataclass(frozen=True, slots=True)
class ShapeSettings:
    """How regions are matched.

    Attributes:
        threshold: Similarity above which a view is a hypothesis.
        most: Hypotheses for each region at most.
        per_name: Of these, views of one model at most.
        every_s: Least seconds of video between two matches of a region.
        renew_s: Seconds after which even an unchanged silhouette is matched again.
        unchanged: Overlap (IoU) with the silhouette last matched above which it counts as unchanged.
        matches_per_frame: Regions matched in one frame at most; the others wait their turn.
        budget: Share of the database's views that one match may compare in full.
        budget_ms: Milliseconds for the matches of one frame together; see `ModelDatabase.query_all`.
    """

    threshold: float = 0.4
    most: int = 8
    per_name: int = 3
    every_s: float = 0.2
    renew_s: float = 2.0
    unchanged: float = 0.97
    matches_per_frame: int = 2
    budget: float = 0.1
    budget_ms: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _MatchedRegion:
    """A region's silhouette when it was last matched, and the result; when its surface was last followed."""

    time: float
    thumbnail: NDArray[np.bool_]
    aspect: float
    cut: bool
    restrict: frozenset[str] | None
    hypotheses: tuple[Hypothesis, ...]
    areas: tuple[float | None, ...]
    followed: float

    def rescaled(self, region: Region) -> Iterable[Hypothesis]:
        """The hypotheses with the region's current scale."""
        for hypothesis, area in zip(self.hypotheses, self.areas, strict=True):
            yield _scaled(hypothesis, area, region)


class ShapeBehaviour:
    """Reports which views of which models each region looks like.

    Args:
        database: The models; without them nothing is reported.
        settings: How regions are matched.
    """

    contract = Contract("shape", gives=("hypothesis",), needs=("region",), hang_s=COMPILING_HANG_S)

    def __init__(
        self, database: ModelDatabase | None = None, settings: ShapeSettings | None = None
    ) -> None:
        self.database = database
        self.settings = settings or ShapeSettings()
        self._last_matches: dict[int, _MatchedRegion] = {}
        self._refiner = PoseRefiner(database.meshes if database is not None else {})

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far; see `visup.agent.storage.checkpoint`."""
        return {"remembered": self._last_matches, "fits": self._refiner.memory}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a behaviour with the same settings."""
        self._last_matches = dict(state["remembered"])
        self._refiner.memory = dict(state["fits"])

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """Hypotheses for all regions of a frame, the best of each region first.

        Args:
            frame: The frame; its time and its size are used.
            observation: Holds the regions.
            directives: 'restrict' (data: names) lets only these models be considered; 'try_first'
                (data: names) compares these regardless of the index; 'rest' (data: behaviour,
                region, every_s) limits how often a region is matched.
        """
        if self.database is None:
            return []
        regions: tuple[Region, ...] = observation.of("region")
        restrict, try_first = _name_directives(directives)
        visible_ids = {r.id for r in regions}
        self._last_matches = {k: v for k, v in self._last_matches.items() if k in visible_ids}
        due = self._due(
            regions, frame.time, restrict, _rest_intervals(directives, self.contract.name)
        )
        self._refiner.forget(visible_ids)
        found = self._match(self.database, due, frame, restrict, try_first)
        for region, silhouette, matches in zip(due, *found, strict=True):
            hypotheses = self._refined(self.database, frame, region, silhouette, matches)
            self._last_matches[region.id] = _matched_region(
                region, frame.time, restrict, hypotheses
            )
        self._follow(frame, regions)
        return [
            Percept("hypothesis", h, frame.time, self.contract.name, h.similarity)
            for r in regions
            if r.id in self._last_matches
            for h in self._last_matches[r.id].rescaled(r)
        ]

    def _follow(self, frame: Frame, regions: Sequence[Region]) -> None:
        """Renew orientations from the motion of surfaces where silhouettes are not matched again."""
        for region in regions:
            old = self._last_matches.get(region.id)
            if old is None or frame.time - old.followed < self.settings.every_s - 1e-6:
                continue
            known = tuple(zip(old.hypotheses, old.areas, strict=True))
            found = self._refiner.followed(frame, region, known) or known
            hypotheses, areas = tuple(h for h, _ in found), tuple(area for _, area in found)
            self._last_matches[region.id] = replace(
                old, followed=frame.time, hypotheses=hypotheses, areas=areas
            )

    def _due(
        self,
        regions: Sequence[Region],
        time: float,
        restrict: frozenset[str] | None,
        least_intervals: Mapping[int, float],
    ) -> list[Region]:
        """Regions to match now: those never matched first, then those matched longest ago."""
        due = [
            r for r in regions if self._is_due(r, time, restrict, least_intervals.get(r.id, 0.0))
        ]
        last = {k: v.time for k, v in self._last_matches.items()}
        due.sort(key=lambda r: (last.get(r.id, -np.inf), r.id))
        return due[: self.settings.matches_per_frame]

    def _is_due(
        self, region: Region, time: float, restrict: frozenset[str] | None, least_interval_s: float
    ) -> bool:
        old = self._last_matches.get(region.id)
        if old is None or old.restrict != restrict or time < old.time:
            return True
        since = time - old.time
        if since < max(self.settings.every_s, least_interval_s) - 1e-6:
            return False
        return since >= self.settings.renew_s or not self._unchanged(old, region)

    def _unchanged(self, old: _MatchedRegion, region: Region) -> bool:
        stretch = _aspect(region) / old.aspect
        if (
            old.cut != region.cut
            or not self.settings.unchanged < stretch < 1 / self.settings.unchanged
        ):
            return False
        thumbnail = _thumbnail(region)
        union = np.count_nonzero(thumbnail | old.thumbnail)
        return bool(np.count_nonzero(thumbnail & old.thumbnail) >= self.settings.unchanged * union)

    def _match(
        self,
        database: ModelDatabase,
        regions: Sequence[Region],
        frame: Frame,
        restrict: frozenset[str] | None,
        try_first: Collection[str],
    ) -> tuple[list[Silhouette | None], list[tuple[ViewMatch, ...]]]:
        """Silhouettes of the regions and their matches; None and no matches without a shape."""
        silhouettes = [normalise(r.mask, cut=r.cut, sides=_border_sides(r, frame)) for r in regions]
        rankings = iter(
            database.query_all(
                [s for s in silhouettes if s is not None],
                budget_ms=self.settings.budget_ms,
                top=self.settings.most,
                per_name=self.settings.per_name,
                threshold=self.settings.threshold,
                restrict=restrict,
                try_first=try_first,
                budget=self.settings.budget,
            )
        )
        return silhouettes, [() if s is None else next(rankings).matches for s in silhouettes]

    def _refined(
        self,
        database: ModelDatabase,
        frame: Frame,
        region: Region,
        silhouette: Silhouette | None,
        matches: tuple[ViewMatch, ...],
    ) -> tuple[SizedHypothesis, ...]:
        """Hypotheses of a region, with fitted orientations where the model has a mesh."""
        hypotheses = [(_hypothesis(region, m), m.view.area) for m in matches]
        if silhouette is None or not self._refiner.meshes:
            return tuple(hypotheses)

        def further_views(name: str) -> list[SizedHypothesis]:
            # A view may be stored in two forms, of which one start is made.
            wanted = 2 * self._refiner.settings.starts
            found = database.query(silhouette, top=wanted, restrict={name})
            return [(_hypothesis(region, m), m.view.area) for m in found.matches]

        return self._refiner.refined(frame, region, hypotheses, further_views)


def _matched_region(
    region: Region,
    time: float,
    restrict: frozenset[str] | None,
    hypotheses: tuple[SizedHypothesis, ...],
) -> _MatchedRegion:
    return _MatchedRegion(
        time=time,
        thumbnail=_thumbnail(region),
        aspect=_aspect(region),
        cut=region.cut,
        restrict=restrict,
        hypotheses=tuple(h for h, _ in hypotheses),
        areas=tuple(area for _, area in hypotheses),
        followed=time,
    )


def _border_sides(region: Region, frame: Frame) -> tuple[str, ...]:
    """Sides of a region's box that lie on the image border."""
    x, y, w, h = region.bbox
    height, width = frame.image.shape[:2]
    touches = {"right": x + w >= width, "bottom": y + h >= height, "left": x <= 0, "top": y <= 0}
    return tuple(side for side, touching in touches.items() if touching)


def _aspect(region: Region) -> float:
    return region.bbox[2] / region.bbox[3]


def _thumbnail(region: Region) -> NDArray[np.bool_]:
    """The region's mask resized to a small square."""
    small = cv2.resize(
        region.mask.astype(np.uint8) * np.uint8(255),
        (_THUMBNAIL_SIDE, _THUMBNAIL_SIDE),
        interpolation=cv2.INTER_AREA,
    )
    return np.asarray(small > 127)


def _rest_intervals(directives: Sequence[Directive], behaviour: str) -> dict[int, float]:
    """Regions to match less often: id -> least seconds between two matches."""
    return {
        d.data["region"]: float(d.data["every_s"])
        for d in directives
        if d.kind == "rest" and d.data.get("behaviour") == behaviour
    }


def _name_directives(
    directives: Sequence[Directive],
) -> tuple[frozenset[str] | None, frozenset[str]]:
    """The names to consider exclusively (None for all), and the names to try first."""
    restrict = [frozenset(d.data.get("names", ())) for d in directives if d.kind == "restrict"]
    try_first = [frozenset(d.data.get("names", ())) for d in directives if d.kind == "try_first"]
    allowed = frozenset().union(*restrict) if restrict else None
    return allowed, frozenset().union(*try_first)


def _hypothesis(region: Region, match: ViewMatch) -> Hypothesis:
    """A match as a hypothesis; its scale is added in each frame, from the region's current size."""
    view = match.view
    return Hypothesis(
        region_id=region.id,
        name=view.name,
        view=view.number,
        similarity=match.similarity,
        rotation=match.rotation,
        direction=match.direction,
    )


def _scaled(hypothesis: Hypothesis, area: float | None, region: Region) -> Hypothesis:
    """With region pixels per model unit; unknown where the border hides part of the area."""
    if area is None or region.cut:
        return hypothesis
    return replace(hypothesis, scale=float((region.area / area) ** 0.5))
