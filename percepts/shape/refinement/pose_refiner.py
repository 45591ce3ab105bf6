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
    SAME,
    STILL,
    USUAL_FOCAL,
    PoseFit,
    apart,
    fitted_poses,
)
from visup.percepts.shape.refinement.region_image import RegionImage, region_image
from visup.percepts.shape.refinement.surface_motion import FollowedSurface, followed_surface

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
        surface: The surface, with the same orientations in an earlier image, or None where it shows
            too little.
    """

    time: float
    overlap: float
    orientations: NDArray[np.float64]
    views: tuple[int, ...]
    surface: FollowedSurface | None = None


FitMemory = Mapping[tuple[int, str], FittedModel]
"""(region, model) -> last fit."""


@dataclass(frozen=True, slots=True, eq=False)
class _KnownOrientations:
    """Orientations known before an image is searched.

    Attributes:
        orientations: (K, 3, 3).
        views: (K,) numbers of their views.
        surface: The surface by which they were followed, if it will do further.
        followed: Whether the motion of the surface told them.
    """

    orientations: NDArray[np.float64]
    views: tuple[int, ...]
    surface: FollowedSurface | None
    followed: bool

    def steadied(self, fits: Sequence[PoseFit]) -> tuple[list[PoseFit], FollowedSurface | None]:
        """Fits, those near an orientation that was followed with that in place of their own.

        A search finds an orientation again to some degrees only, which would pass for a rotation.

        Returns:
            The fits, and the surface if it tells all of their orientations.
        """
        out: dict[int, PoseFit] = {}
        for f in fits:
            near = [k for k, o in enumerate(self.orientations) if apart(f.orientation, o) < SAME]
            if not near:
                out[len(self.orientations) + f.start] = f
            elif near[0] not in out:
                still = self.orientations[near[0]]
                out[near[0]] = replace(f, orientation=still, start=near[0])
        told = all(k < len(self.orientations) for k in out)
        return list(out.values()), self.surface if told else None


@dataclass(frozen=True, slots=True, eq=False)
class _FittedImage:
    """What a fit is stored with: the image, the hypothesis; time and overlap of the last full search."""

    frame: Frame
    region: Region
    image: RegionImage
    best: Hypothesis
    time: float
    overlap: float


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
        image = region_image(frame, region)
        out = [(h, area) for h, area in hypotheses if h.name not in names]
        for name in names:
            own = [(h, area) for h, area in hypotheses if h.name == name]
            out += self._fitted(frame, region, image, own, more) or own
        return tuple(sorted(out, key=lambda sized: -sized[0].similarity))

    def _names(self, hypotheses: Sequence[SizedHypothesis]) -> list[str]:
        known = (h.name for h, _ in hypotheses if h.name in self.meshes and h.direction is not None)
        return list(dict.fromkeys(known))[: self.settings.names]

    def _fitted(
        self,
        frame: Frame,
        region: Region,
        image: RegionImage,
        own: Sequence[SizedHypothesis],
        more: MoreViews,
    ) -> list[SizedHypothesis]:
        """Hypotheses of one model with fitted orientations; none if it does not fit."""
        best = own[0][0]
        before = self.memory.get((region.id, best.name))
        known = self._known(frame, region, before)
        if known is not None and before is not None:
            found = self._kept(frame, region, image, best, before, known)
            if found:
                return found
        return self._searched(frame, region, image, own, more, known)

    def followed(
        self, frame: Frame, region: Region, hypotheses: Sequence[SizedHypothesis]
    ) -> tuple[SizedHypothesis, ...] | None:
        """Hypotheses with the orientations that the motion of the surface tells; None where it tells none."""
        fitted = [h for h, _ in hypotheses if h.fitted]
        if region.cut or not fitted:
            return None
        best = max(fitted, key=lambda h: h.similarity)
        before = self.memory.get((region.id, best.name))
        known = self._known(frame, region, before)
        if before is None or known is None or not known.followed:
            return None
        found = self._kept(frame, region, region_image(frame, region), best, before, known)
        if not found:
            return None
        rest = [(h, area) for h, area in hypotheses if h.name != best.name]
        return tuple(sorted([*found, *rest], key=lambda sized: -sized[0].similarity))

    def _known(
        self, frame: Frame, region: Region, before: FittedModel | None
    ) -> _KnownOrientations | None:
        """The orientations known of a body: as its surface has turned, else as they were."""
        if before is None:
            return None
        if before.surface is not None:
            numbers, now = before.surface.turned(frame, region)
            if len(numbers):
                worn = before.surface.is_worn(numbers, now)
                views = tuple(before.views[k] for k in numbers)
                return _KnownOrientations(now, views, None if worn else before.surface, True)
        return _KnownOrientations(before.orientations, before.views, None, False)

    def _kept(
        self,
        frame: Frame,
        region: Region,
        image: RegionImage,
        best: Hypothesis,
        before: FittedModel,
        known: _KnownOrientations,
    ) -> list[SizedHypothesis]:
        """The known orientations, if they are recent and still fit."""
        s = self.settings
        if frame.time - before.time >= s.renew_s:
            return []
        steps = STILL if known.followed else FINE
        fits = self._search(frame, best.name, image, list(known.orientations), steps)
        if not fits or fits[0].overlap < before.overlap - s.lost:
            return []
        at = _FittedImage(frame, region, image, best, before.time, before.overlap)
        return self._stored(at, fits, known.views, known.surface)

    def _searched(
        self,
        frame: Frame,
        region: Region,
        image: RegionImage,
        own: Sequence[SizedHypothesis],
        more: MoreViews,
        known: _KnownOrientations | None,
    ) -> list[SizedHypothesis]:
        """A full search from the views of a model and from what was known; empty if nothing fits."""
        s, best = self.settings, own[0][0]
        wide = _orientations([h for h, _ in [*own, *more(best.name)]])[: s.starts]
        starts = [turn for _, turn in wide]
        numbers = tuple(view for view, _ in wide)
        if known is not None:
            starts, numbers = [*known.orientations, *starts], (*known.views, *numbers)
        fits = self._search(frame, best.name, image, starts, COARSE)
        if not fits or fits[0].overlap < s.least_overlap:
            self.memory.pop((region.id, best.name), None)
            return []
        overlap, surface = fits[0].overlap, None
        if known is not None and known.followed:
            fits, surface = known.steadied(fits)
            first = [fits[0].orientation]
            overlap = self._search(frame, best.name, image, first, STILL)[0].overlap
        at = _FittedImage(frame, region, image, best, frame.time, overlap)
        return self._stored(at, fits, numbers, surface)

    def _search(
        self,
        frame: Frame,
        name: str,
        image: RegionImage,
        starts: Sequence[NDArray[np.float64]],
        steps: NDArray[np.float64],
    ) -> list[PoseFit]:
        focal = USUAL_FOCAL * frame.size[0]
        mesh, kept = self.meshes[name], self.settings.kept
        fits = fitted_poses(mesh, image, starts, steps=steps, focal_px=focal)[:kept]
        if steps is not COARSE:
            return fits
        near = [f.orientation for f in fits]
        fine = fitted_poses(mesh, image, near, steps=FINE, focal_px=focal)
        return [replace(f, start=fits[f.start].start) for f in fine]

    def _stored(
        self,
        at: _FittedImage,
        fits: Sequence[PoseFit],
        numbers: Sequence[int],
        surface: FollowedSurface | None,
    ) -> list[SizedHypothesis]:
        """Store the fits and return them as hypotheses; without a surface, a new one is followed from now."""
        turns = np.stack([f.orientation for f in fits])
        chosen = tuple(numbers[f.start] for f in fits)
        best, key = at.best, (at.region.id, at.best.name)
        starts = [f.start for f in fits]
        if surface is None or sorted(starts) != list(range(len(surface.orientations))):
            focal = USUAL_FOCAL * at.frame.size[0]
            mesh = self.meshes[best.name]
            surface = followed_surface(at.frame, at.region, mesh, at.image, turns, focal)
        else:
            surface = surface.ordered(starts)
        self.memory[key] = FittedModel(at.time, at.overlap, turns, chosen, surface)
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
