"""Relative depth from size: the distance at which a model would appear as large as its region.

The paper compares the area of a region with the dimensions of its presumed model (section 7.4). With a focal
length of f pixels, a silhouette of `real` model units squared at depth d covers ``real * (f / d) ** 2``
pixels. An error in the field of view scales all depths alike, so nearer and farther, approaching and receding
remain correct.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import cv2
from scipy.spatial.distance import pdist

from visup.agent.contract.behaviour import Contract
from visup.agent.contract.saving import Stateless
from visup.agent.model.errors import SettingsError
from visup.agent.model.events import Directive
from visup.agent.model.records import Depth, Frame, Hypothesis, Observation, Percept, Region
from visup.percepts.shape.database.model_database import ModelDatabase

FOV_VERTICAL_DEG = 40.0
"""Vertical field of view assumed by default."""

NEAR_BEST = 0.08
"""Views less similar than the best by more than this are ignored for the size."""

MIN_RELATIVE_SIGMA = 0.03
"""Least relative error: even a perfect match is limited by the set of views and the pixel grid."""


class DepthBehaviour(Stateless):
    """Reports the depth of each uncut region under each of its possible identities.

    Args:
        database: Source of real areas for hypotheses without a scale; may be None.
        fov_vertical_deg: Vertical field of view, degrees; 40 is assumed when None.
        sizes_m: Model name -> its measured largest extent, metres; takes precedence over the size of the
            model in the database.

    Raises:
        SettingsError: The field of view is not between 0 and 180 degrees.
    """

    contract = Contract("depth", gives=("depth",), needs=("region", "hypothesis"))

    def __init__(
        self,
        database: ModelDatabase | None = None,
        fov_vertical_deg: float | None = None,
        sizes_m: Mapping[str, float] = MappingProxyType({}),
    ) -> None:
        self.fov_vertical_deg = FOV_VERTICAL_DEG if fov_vertical_deg is None else fov_vertical_deg
        if not 0.0 < self.fov_vertical_deg < 180.0:
            raise SettingsError(
                f"the vertical field of view is {self.fov_vertical_deg:g} degrees",
                expected="more than 0 and less than 180",
            )
        views = database.views if database is not None else ()
        self._areas = {(v.name, v.number): v.area for v in views if v.area is not None}
        known = extents(database, sizes_m) if database is not None else {}
        self._enlarged = {n: sizes_m[n] / extent for n, extent in known.items()}

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        """One depth for each region not cut by the border and each of its possible names."""
        focal = focal_px(frame.size[1], self.fov_vertical_deg)
        hypotheses: tuple[Hypothesis, ...] = observation.of("hypothesis")
        for region in observation.of("region"):
            if not region.cut and region.area > 0:
                own = [h for h in hypotheses if h.region_id == region.id]
                for depth in region_depths(region, own, focal, self._areas):
                    by = self._enlarged.get(depth.name, 1.0)
                    if by != 1.0:  # an object twice as large looks the same from twice the distance
                        depth = replace(depth, depth=depth.depth * by, sigma=depth.sigma * by)
                    yield Percept("depth", depth, frame.time, self.contract.name)


def extents(database: ModelDatabase, names: Collection[str]) -> dict[str, float]:
    """The largest extent of some models over all their views, in model units.

    Models of unknown size, or missing from the database, are left out.
    """
    found: dict[str, float] = {}
    for number, view in enumerate(database.views):
        if view.name in names and view.area is not None and not view.cut:
            contour = database.shapes[number].contour
            area = abs(float(cv2.contourArea(contour)))
            if area > 0:
                extent = float(pdist(contour).max()) * math.sqrt(view.area / area)
                found[view.name] = max(found.get(view.name, 0.0), extent)
    return found


def focal_px(height: int, fov_vertical_deg: float) -> float:
    """Focal length in pixels, from the image height and the vertical field of view.

    Example:
        >>> focal_px(480, 90.0)
        240.0
    """
    return round(height / 2 / math.tan(math.radians(fov_vertical_deg) / 2), 9)


def region_depths(
    region: Region,
    hypotheses: Sequence[Hypothesis],
    focal: float,
    areas: Mapping[tuple[str, int], float],
) -> list[Depth]:
    """Depths of one region, one for each name of known size.

    Args:
        region: The region, uncut.
        hypotheses: Its hypotheses.
        focal: Focal length, pixels.
        areas: (name, view) -> real area, model units squared.

    Returns:
        In the order in which the names first appear. Sigma combines the disagreement of a name's best views
        on size, weighted by similarity, with the best view's misfit.
    """
    by_name: dict[str, list[tuple[float, float]]] = {}
    for h in hypotheses:
        scale = h.scale if h.scale is not None else _scale(region, areas.get((h.name, h.view)))
        if scale is not None and scale > 0:
            by_name.setdefault(h.name, []).append((h.similarity, focal / scale))
    return [_depth(region.id, name, found) for name, found in by_name.items()]


def _scale(region: Region, area: float | None) -> float | None:
    return None if area is None else math.sqrt(region.area / area)


def _depth(region_id: int, name: str, found: Sequence[tuple[float, float]]) -> Depth:
    """The depth from the best view, and its sigma; `found` holds (similarity, depth)."""
    best, depth = max(found)
    near = [(s, d) for s, d in found if s >= best - NEAR_BEST]
    total = sum(s for s, _ in near)
    spread = math.sqrt(sum(s * (d - depth) ** 2 for s, d in near) / total) if total > 0 else 0.0
    relative = MIN_RELATIVE_SIGMA + 0.2 * (1 - best)
    return Depth(region_id, name, depth, math.hypot(spread, relative * depth))
