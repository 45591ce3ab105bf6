"""Backward tracking: since when a moving region has been in view.

A body at rest is detected only once it moves. To tell whether it came into view or began to move, its
points are tracked back through older images until most are lost. The history thins out with age, so that
a minute costs little more than a second; a body at rest is found again however far apart the images are.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats, reduced

SIZE = 400  # longer side of the images in the history, pixels
EVERY_S = 0.16  # spacing of images of the last second
THINNING = 8.0  # images per e-fold of age
HORIZON_S = 120.0
POINTS = 48
MIN_POINTS = 4
MAX_REMEMBERED = 256  # ids of regions; the oldest are forgotten first
FOUND_SHARE = 0.4  # share of a region's points that must be found for it to be in view
BACK_PX = 1.0  # most forward-backward error of a point
MAX_DIFFERENCE = 0.5  # mean difference of a point's neighbourhood, as a share of its contrast
WINDOW = 9

Grey = NDArray[np.uint8]


class BackwardTracker:
    """Keeps older images and tracks new regions back through them; one per video."""

    def __init__(self) -> None:
        self._past: list[tuple[float, Grey]] = []
        self._since: dict[int, float] = {}
        self._shape: tuple[int, int] = (0, 0)

    def step(self, frame: Frame, regions: Sequence[Region]) -> tuple[Region, ...]:
        """Annotate each region with the time since which it has been in view.

        Args:
            frame: The next frame.
            regions: Its regions; one is tracked back when its id first appears.

        Returns:
            The regions with `visible_since`.
        """
        self._since = dict(list(self._since.items())[-MAX_REMEMBERED:])
        due = not self._past or frame.time - self._past[-1][0] >= EVERY_S - 1e-6
        fresh = [r for r in regions if r.id not in self._since]
        if due or fresh:
            image = _small_grey(frame)
            self._reset_if_resized(image)
            for r in fresh:
                self._since[r.id] = self._visible_since(image, frame.time, r, frame.size)
            if due:
                self._remember(image, frame.time)
        return tuple(replace(r, visible_since=self._since.get(r.id)) for r in regions)

    def _reset_if_resized(self, image: Grey) -> None:
        if image.shape != self._shape:
            self._past, self._since, self._shape = [], {}, image.shape

    def _remember(self, image: Grey, now: float) -> None:
        self._past.append((now, image))
        times = [t for t, _ in self._past]
        # For each new image, drop the first that is closer to its neighbours than its age allows.
        for k in range(1, len(times) - 1):
            if times[k + 1] - times[k - 1] < (now - times[k]) / THINNING:
                del self._past[k]
                break
        if now - self._past[0][0] > HORIZON_S:
            del self._past[0]

    def _visible_since(
        self, image: Grey, now: float, region: Region, size: tuple[int, int]
    ) -> float:
        """The time of the oldest image to which a region can be tracked."""
        points = _points(image, region, size)
        since, newer = now, image
        needed = max(MIN_POINTS, FOUND_SHARE * len(points))
        for time, older in reversed(self._past):
            points, found = _track_back(newer, older, points)
            if found < needed:
                break
            since, newer = time, older
        return since


def _small_grey(frame: Frame) -> Grey:
    """A frame in grey, SIZE pixels long if it is longer, (h, w)."""
    image = frame.image
    if image.ndim == 3 and image.shape[2] == 3:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
    return np.asarray(cv2.GaussianBlur(reduced(image, SIZE), (3, 3), 0.7), dtype=np.uint8)


def _points(grey: Grey, region: Region, size: tuple[int, int]) -> Floats:
    """Corners of a region, (N, 1, 2) float32 in the small image."""
    mask = region.full_mask(size).astype(np.uint8)
    mask = np.asarray(cv2.resize(mask, grey.shape[::-1], interpolation=cv2.INTER_NEAREST))
    found = cv2.goodFeaturesToTrack(grey, POINTS, 0.02, 3, mask=mask, blockSize=5)
    return np.zeros((0, 1, 2), np.float32) if found is None else np.asarray(found, np.float32)


def _track_back(newer: Grey, older: Grey, points: Floats) -> tuple[Floats, int]:
    """Positions of the points in an older image, and how many were found.

    Lost points move with the rest, so that a plain body does not lose them one by one.
    """
    if not len(points):
        return points, 0
    there, found, misfit = _lucas_kanade(newer, older, points)
    back, back_found, _ = _lucas_kanade(older, newer, there)
    off = np.linalg.norm((back - points)[:, 0], axis=1)
    inside = ((there[:, 0] >= 0) & (there[:, 0] < np.array(older.shape[::-1]))).all(axis=1)
    similar = misfit < MAX_DIFFERENCE * _contrast(newer, points)
    tracked = found & back_found & inside & similar & (off < BACK_PX)
    if not tracked.any():
        return points, 0
    shift = np.median((there - points)[tracked], axis=0)
    moved = np.where(tracked[:, None, None], there, points + shift).astype(np.float32)
    return moved, int(tracked.sum())


def _lucas_kanade(
    a: Grey, b: Grey, points: Floats
) -> tuple[Floats, NDArray[np.bool_], NDArray[np.float32]]:
    ends, found, misfit = cv2.calcOpticalFlowPyrLK(
        a, b, points, np.zeros_like(points), winSize=(WINDOW, WINDOW), maxLevel=3
    )
    there = np.asarray(ends, dtype=np.float32)
    sound = (np.asarray(found).ravel() > 0) & np.isfinite(there).all(axis=(1, 2))
    there = np.where(sound[:, None, None], there, np.float32(-1e3)).astype(np.float32)
    return there, sound, np.asarray(misfit, dtype=np.float32).ravel()


def _contrast(grey: Grey, points: Floats) -> NDArray[np.float32]:
    """Mean difference of grey values from their mean in the neighbourhood of each point, (N,)."""
    out = []
    for x, y in points[:, 0]:
        patch = cv2.getRectSubPix(grey, (WINDOW, WINDOW), (float(x), float(y))).astype(np.float32)
        out.append(float(np.abs(patch - patch.mean()).mean()))
    return np.array(out, dtype=np.float32)
