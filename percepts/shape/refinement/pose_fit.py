"""Pose fitting by analysis by synthesis: a mesh is rendered, compared, rotated a little, and so on.

The score combines the outline (overlap) and its inside (how much of the shading the rendered surface
explains); the latter separates directions from which a symmetric object has the same outline. Approximations:
the light is distant, the surface matt and of nearly one colour, without cast shadows; where that fails the
shading explains less, and the outline decides alone. The camera is assumed to look at the object's centre,
with the focal length of a usual lens where none is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.refinement._pose_fit_jit import climb, surface_depth
from visup.percepts.shape.refinement.mesh_model import MeshModel
from visup.percepts.shape.refinement.region_image import RegionImage

SHADING = 0.3
"""Weight of the explained shading relative to the overlap."""

COARSE_STEPS = np.radians([16.0, 8.0, 4.0])
"""Steps of a full search from the orientations of views, radians; its results are then refined."""

FINE_STEPS = np.radians([2.0, 1.0, 0.5])
"""Steps of the search from a recently fitted orientation, radians; a coarser last step would lag behind slow
rotation."""

NO_STEPS = np.zeros(0)
"""No steps: the orientation is only compared."""

USUAL_FOCAL = 1.2
"""Focal length of a usual lens, in widths of the image (a horizontal field of view of 45 degrees)."""

SAME_ORIENTATION = np.radians(12.0)
"""Orientations closer than this are the same, radians."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseFit:
    """A fitted orientation and its quality.

    Attributes:
        orientation: (3, 3) model to a camera looking at the object.
        overlap: Intersection over union of the outlines.
        explained: Share of the shading explained, 0 to 1.
        area: Area of the silhouette in parallel projection, without perspective foreshortening, mesh units
            squared.
        start: Number of the orientation from which the search began.
    """

    orientation: NDArray[np.float64]
    overlap: float
    explained: float
    area: float
    start: int

    @property
    def score(self) -> float:
        """The score by which fits are ranked."""
        return self.overlap + SHADING * self.explained


def fitted_poses(
    model: MeshModel,
    image: RegionImage,
    starts: Iterable[NDArray[np.float64]],
    *,
    steps: NDArray[np.float64] = COARSE_STEPS,
    focal_px: float,
) -> list[PoseFit]:
    """Search from several orientations; distinct results, best first.

    Args:
        model: The mesh.
        image: The observed region.
        starts: (3, 3) orientations, model to camera.
        steps: Rotations to try, radians.
        focal_px: Focal length, pixels of the frame.
    """
    mesh = (model.vertices, model.faces, model.normals)
    distance, cover = _viewing_distance(image, focal_px), float(image.cover.sum())
    found = []
    for number, start in enumerate(starts):
        start_orientation = np.ascontiguousarray(start, dtype=np.float64)
        orientation, overlap, explained, scale = climb(
            mesh, (image.cover, image.tone), start_orientation, distance, steps, SHADING
        )
        found.append(
            PoseFit(orientation, overlap, explained, cover * (model.radius / scale) ** 2, number)
        )
    found.sort(key=lambda f: (-f.score, f.start))
    return _distinct(found)


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoints:
    """Where points of an image lie on a mesh.

    Attributes:
        positions: (N, 3) relative to the mesh's centre, z away from the viewer, pixels of the frame; NaN
            beside
            the mesh.
        distance: From the viewer to that centre, the same pixels.
    """

    positions: NDArray[np.float64]
    distance: float


def surface_points(
    model: MeshModel,
    image: RegionImage,
    orientation: NDArray[np.float64],
    points: NDArray[np.floating],
    focal_px: float,
) -> SurfacePoints:
    """Lift points of a region onto a mesh.

    Args:
        model: The mesh.
        image: The region.
        orientation: (3, 3) model to camera, as fitted to it.
        points: (N, 2) (x, y) from the centre of the region's box, pixels of the frame.
        focal_px: Focal length, pixels of the frame.
    """
    mesh, observed = (model.vertices, model.faces, model.normals), (image.cover, image.tone)
    _, place = surface_depth(mesh, observed, orientation, _viewing_distance(image, focal_px))
    # The orientation is known here, and with it the radius.
    distance = max(2.0, focal_px / float(place[2] * image.pixel))
    depth, place = surface_depth(mesh, observed, orientation, distance)
    side = len(depth)
    column, row = (points / image.pixel + side / 2).astype(int).clip(0, side - 1).T
    z = np.where(np.isfinite(depth[row, column]), depth[row, column], np.nan)
    offsets = points - (place[:2] - side / 2) * image.pixel
    radius = float(place[2] * image.pixel)
    positions = np.column_stack([offsets * (1 + z / distance)[:, None], z * radius])
    return SurfacePoints(positions, distance * radius)


def _viewing_distance(image: RegionImage, focal_px: float) -> float:
    """Approximate distance of the object, in units of its radius; at least two.

    Its radius is taken as half its longer side in the image, which is too small for a view along a
    long axis; perspective is then underestimated, towards a parallel projection.
    """
    rows, columns = np.nonzero(image.cover > 0.5)
    longer = max(np.ptp(rows), np.ptp(columns)) + 1 if len(rows) else 1
    return max(2.0, focal_px / (0.5 * float(longer) * image.pixel))


def _distinct(fits: Sequence[PoseFit]) -> list[PoseFit]:
    distinct: list[PoseFit] = []
    for fit in fits:
        if all(
            rotation_angle_between(fit.orientation, other.orientation) > SAME_ORIENTATION
            for other in distinct
        ):
            distinct.append(fit)
    return distinct


def rotation_angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """The angle between two orientations, radians."""
    return float(np.arccos(np.clip((np.sum(a * b) - 1.0) / 2.0, -1.0, 1.0)))
