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
    COARSE_STEPS,
    FINE_STEPS,
    NO_STEPS,
    SAME_ORIENTATION,
    USUAL_FOCAL,
    PoseFit,
    fitted_poses,
    rotation_angle_between,
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
        most_orientations: Orientations reported and tracked.
        renew_s: Seconds after which a full search is repeated.
        least_overlap: A fit with less overlap is rejected: the region shows a part, or something else.
        most_overlap_loss: Overlap lost since the last full search that triggers another.
        similarity_loss: Loss of similarity per unit of a fit's score below the best.
    """

    names: int = 1
    starts: int = 8
    most_orientations: int = 3
    renew_s: float = 3.0
    least_overlap: float = 0.7
    most_overlap_loss: float = 0.05
    similarity_loss: float = 1.5


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
        surface: The surface by which they were followed, if it can still be used.
        followed: Whether they come from the motion of the surface.
    """

    orientations: NDArray[np.float64]
    views: tuple[int, ...]
    surface: FollowedSurface | None
    followed: bool

    def with_followed_orientations(
        self, fits: Sequence[PoseFit]
    ) -> tuple[list[PoseFit], FollowedSurface | None]:
        """Fits in which orientations near a followed one are replaced by it.

        A search finds the same orientation to a few degrees only, which would pass for a rotation.

        Returns:
            The fits, and the surface if all of their orientations were followed.
        """
        fits_by_orientation: dict[int, PoseFit] = {}
        for f in fits:
            near = [
                k
                for k, o in enumerate(self.orientations)
                if rotation_angle_between(f.orientation, o) < SAME_ORIENTATION
            ]
            if not near:
                fits_by_orientation[len(self.orientations) + f.start] = f
            elif near[0] not in fits_by_orientation:
                followed_orientation = self.orientations[near[0]]
                fits_by_orientation[near[0]] = replace(
                    f, orientation=followed_orientation, start=near[0]
                )
        all_followed = all(k < len(self.orientations) for k in fits_by_orientation)
        return list(fits_by_orientation.values()), self.surface if all_followed else None


@dataclass(frozen=True, slots=True, eq=False)
class _FittedImage:
    """The image and hypothesis of a fit, with time and overlap of the last full search."""

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

    def forget(self, visible_ids: Collection[int]) -> None:
        """Drop the fits of regions that are not in view."""
        self.memory = {key: fit for key, fit in self.memory.items() if key[0] in visible_ids}

    def refined(
        self,
        frame: Frame,
        region: Region,
        hypotheses: Sequence[SizedHypothesis],
        more_views: MoreViews,
    ) -> tuple[SizedHypothesis, ...]:
        """Hypotheses of one region, with fitted orientations for its likeliest models.

        Args:
            frame: The frame that shows it.
            region: The region; one cut by the image border is left unchanged.
            hypotheses: Hypotheses of views, best first.
            more_views: Called for further views in a full search.

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
            out += self._fitted(frame, region, image, own, more_views) or own
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
        more_views: MoreViews,
    ) -> list[SizedHypothesis]:
        """Hypotheses of one model with fitted orientations; none if it does not fit."""
        best = own[0][0]
        before = self.memory.get((region.id, best.name))
        known = self._known_orientations(frame, region, before)
        if known is not None and before is not None:
            found = self._still_fitting(frame, region, image, best, before, known)
            if found:
                return found
        return self._full_search(frame, region, image, own, more_views, known)

    def followed(
        self, frame: Frame, region: Region, hypotheses: Sequence[SizedHypothesis]
    ) -> tuple[SizedHypothesis, ...] | None:
        """Hypotheses with orientations from the motion of the surface; None if it yields none."""
        fitted = [h for h, _ in hypotheses if h.fitted]
        if region.cut or not fitted:
            return None
        best = max(fitted, key=lambda h: h.similarity)
        before = self.memory.get((region.id, best.name))
        known = self._known_orientations(frame, region, before)
        if before is None or known is None or not known.followed:
            return None
        found = self._still_fitting(frame, region, region_image(frame, region), best, before, known)
        if not found:
            return None
        rest = [(h, area) for h, area in hypotheses if h.name != best.name]
        return tuple(sorted([*found, *rest], key=lambda sized: -sized[0].similarity))

    def _known_orientations(
        self, frame: Frame, region: Region, before: FittedModel | None
    ) -> _KnownOrientations | None:
        """The known orientations of a body, rotated with its surface if that was followed."""
        if before is None:
            return None
        if before.surface is not None:
            numbers, current = before.surface.current_orientations(frame, region)
            if len(numbers):
                needs_new_image = before.surface.needs_new_image(numbers, current)
                views = tuple(before.views[k] for k in numbers)
                return _KnownOrientations(
                    current, views, None if needs_new_image else before.surface, True
                )
        return _KnownOrientations(before.orientations, before.views, None, False)

    def _still_fitting(
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
        steps = NO_STEPS if known.followed else FINE_STEPS
        fits = self._search(frame, best.name, image, list(known.orientations), steps)
        if not fits or fits[0].overlap < before.overlap - s.most_overlap_loss:
            return []
        at = _FittedImage(frame, region, image, best, before.time, before.overlap)
        return self._stored(at, fits, known.views, known.surface)

    def _full_search(
        self,
        frame: Frame,
        region: Region,
        image: RegionImage,
        own: Sequence[SizedHypothesis],
        more_views: MoreViews,
        known: _KnownOrientations | None,
    ) -> list[SizedHypothesis]:
        """A full search from views of a model and from known orientations; empty if nothing fits."""
        s, best = self.settings, own[0][0]
        view_orientations = _orientations([h for h, _ in [*own, *more_views(best.name)]])[
            : s.starts
        ]
        starts = [turn for _, turn in view_orientations]
        numbers = tuple(view for view, _ in view_orientations)
        if known is not None:
            starts, numbers = [*known.orientations, *starts], (*known.views, *numbers)
        fits = self._search(frame, best.name, image, starts, COARSE_STEPS)
        if not fits or fits[0].overlap < s.least_overlap:
            self.memory.pop((region.id, best.name), None)
            return []
        overlap, surface = fits[0].overlap, None
        if known is not None and known.followed:
            fits, surface = known.with_followed_orientations(fits)
            first = [fits[0].orientation]
            overlap = self._search(frame, best.name, image, first, NO_STEPS)[0].overlap
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
        mesh, most = self.meshes[name], self.settings.most_orientations
        fits = fitted_poses(mesh, image, starts, steps=steps, focal_px=focal)[:most]
        if steps is not COARSE_STEPS:
            return fits
        best_orientations = [f.orientation for f in fits]
        refined = fitted_poses(mesh, image, best_orientations, steps=FINE_STEPS, focal_px=focal)
        return [replace(f, start=fits[f.start].start) for f in refined]

    def _stored(
        self,
        fitted: _FittedImage,
        fits: Sequence[PoseFit],
        numbers: Sequence[int],
        surface: FollowedSurface | None,
    ) -> list[SizedHypothesis]:
        """Store the fits and return them as hypotheses; without a surface, a new one is followed from now."""
        fitted_orientations = np.stack([f.orientation for f in fits])
        chosen = tuple(numbers[f.start] for f in fits)
        best, key = fitted.best, (fitted.region.id, fitted.best.name)
        starts = [f.start for f in fits]
        if surface is None or sorted(starts) != list(range(len(surface.orientations))):
            focal = USUAL_FOCAL * fitted.frame.size[0]
            mesh = self.meshes[best.name]
            surface = followed_surface(
                fitted.frame, fitted.region, mesh, fitted.image, fitted_orientations, focal
            )
        else:
            surface = surface.ordered(starts)
        self.memory[key] = FittedModel(
            fitted.time, fitted.overlap, fitted_orientations, chosen, surface
        )
        directions, rotations = views(fitted_orientations)
        best_score, similarity_loss = fits[0].score, self.settings.similarity_loss
        return [
            (
                replace(
                    best,
                    view=view,
                    similarity=max(
                        0.0, best.similarity - similarity_loss * (best_score - fit.score)
                    ),
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
    by_direction: dict[Direction, tuple[int, NDArray[np.float64]]] = {}
    for h in hypotheses:
        if h.direction is not None and h.rotation is not None and h.direction not in by_direction:
            by_direction[h.direction] = (h.view, orientations(h.direction, h.rotation))
    return list(by_direction.values())
