"""Parts of a body that hardly move, found before a static camera by their slow change.

Who has been in view from the start hides ground that was never seen, so subtraction cannot show the whole of
him, and the layers show what moves: an arm, not the legs that he stands on. Yet no living body rests as the
ground does: within half a second its outline shifts by a part of a pixel, which changes grey values by
several times the noise. Noise, and leaves that tremble, change as much from one frame to the next as within
half a second; a slow body does not. So change over longer spans is compared with that over one frame.

What changes slowly beside a region is then joined to it by a random walk between superpixels (Grady, Random
walks for image segmentation, 2006), with the region and the slow change on one side, and on the other what
has structure, which would show motion, and has not changed.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.percepts.motion.features.diffusion import solve_symmetric, weighted_laplacian
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats, WorkImage
from visup.percepts.motion.outlines.region_outline import chosen, describe_mask, marked
from visup.percepts.motion.static_camera._slow_parts_jit import believe_bare, squared_difference
from visup.percepts.motion.tracks.measurements import FrameMeasurements

Mask = NDArray[np.bool_]
SPANS_S = (0.15, 0.3, 0.6)  # spans over which change is measured, seconds, shortest first
MEMORY_S = 0.5  # time constant of the change over one frame, seconds
LEAST_NOISE = 0.5  # least mean squared change over one frame, squared grey levels
AVERAGE = 1.0  # standard deviation of the average of change about a pixel, pixels
SURE, LIKELY = 8.0, 3.0  # squared change over a span, in units of that over one frame: hysteresis
NEAR = 5  # width of the surroundings whose greatest change over one frame counts, pixels
GRADUAL = 1.0  # least change over one frame, as a share of what a steady shift explains
OWN, CHANGED = 2.0, 0.3  # weight of a region, and of slow change, for a body
BARE = 1.0  # weight of ground that has long been seen bare, against one
FLAT = 0.05  # weight of a cell without structure, which cannot show change
BUSY = 3.0  # gradient at which a cell has structure, grey levels per pixel
LINK = 0.3  # weight of the affinity of neighbouring cells
THICK = 13  # least thickness of a part, pixels: outlines are off by less
REACH = 0.5  # gaps that are closed, as a share of the square root of the regions' area
MOST_REACH = 0.04  # the same as a share of the image's longer side
BACK_S = 0.3  # how long ground is seen after it was hidden until it is certainly bare, seconds
ALWAYS_S = (
    2.4  # the same for ground that never was hidden: a body may have been there from the start
)


class SlowChange:
    """Change over some tenths of a second that noise and trembling do not explain; one per video."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew, after the camera has moved."""
        self._past: tuple[WorkImage, ...] = ()
        self._parts: Mask | None = None  # (h, w) parts found in the frame before
        self._last: Floats | None = None  # (h, w) squared change since the frame before
        self._brief: Floats | None = None  # (h, w) the same, averaged over time

    def note(self, image: WorkImage) -> None:
        """Take in the next image."""
        if self._past and self._past[-1].shape != image.shape:
            self.forget()
        if self._past:
            last = self._past[-1]
            self._last = _squared_change(image, last)
            brief = np.asarray(cv2.blur(self._last, (5, 5)), np.float32)
            if self._brief is not None:
                passed = 1 - float(np.exp(-(image.time - last.time) / MEMORY_S))
                weight = np.float32(max(passed, 1 / len(self._past)))
                brief = self._brief + weight * (brief - self._brief)
            self._brief = brief
        kept = max(SPANS_S) * 1.2
        self._past = (*(p for p in self._past if image.time - p.time <= kept), image)

    def pixels(self) -> Mask | None:
        """(h, w) bool: where the newest image has changed slowly; None before the first span is over."""
        if self._brief is None or self._last is None:
            return None
        *past, image = self._past
        last = _averaged(self._last)
        # Also where leaves have only just moved, and beside what moves fast, which is seen as it is.
        brief = cv2.dilate(self._brief, np.ones((NEAR, NEAR), np.uint8))
        noise = np.maximum(brief, max(float(np.median(self._brief)), LEAST_NOISE))
        seconds, out = image.time - past[-1].time, None
        for span in SPANS_S:
            old = [p for p in past if image.time - p.time >= 0.9 * span]
            if not old:
                break
            change = _averaged(_squared_change(image, old[-1]))
            # What has come to rest in between is ground that was uncovered, or needs no completion.
            gradual = last > GRADUAL * (seconds / span) ** 2 * change
            found = _likely_pixels(np.asarray(change / noise, np.float32)) & gradual
            out = found if out is None else out | found
        if out is None or self._parts is None:
            return out
        # A body that sways stands still for a moment at either end.
        return out | (self._parts & (last < LIKELY * noise))

    def keep(self, parts: Mask) -> None:
        """Count parts, (h, w) bool, as changed in the next frame where they still look the same."""
        self._parts = parts


class GroundBelief:
    """Belief that the ground is bare, the higher the longer it has looked like the background.

    What was hidden, and looks like the background again, is soon believed. What has always looked like it may
    be a body that stood there when the background was first seen.

    Attributes:
        share: (h, w) float32, 0 to 1; None before the first image.
    """

    def __init__(self) -> None:
        self.share: Floats | None = None
        self._was_hidden: Mask | None = None

    def update(self, hidden: Mask, seconds: float) -> None:
        """Note where the ground is hidden or unknown, `seconds` after the image before."""
        if self.share is None or self._was_hidden is None:
            self.share, self._was_hidden = np.zeros(hidden.shape, np.float32), hidden.copy()
        pace = np.float32(seconds / BACK_S), np.float32(seconds / ALWAYS_S)
        believe_bare(self.share, self._was_hidden, hidden, pace)

    def cover(self, reported: Mask) -> None:
        """Note where bodies are reported, (h, w) bool."""
        if self.share is not None:
            self.share[reported] = 0


def hardly_moves(velocity: tuple[float, float], scale: float) -> bool:
    """Whether a region moves by less than the thickness of a part within the longest span.

    What moves faster shows itself by its motion, and uncovers ground, which changes as well.

    Args:
        velocity: Of the region, frame pixels per second.
        scale: Working pixels per frame pixel.
    """
    speed = float(np.hypot(*velocity)) * scale
    return speed * max(SPANS_S) < THICK


def with_slow_parts(
    regions: Sequence[Region],
    others: Sequence[Region],
    slow: Mask,
    bare: Floats | None,
    scene: FrameMeasurements,
    size: tuple[int, int],
) -> tuple[tuple[Region, ...], Mask]:
    """Regions with the parts beside them that change slowly.

    Args:
        regions: In frame pixels.
        others: Further regions, which are no part of these.
        slow: (h, w) bool, working pixels, from `SlowChange`.
        bare: Belief that the ground is bare, of any size; None if nothing is known.
        scene: The frame.
        size: (width, height) of the frame.

    Returns:
        The regions, in the same order, and the parts, (h, w) bool; each part goes to the nearest region.
    """
    masks = np.array([_reduced(r, slow.shape, size) for r in regions])
    own = np.asarray(masks.any(axis=0)) if len(masks) else np.zeros_like(slow)
    if not own.any():
        return tuple(regions), own  # no pixel
    taken = np.any([own, *(_reduced(r, slow.shape, size) for r in others)], axis=0)
    added = _thick(_body(own, slow, bare, scene) & ~taken)
    if not added.any():
        return tuple(regions), added
    away = [cv2.distanceTransform((~m).view(np.uint8), cv2.DIST_L2, 3) for m in masks]
    nearest = np.argmin(away, axis=0)
    parts = [added & (nearest == i) for i in range(len(regions))]
    pairs = zip(regions, parts, strict=True)
    return tuple(_joined(r, part, size) if part.any() else r for r, part in pairs), added


def _body(own: Mask, slow: Mask, bare: Floats | None, scene: FrameMeasurements) -> Mask:
    """What hangs together with some regions, (h, w) bool, and is a body rather than ground."""
    cells, image = scene.cells, scene.image
    mine, change = (cells.mean(m.astype(np.float32)) for m in (own, slow))
    enclosed = cells.mean(_closed(own, slow).astype(np.float32))
    busy = cells.mean(np.abs(image.gx) + np.abs(image.gy))
    unchanged = (1 - mine) * (1 - change) * (1 - enclosed)
    ground = unchanged * (FLAT + busy / (busy + BUSY))
    if bare is not None:
        seen = cv2.resize(bare, own.shape[::-1], interpolation=cv2.INTER_NEAREST)
        ground = ground + BARE * cells.mean(np.asarray(seen, np.float32))
    body = np.asarray(OWN * mine + CHANGED * change, np.float32)
    share = _random_walk(body, np.asarray(ground, np.float32), cells)
    inside = cells.paint(share > 0.5) | own
    count, labels = cv2.connectedComponents(inside.view(np.uint8), connectivity=4)
    return chosen(labels, marked(labels, own, count))


def _thick(added: Mask) -> Mask:
    """Parts that are more than the rim by which an outline is off, (h, w) bool."""
    if not added.any():
        return added
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (THICK, THICK))
    core = cv2.morphologyEx(np.pad(added.view(np.uint8), THICK, mode="edge"), cv2.MORPH_OPEN, disc)
    near = cv2.dilate(core[THICK:-THICK, THICK:-THICK], disc)
    return np.asarray((near > 0) & added)


def _random_walk(body: Floats, ground: Floats, cells: Superpixels) -> Floats:
    """Probability that a walk from a cell ends at a body, given the rates at which it ends in each cell."""
    here = np.arange(cells.count)
    ends = (body.astype(np.float64) + ground + 1e-6) / LINK
    system, _ = weighted_laplacian(cells.link, here, ends)
    return np.asarray(solve_symmetric(system, body.astype(np.float64) / LINK), np.float32)


def _closed(own: Mask, slow: Mask) -> Mask:
    """Regions and slow change, the gaps between them closed: what outlines enclose may not change."""
    reach = int(min(REACH * np.sqrt(np.count_nonzero(own)), MOST_REACH * max(own.shape)))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    both = own | slow
    x, y, w, h = cv2.boundingRect(both.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    closed = cv2.morphologyEx(np.pad(both[part].view(np.uint8), reach), cv2.MORPH_CLOSE, disc)
    out = np.zeros_like(both)
    out[part] = closed[reach : reach + h, reach : reach + w] > 0
    return out


def _likely_pixels(change: Floats) -> Mask:
    """Pixels that change, (h, w) bool: sure ones, and likely ones that hang together with them."""
    count, labels = cv2.connectedComponents((change > LIKELY).view(np.uint8), connectivity=8)
    return chosen(labels, marked(labels, change > SURE, count))


def _averaged(change: Floats) -> Floats:
    return np.asarray(cv2.GaussianBlur(change, (0, 0), AVERAGE), np.float32)


def _squared_change(now: WorkImage, old: WorkImage) -> Floats:
    """Squared difference of two images but for their exposure, (h, w)."""
    a, b = (np.asarray(image.grey[::4, ::4], np.float32) + 1 for image in (now, old))
    return squared_difference(now.grey, old.grey, np.float32(np.median(a / b)))


def _reduced(r: Region, shape: tuple[int, ...], size: tuple[int, int]) -> Mask:
    full = r.full_mask(size).view(np.uint8)
    return np.asarray(cv2.resize(full, shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0)


def _joined(r: Region, added: Mask, size: tuple[int, int]) -> Region:
    large = cv2.resize(added.view(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    return describe_mask(large | r.full_mask(size), (0, 0), size).applied_to(r)
