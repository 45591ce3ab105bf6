"""Compiled loops over points or cells, and the tracks that may claim them."""

from __future__ import annotations

from math import log

import numpy as np
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features.work_image import Floats

Doubles = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]
Labels = NDArray[np.int32]
Points = tuple[Floats, Floats, Floats]
Motions = tuple[Doubles, Doubles, Ints]


@compiled
def _squared_misfit(points: Points, n: int, matrix: Doubles, slack: float) -> np.float32:
    """Squared Mahalanobis distance of a constraint to an affine motion, as in `squared_misfits`."""
    xy, moved, information = points
    x, y = xy[n, 0], xy[n, 1]
    u = np.float32(matrix[0, 0]) * x + np.float32(matrix[0, 1]) * y + np.float32(matrix[0, 2])
    v = np.float32(matrix[1, 0]) * x + np.float32(matrix[1, 1]) * y + np.float32(matrix[1, 2])
    ex, ey = float(u - moved[n, 0]), float(v - moved[n, 1])
    a, b, c = float(information[n, 0]), float(information[n, 1]), float(information[n, 2])
    w = slack * slack
    det = a * c - b * b
    scale = 1 / (1 + w * (a + c) + w * w * det)
    a, b, c = (a + w * det) * scale, b * scale, (c + w * det) * scale
    return np.float32((a * ex + 2 * b * ey) * ex + c * ey * ey)


@compiled
def _log_width(information: Floats, slack: float) -> float:
    """What a motion pays for being known up to `slack` only, as in `log_likelihoods`."""
    a, b, c = float(information[0]), float(information[1]), float(information[2])
    w, det = slack * slack, a * c - b * b
    wide = (a + c + 2 * w * det) / (1 + w * (a + c) + w * w * det)
    return 0.5 * log(max(wide, 1e-9) / (a + c + 1e-9))


@compiled
def add_track_likelihoods(
    out: Floats, index: Ints, points: Points, reach: Mask, motions: Motions, least: float
) -> None:
    """Add to (N, K + 2) log likelihoods those of K tracks, columns 1 to K, at some of the points.

    Args:
        out: Of all N points and labels.
        index: (M,) which of the points.
        points: (M, 2) positions, (M, 2) displacements, (M, 3) information.
        reach: (N, K), which points each track may claim; the others get `least`.
        motions: (P, 2, 3) motions and (P,) errors of the parts of all tracks, and (K + 1,) where those of
            each begin; the likeliest part counts.
        least: Least log likelihood.
    """
    matrices, slacks, begin = motions
    for i in range(len(index)):
        n = index[i]
        for k in range(reach.shape[1]):
            fit = np.float32(least)
            if reach[n, k]:
                for p in range(begin[k], begin[k + 1]):
                    off = _squared_misfit(points, i, matrices[p], slacks[p])
                    fit = max(fit, np.float32(_log_width(points[2][i], slacks[p]) - 0.5 * off))
            out[n, k + 1] += fit


@compiled
def drop_explained(free: Mask, points: Points, near: Mask, motions: Motions, far: float) -> None:
    """Unmark those of N points that a part of a track near by explains.

    Args:
        free: (N,) bool, changed in place.
        points: (N, 2) positions, (N, 2) displacements, (N, 3) information.
        near: (N, K), which tracks each point is near.
        motions: As of `add_track_likelihoods`.
        far: Squared distance from which a part does not explain a point.
    """
    matrices, slacks, begin = motions
    for n in range(len(free)):
        if not free[n]:
            continue
        for k in range(near.shape[1]):
            if near[n, k]:
                for p in range(begin[k], begin[k + 1]):
                    if _squared_misfit(points, n, matrices[p], slacks[p]) < far:
                        free[n] = False


@compiled
def assigned(
    points: Points, to_background: Floats, matrices: Doubles, slacks: Doubles, cost: float
) -> tuple[Mask, Ints]:
    """Which of N constraints a track may be fitted to, and the nearest of its parts to each.

    Constraints that the background explains, and no part does, must not pull the track along. When that holds
    for most of the track, it has stopped instead.

    Args:
        points: (N, 2) positions, (N, 2) displacements, (N, 3) information.
        to_background: (N,) squared distance of each to the background.
        matrices: (P, 2, 3) motions of the parts.
        slacks: (P,) errors to allow for them, pixels.
        cost: Squared distance that a further part must save: an edge along the motion fits any part and must
            not feed others than the first.
    """
    count = len(to_background)
    own, nearest = np.zeros(count, np.bool_), np.zeros(count, np.int64)
    kept = 0
    for n in range(count):
        best = _squared_misfit(points, n, matrices[0], slacks[0])
        for p in range(1, len(slacks)):
            off = _squared_misfit(points, n, matrices[p], slacks[p]) + np.float32(cost)
            if off < best:
                best, nearest[n] = off, p
        own[n] = best < 9 or to_background[n] > 4
        kept += own[n]
    if not kept > 0.5 * count:
        own[:] = True
    return own, nearest


@compiled
def hidden_before(
    labels: Labels, owner: Ints, centre: Floats, which: Ints, away: Floats, k: int
) -> Mask:
    """Which of M cells a track would have hidden in an older image, were they background.

    Args:
        labels: (h, w) cells.
        owner: (count,) expected label of each.
        centre: (count, 2) of each, pixels.
        which: (M,) the cells.
        away: (M, 2) displacement of the track at each less that of the background.
        k: Label of the track.
    """
    height, width = labels.shape
    out = np.zeros(len(which), np.bool_)
    for i in range(len(which)):
        dx, dy = away[i, 0], away[i, 1]
        # Two pixels more: outlines are not known better.
        more = np.float32(1) + np.float32(2) / max(np.sqrt(dx * dx + dy * dy), np.float32(1e-3))
        x = int(np.rint(centre[which[i], 0] + np.float32(1.2) * dx * more))
        y = int(np.rint(centre[which[i], 1] + np.float32(1.2) * dy * more))
        out[i] = owner[labels[min(max(y, 0), height - 1), min(max(x, 0), width - 1)]] == k
    return out
