"""Search for points of one image in another (Lucas and Kanade 1981; pyramids after Bouguet 2000).

Most points are near to where dense flow or a known motion expects them. A compiled search finds these in a
third of OpenCV's time, since it makes no pyramid; OpenCV's finds the others.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.motion.features._point_search_jit import WINDOW, search_nearby
from visup.percepts.motion.features.work_image import Floats, WorkImage

STEPS_NEAR, STEPS_FAR = (10, 0.03), (30, 0.01)
"""Most iterations of a search, and the step, pixels, at which it stops: well below the error of sampling.
Slow motion over long baselines needs more of both."""
NEARBY = 1.0
"""Reach of the search, pixels: within 2, one point in ten more is found, and more of them differ from
OpenCV's."""
Found = tuple[Floats, NDArray[np.uint8], Floats]

__all__ = ["WINDOW", "search", "search_widely"]


def search(
    source: WorkImage, target: WorkImage, start: Floats, begin: Floats, levels: int, *, near: bool
) -> Found:
    """Where points of one image are in another.

    Args:
        source: The image of the points.
        target: The image to search.
        start: (N, 1, 2) float32, their positions, whole pixels.
        begin: (N, 1, 2) float32, where they are expected.
        levels: Levels of a pyramid, besides the image itself, for points that are not found nearby.
        near: Whether the images are adjacent: then fewer iterations do.

    Returns:
        (N, 1, 2) positions; (N, 1) 1 where found; (N, 1) float32 mean difference of the windows, grey levels.
    """
    most, enough = STEPS_NEAR if near else STEPS_FAR
    own = source.grey, source.gx, source.gy
    limits = most, enough, NEARBY
    end, nearby, misfit = search_nearby(own, target.grey, start[:, 0], begin[:, 0], limits)
    end, found, misfit = end[:, None], nearby.astype(np.uint8)[:, None], misfit[:, None]
    rest = np.flatnonzero(~nearby)
    if len(rest):
        end[rest], found[rest], misfit[rest] = search_widely(
            source, target, start[rest], begin[rest], levels, near=near
        )
    return end, found, misfit


def search_widely(
    source: WorkImage, target: WorkImage, start: Floats, begin: Floats, levels: int, *, near: bool
) -> Found:
    """As `search`, for positions between pixels too: OpenCV's search for all points.

    Without levels it is as fast as the compiled one.
    """
    most, enough = STEPS_NEAR if near else STEPS_FAR
    end, found, misfit = cv2.calcOpticalFlowPyrLK(
        source.grey,
        target.grey,
        start,
        begin.copy(),
        winSize=(WINDOW, WINDOW),
        maxLevel=levels,
        criteria=(cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, most, enough),
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
        minEigThreshold=1e-5,
    )
    return (
        np.asarray(end, dtype=np.float32),
        np.asarray(found, dtype=np.uint8),
        np.asarray(misfit, dtype=np.float32),
    )
