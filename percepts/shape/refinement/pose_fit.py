"""Orientations fitted to what is seen: a model's mesh is drawn, compared, turned a little, drawn again.

What is compared is the outline (overlap) and what is inside it (how much of the shading the drawn surface
explains); the second tells apart the directions from which a symmetric object has the same outline.
Approximations: the light is distant, the surface matt and of one colour or nearly so, nothing casts a shadow
on it; where that does not hold the shading explains less, and the outline decides alone. The camera is
taken to look at the object's centre, with the focal length of a usual lens where none is told.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.refinement._pose_fit_jit import climb
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.refinement.region_picture import RegionPicture

SHADING = 0.3
"""Weight of the share of shading explained beside the overlap."""

COARSE = np.radians([16.0, 8.0, 4.0])
"""Steps of a whole search from the orientations of views, radians; what it leads to is searched finely."""

FINE = np.radians([2.0, 1.0, 0.5])
"""Steps of the search from an orientation fitted a moment ago, radians; a coarser last one would lag
behind what turns slowly."""

USUAL_FOCAL = 1.2
"""Focal length of a usual lens, in widths of the picture (a horizontal field of view of 45 degrees)."""

SAME = np.radians(12.0)
"""Orientations nearer to each other than this are one."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseFit:
    """An orientation, and how well it fits.

    Attributes:
        orientation: (3, 3) model to a camera that looks at the object.
        overlap: Intersection over union of the outlines.
        explained: Share of the shading explained, 0 to 1.
        area: Of the silhouette, mesh units squared, were it seen from so far that nothing is foreshortened
            by perspective.
        start: Number of the orientation from which the search began.
    """

    orientation: NDArray[np.float64]
    overlap: float
    explained: float
    area: float
    start: int

    @property
    def worth(self) -> float:
        """What fits are ranked by."""
        return self.overlap + SHADING * self.explained


def fitted_poses(
    model: MeshModel,
    picture: RegionPicture,
    starts: Iterable[NDArray[np.float64]],
    *,
    steps: NDArray[np.float64] = COARSE,
    focal_px: float,
) -> list[PoseFit]:
    """The orientations that searches from several others lead to, best first, each once.

    Args:
        model: The mesh.
        picture: What is seen.
        starts: (3, 3) orientations, model to camera.
        steps: Turns that are tried, radians.
        focal_px: Focal length, pixels of the frame.
    """
    mesh = (model.vertices, model.faces, model.normals)
    distance, cover = _distance(picture, focal_px), float(picture.cover.sum())
    found = []
    for number, start in enumerate(starts):
        at = np.ascontiguousarray(start, dtype=np.float64)
        turn, overlap, explained, scale = climb(
            mesh, (picture.cover, picture.tone), at, distance, steps, SHADING
        )
        found.append(PoseFit(turn, overlap, explained, cover * (model.radius / scale) ** 2, number))
    found.sort(key=lambda f: (-f.worth, f.start))
    return _distinct(found)


def _distance(picture: RegionPicture, focal_px: float) -> float:
    """About how far away the object is, in units of its radius; no nearer than two.

    Its radius is taken for half its longer side in the picture, which a view along a long axis belies;
    perspective then is taken too weak, as a parallel projection would.
    """
    rows, columns = np.nonzero(picture.cover > 0.5)
    longer = max(np.ptp(rows), np.ptp(columns)) + 1 if len(rows) else 1
    return max(2.0, focal_px / (0.5 * float(longer) * picture.pixel))


def _distinct(fits: Sequence[PoseFit]) -> list[PoseFit]:
    kept: list[PoseFit] = []
    for fit in fits:
        if all(_apart(fit.orientation, other.orientation) > SAME for other in kept):
            kept.append(fit)
    return kept


def _apart(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return float(np.arccos(np.clip((np.sum(a * b) - 1.0) / 2.0, -1.0, 1.0)))
