"""Refinement of view hypotheses: orientations fitted to the image replace those of stored views."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.orientation import orientations, views
from visup.agent.model.records import Frame, Hypothesis, Region
from visup.percepts.shape.index.view_records import Direction
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.refinement.pose_fit import (
    COARSE,
    FINE,
    USUAL_FOCAL,
    PoseFit,
    fitted_poses,
)
from visup.percepts.shape.refinement.region_picture import RegionPicture, region_picture

SizedHypothesis = tuple[Hypothesis, float | None]
"""A hypothesis with the area of its silhouette, model units squared, where known."""

MoreViews = Callable[[str], Sequence[SizedHypothesis]]
"""Returns further matching views of one model, best first."""


@dataclass(frozen=True, slots=True)
class RefinerSettings:
    """How orientations are fitted.

    Attributes:
        names: Models fitted for each region, the most similar first.
        starts: Number of views from which a full search starts.
        kept: Orientations reported and tracked.
        renew_s: Seconds after which a full search is repeated.
        least_overlap: A fit with less overlap is rejected: the region shows a part, or something else.
        lost: Overlap lost since the last full search that triggers another.
        rank: Loss of similarity per unit of a fit's score below the best.
    """

    names: int = 1
    starts: int = 8
    kept: int = 3
    renew_s: float = 3.0
    least_overlap: float = 0.7
    lost: float = 0.05
    rank: float = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class FittedModel:
    """The last fit of a model to a region.

    Attributes:
        time: Seconds of the last full search.
        overlap: Overlap of the best fit then.
        orientations: (K, 3, 3), best first, as last fitted.
        views: (K,) numbers of the views from which each was found.
    """

    time: float
    overlap: float
    orientations: NDArray[np.float64]
    views: tuple[int, ...]


FitMemory = Mapping[tuple[int, str], FittedModel]
"""(region, model) -> last fit."""


class PoseRefiner:
    """Fits the meshes of models to regions and tracks the fits over time.

    Args:
        meshes: Meshes by the models' names.
        settings: Settings.
    """

    def __init__(
        self, meshes: Mapping[str, MeshModel], settings: RefinerSettings | None = None
    ) -> None:
        self.meshes = meshes
        self.settings = settings or RefinerSettings()
        self.memory: dict[tuple[int, str], FittedModel] = {}

    def forget(self, here: Collection[int]) -> None:
        """Drop the fits of regions that are not in view."""
        self.memory = {key: fit for key, fit in self.memory.items() if key[0] in here}

    def refined(
        self, frame: Frame, region: Region, hypotheses: Sequence[SizedHypothesis], more: MoreViews
    ) -> tuple[SizedHypothesis, ...]:
        """Hypotheses of one region, with fitted orientations for its likeliest models.

        Args:
            frame: The frame that shows it.
            region: The region; one cut by the image border is left unchanged.
            hypotheses: Hypotheses of views, best first.
            more: Called for further views in a full search.

        Returns:
            Hypotheses, best first; the similarity of the best of each model is unchanged.
        """
        names = self._names(hypotheses)
        if not names or region.cut:
            return tuple(hypotheses)
        picture = region_picture(frame, region)
        out = [(h, area) for h, area in hypotheses if h.name not in names]
        for name in names:
            own = [(h, area) for h, area in hypotheses if h.name == name]
            out += self._fitted(frame, region, picture, own, more) or own
        return tuple(sorted(out, key=lambda sized: -sized[0].similarity))

    def _names(self, hypotheses: Sequence[SizedHypothesis]) -> list[str]:
        known = (h.name for h, _ in hypotheses if h.name in self.meshes and h.direction is not None)
        return list(dict.fromkeys(known))[: self.settings.names]

    def _fitted(
        self,
        frame: Frame,
        region: Region,
        picture: RegionPicture,
        own: Sequence[SizedHypothesis],
        more: MoreViews,
    ) -> list[SizedHypothesis]:
        """Hypotheses of one model with fitted orientations; none if it does not fit."""
        s, best = self.settings, own[0][0]
        key = region.id, best.name
        before = self.memory.get(key)
        if before is not None and frame.time - before.time < s.renew_s:
            starts, numbers = list(before.orientations), before.views
            fits = self._search(frame, best.name, picture, starts, FINE)
            if fits and fits[0].overlap >= before.overlap - s.lost:
                return self._stored(key, before.time, before.overlap, fits, numbers, best)
        wide = _orientations([h for h, _ in [*own, *more(best.name)]])[: s.starts]
        starts = [turn for _, turn in wide]
        numbers = tuple(view for view, _ in wide)
        if before is not None:
            starts, numbers = [*before.orientations, *starts], (*before.views, *numbers)
        fits = self._search(frame, best.name, picture, starts, COARSE)
        if not fits or fits[0].overlap < s.least_overlap:
            self.memory.pop(key, None)
            return []
        return self._stored(key, frame.time, fits[0].overlap, fits, numbers, best)

    def _search(
        self,
        frame: Frame,
        name: str,
        picture: RegionPicture,
        starts: Sequence[NDArray[np.float64]],
        steps: NDArray[np.float64],
    ) -> list[PoseFit]:
        focal = USUAL_FOCAL * frame.size[0]
        mesh, kept = self.meshes[name], self.settings.kept
        fits = fitted_poses(mesh, picture, starts, steps=steps, focal_px=focal)[:kept]
        if steps is FINE:
            return fits
        near = [f.orientation for f in fits]
        fine = fitted_poses(mesh, picture, near, steps=FINE, focal_px=focal)
        return [replace(f, start=fits[f.start].start) for f in fine]

    def _stored(
        self,
        key: tuple[int, str],
        time: float,
        overlap: float,
        fits: Sequence[PoseFit],
        numbers: Sequence[int],
        best: Hypothesis,
    ) -> list[SizedHypothesis]:
        """Store the fits and return them as hypotheses."""
        turns = np.stack([f.orientation for f in fits])
        chosen = tuple(numbers[f.start] for f in fits)
        self.memory[key] = FittedModel(time, overlap, turns, chosen)
        directions, rotations = views(turns)
        top, rank = fits[0].worth, self.settings.rank
        return [
            (
                replace(
                    best,
                    view=view,
                    similarity=max(0.0, best.similarity - rank * (top - fit.worth)),
                    direction=(float(d[0]), float(d[1]), float(d[2])),
                    rotation=float(r),
                    fitted=True,
                ),
                fit.area,
            )
            for fit, view, d, r in zip(fits, chosen, directions, rotations, strict=True)
        ]


def _orientations(hypotheses: Sequence[Hypothesis]) -> list[tuple[int, NDArray[np.float64]]]:
    """(view, orientation) of each direction that is known, once: a view may be stored in two forms."""
    once: dict[Direction, tuple[int, NDArray[np.float64]]] = {}
    for h in hypotheses:
        if h.direction is not None and h.rotation is not None and h.direction not in once:
            once[h.direction] = (h.view, orientations(h.direction, h.rotation))
    return list(once.values())
