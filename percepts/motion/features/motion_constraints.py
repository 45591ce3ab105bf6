"""Sparse motion constraints: how points moved, and how certainly in each direction.

A corner fixes both components of its motion, an edge only the one across it (the aperture
problem). Both are carried in one form: a displacement with a 2 x 2 information matrix, whose
small eigenvalue marks the direction that is not constrained (paper, section 3; Chung, MacLean and
Dickinson). Points are taken only where the image has structure, because dense flow invents motion
in a dark sky.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features._motion_constraints_jit import (
    inverse_covariances,
    strongest_gradients,
    structure_tensors,
)
from visup.percepts.motion.features.point_search import WINDOW, search, search_widely
from visup.percepts.motion.features.work_image import Floats, WorkImage

Ints = NDArray[np.int64]
MARGIN = 3  # pixels at the border of the image where no point is taken
CORNER = 0.1  # least ratio of the eigenvalues of a corner's structure tensor
AGREED = 0.25  # pixels up to which the expected place of a point and the search for it agree
FLOOR = 0.12  # pixels: what sampling and compression leave, however strong the gradient


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Where motion can be measured in the newest image.

    Attributes:
        xy: (N, 2) float32 positions.
        tensor: (N, 3) float32 structure tensor (xx, xy, yy) summed over the window.
        normal: (N, 2) float32 unit gradient.
    """

    xy: Floats
    tensor: Floats
    normal: Floats

    def __len__(self) -> int:
        return len(self.xy)

    def corners(self) -> NDArray[np.bool_]:
        """(N,) bool, which have structure along both directions; the others are edges."""
        xx, xy, yy = self.tensor.T.astype(np.float64)
        mean, half = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
        return np.asarray(mean - half >= CORNER * (mean + half))


@dataclass(frozen=True, slots=True, eq=False)
class Constraints:
    """Measured motions of points over one baseline.

    Attributes:
        lag: Baseline in frames.
        span_s: Baseline in seconds.
        index: (N,) int64, which of the points.
        xy: (N, 2) float32 positions in the newest image.
        moved: (N, 2) float32 displacement from the old image to the newest, pixels.
        information: (N, 3) float32 inverse covariance (xx, xy, yy), per square pixel.
    """

    lag: int
    span_s: float
    index: Ints
    xy: Floats
    moved: Floats
    information: Floats

    def __len__(self) -> int:
        return len(self.xy)

    def take(self, which: Ints | slice) -> Constraints:
        """The constraints at (M,) indices, or a slice of them, which shares their memory."""
        return Constraints(
            self.lag,
            self.span_s,
            self.index[which],
            self.xy[which],
            self.moved[which],
            self.information[which],
        )


def find_points(image: WorkImage, cell: int, noise: float, most: int = 2500) -> Points:
    """The strongest gradient of each cell, where it exceeds the noise.

    Args:
        image: The working image.
        cell: Size of a cell, pixels.
        noise: Standard deviation of grey values.
        most: Most points to return; the strongest are kept.

    Returns:
        Points, in scan order.
    """
    xs, ys, value = strongest_gradients(image.gx, image.gy, cell, MARGIN)
    keep = np.flatnonzero(value > (1.5 * noise) ** 2)
    if len(keep) > most:
        keep = np.sort(keep[np.argsort(-value[keep], kind="stable")[:most]])
    x, y = xs[keep], ys[keep]
    gradient = np.stack([image.gx[y, x], image.gy[y, x]], axis=1)
    normal = gradient / np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 1e-6)
    xy = np.stack([x, y], axis=1).astype(np.float32)
    tensor = structure_tensors(image.gx, image.gy, x, y, WINDOW)
    return Points(xy, tensor, normal.astype(np.float32))


def information_of(tensor: Floats, sigma: Floats, floor: float) -> Floats:
    """Inverse covariance of displacements measured with these structure tensors.

    Args:
        tensor: (N, 3) float32 (xx, xy, yy).
        sigma: (N,) float32 error of grey values.
        floor: Least standard deviation of a displacement, pixels.

    Returns:
        (N, 3) float32 (xx, xy, yy); nearly singular along an edge.
    """
    return inverse_covariances(
        np.ascontiguousarray(tensor), np.asarray(sigma, dtype=np.float32), floor
    )


def mahalanobis(error: Floats, information: Floats) -> Floats:
    """Squared Mahalanobis length of (N, 2) errors under (N, 3) information; (N,) float32."""
    dx, dy = error[:, 0], error[:, 1]
    a, b, c = information[:, 0], information[:, 1], information[:, 2]
    return np.asarray(a * dx * dx + 2 * b * dx * dy + c * dy * dy, dtype=np.float32)


def track_points(
    points: Points,
    guess: Floats,
    images: tuple[WorkImage, WorkImage],
    lag: int,
    noise: float,
    *,
    nearby: bool,
) -> Constraints:
    """Constraints over one baseline, each point checked forward and backward.

    Args:
        points: Points of the newest image.
        guess: (N, 2) float32, where each is expected in the old image.
        images: The older image and the newest.
        lag: Frames between them.
        noise: Standard deviation of grey values.
        nearby: Whether points are first searched where they are expected, which takes half the time.

    Returns:
        Constraints of the points that were tracked.
    """
    old, new = images
    if not len(points):
        return Constraints(lag, new.time - old.time, np.zeros(0, np.int64), *_no_constraints())
    start = points.xy.reshape(-1, 1, 2).copy()
    begin = guess.astype(np.float32).reshape(-1, 1, 2).copy()
    # Between adjacent frames dense flow gives the starting point: coarse levels would only mislead.
    near = lag == 1
    search_function = search if nearby else search_widely
    there, found, misfit = search_function(new, old, start, begin, 1 if near else 2, near=near)
    home, back = _back(points, begin, there, found, images, near)
    ok = (found.ravel() > 0) & (back.ravel() > 0)
    # Results of lost points may not even be finite.
    ok &= np.isfinite(there).all(axis=(1, 2)) & np.isfinite(home).all(axis=(1, 2))
    misfit = np.where(ok[:, None], misfit, 255.0)
    home, there = np.where(ok[:, None, None], home, 0), np.where(ok[:, None, None], there, 0)
    energy = (points.tensor[:, 0] + points.tensor[:, 2]) / WINDOW**2
    wrong = np.asarray(misfit, dtype=np.float32).ravel()
    ok &= wrong < 3 * noise + 0.7 * np.sqrt(energy)
    sigma = np.maximum(1.5 * noise, wrong).astype(np.float32)
    information = information_of(points.tensor, sigma, FLOOR)
    ok &= mahalanobis(home[:, 0] - points.xy, information) < 16.0
    keep = np.flatnonzero(ok)
    moved = points.xy[keep] - there[keep, 0]
    return Constraints(lag, new.time - old.time, keep, points.xy[keep], moved, information[keep])


def _back(
    points: Points,
    begin: Floats,
    there: Floats,
    found: NDArray[np.uint8],
    images: tuple[WorkImage, WorkImage],
    near: bool,
) -> tuple[Floats, NDArray[np.uint8]]:
    """Positions of points tracked backward, (N, 1, 2), and their status, (N, 1).

    The backward track is nearly known, so it needs no coarse levels. It begins as far off as the guess
    was, since a search that starts at its answer proves little. For the same reason points that were found
    where they were expected, by dense flow or a known motion, are not checked. Over a long baseline, where
    guesses are poor, the search begins at the original point.
    """
    start, off = points.xy.reshape(-1, 1, 2), there - begin
    aside = off if near else np.zeros_like(off)
    home, back = start.copy(), found.copy()
    agreed = np.hypot(off[..., 0], off[..., 1]).ravel() < AGREED
    checked = np.flatnonzero((found.ravel() > 0) & ~agreed)
    if len(checked):
        first = np.ascontiguousarray((start + aside)[checked])
        old, new = images
        ends, sound, _ = search_widely(
            old, new, np.ascontiguousarray(there[checked]), first, 0, near=near
        )
        home[checked], back[checked] = ends, sound
    return home, back


def add_flow_constraints(
    c: Constraints, points: Points, flow: Floats, old: WorkImage, new: WorkImage, noise: float
) -> Constraints:
    """Fill in, from a dense flow field, points that could not be tracked one by one.

    Point tracking loses blurred and deforming objects, which are often what moves. The flow is trusted
    less, and only where grey values fit.

    Args:
        c: Constraints over one frame.
        points: N points of the newest image.
        flow: (h, w, 2) float32, from the newest image back to the old one.
        old: The image before.
        new: The newest image.
        noise: Standard deviation of grey values.

    Returns:
        The constraints, followed by those of the flow.
    """
    missing = np.ones(len(points), dtype=bool)
    missing[c.index] = False
    lost = np.flatnonzero(missing)
    if not len(lost):
        return c
    x, y = points.xy[lost].astype(np.int64).T
    back = flow[y, x]
    at = np.rint(points.xy[lost] + back).astype(np.int64)
    height, width = new.shape
    inside = (at >= 0).all(axis=1) & (at[:, 0] < width) & (at[:, 1] < height)
    at = np.clip(at, 0, [width - 1, height - 1])
    misfit = np.abs(old.grey[at[:, 1], at[:, 0]].astype(np.float32) - new.grey[y, x])
    keep = inside & (misfit < 6 * noise + 15)
    sigma = np.maximum(3 * noise, misfit[keep]).astype(np.float32)
    information = information_of(points.tensor[lost[keep]], sigma, 5 * FLOOR)
    return Constraints(
        c.lag,
        c.span_s,
        np.concatenate([c.index, lost[keep]]),
        np.concatenate([c.xy, points.xy[lost[keep]]]),
        np.concatenate([c.moved, -back[keep]]),
        np.concatenate([c.information, information]),
    )


def _no_constraints() -> tuple[Floats, Floats, Floats]:
    return (
        np.zeros((0, 2), np.float32),
        np.zeros((0, 2), np.float32),
        np.zeros((0, 3), np.float32),
    )
