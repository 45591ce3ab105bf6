"""Completes regions by the nearly motionless parts of a body, which change slowly but measurably.

A person who is in view from the start hides ground that the background model has never seen, so background
subtraction does not show all of the body; motion layers show only what moves: an arm, not the legs. But no
living body is as still as the ground: within half a second its outline shifts by a fraction of a pixel, which
changes grey values by several times the noise. Noise and trembling leaves change as much between consecutive
frames as within half a second; a slow body does not. Change over longer spans is therefore compared with
change over one frame.

Slowly changing pixels beside a region are joined to it by random-walk segmentation of superpixels (Grady,
Random walks for image segmentation, 2006). Seeds of the body are the region and the slow change; seeds of the
ground are unchanged cells with structure, where motion would have been visible.
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
from visup.percepts.motion.static_camera._slow_motion_jit import (
    closing,
    squared_difference,
    update_ground_belief,
)
from visup.percepts.motion.tracks.measurements import FrameMeasurements

Mask = NDArray[np.bool_]
SPANS_S = (0.15, 0.3, 0.6)  # spans over which change is measured, seconds, shortest first
MEMORY_S = 0.5  # time constant of the change over one frame, seconds
MIN_NOISE = 0.5  # least mean squared change over one frame, squared grey levels
AVERAGE = 1.0  # standard deviation of the average of change about a pixel, pixels
SURE, LIKELY = 8.0, 3.0  # squared change over a span, in units of that over one frame: hysteresis
NOISE_NEIGHBOURHOOD = 5
"""Width of the surroundings whose greatest change over one frame counts, pixels."""
MIN_GRADUAL_SHARE = 1.0
"""Least change over one frame, as a share of what a steady shift would cause."""
REGION_WEIGHT, CHANGE_WEIGHT = 2.0, 0.3  # seed weight of a region, and of slow change, as body
BARE_WEIGHT = 1.0  # seed weight, as ground, of ground that no object has hidden for long
FLAT_WEIGHT = 0.05
"""Seed weight, as ground, of an unchanged cell without structure: change would not show."""
STRUCTURE_GRADIENT = 3.0  # gradient at which a cell has structure, grey levels per pixel
LINK_WEIGHT = 0.3  # weight of the affinity of neighbouring cells
MIN_THICKNESS = 13
"""Least thickness of an added part, pixels: a thinner one may be an error of the outline."""
CLOSED_GAP = 0.5  # gaps that are closed, as a share of the square root of the regions' area
MAX_CLOSED_GAP = 0.04  # the same as a share of the image's longer side
UNCOVERED_S = 0.3  # how long ground that was hidden must be seen to be certainly bare, seconds
NEVER_HIDDEN_S = 2.4
"""The same for ground that was never hidden: a body may have been there from the start."""


class SlowChangeDetector:
    """Detects change over some tenths of a second that noise and trembling do not explain; one per video."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Reset, after the camera has moved."""
        self._past: tuple[WorkImage, ...] = ()
        self._parts: Mask | None = None  # (h, w) parts found in the frame before
        self._frame_change: Floats | None = None  # (h, w) squared change since the frame before
        self._mean_change: Floats | None = None  # (h, w) the same, averaged over time

    def update(self, image: WorkImage) -> None:
        """Add the next image, and update the change over one frame."""
        if self._past and self._past[-1].shape != image.shape:
            self.reset()
        if self._past:
            last = self._past[-1]
            self._frame_change = _squared_change(image, last)
            mean = np.asarray(cv2.blur(self._frame_change, (5, 5)), np.float32)
            if self._mean_change is not None:
                forgotten = 1 - float(np.exp(-(image.time - last.time) / MEMORY_S))
                weight = np.float32(max(forgotten, 1 / len(self._past)))
                mean = self._mean_change + weight * (mean - self._mean_change)
            self._mean_change = mean
        memory_s = max(SPANS_S) * 1.2
        self._past = (*(p for p in self._past if image.time - p.time <= memory_s), image)

    def changed_pixels(self) -> Mask | None:
        """(h, w) bool: where the newest image has changed slowly; None before the first span is over."""
        if self._mean_change is None or self._frame_change is None:
            return None
        *past, image = self._past
        last = _averaged(self._frame_change)
        # The greatest change nearby counts as noise: leaves have trembled beside a pixel before it changes
        # itself, and what moves fast is segmented by its motion anyway.
        nearby = cv2.dilate(
            self._mean_change, np.ones((NOISE_NEIGHBOURHOOD, NOISE_NEIGHBOURHOOD), np.uint8)
        )
        noise = np.maximum(nearby, max(float(np.median(self._mean_change)), MIN_NOISE))
        seconds, out = image.time - past[-1].time, None
        for span in SPANS_S:
            old = [p for p in past if image.time - p.time >= 0.9 * span]
            if not old:
                break
            change = _averaged(_squared_change(image, old[-1]))
            # A pixel that changed once and is at rest now is uncovered ground, or an object that has stopped,
            # which needs no completion.
            gradual = last > MIN_GRADUAL_SHARE * (seconds / span) ** 2 * change
            found = _likely_pixels(np.asarray(change / noise, np.float32)) & gradual
            out = found if out is None else out | found
        if out is None or self._parts is None:
            return out
        # A swaying body is still for a moment at either end: its parts are kept meanwhile.
        return out | (self._parts & (last < LIKELY * noise))

    def set_parts(self, parts: Mask) -> None:
        """Set the parts, (h, w) bool, that `pixels` reports in the next frame even if unchanged there."""
        self._parts = parts


class GroundBelief:
    """Per-pixel belief that no object hides the ground; it grows while a pixel looks like the background.

    It grows quickly where the ground was hidden and has reappeared. It grows slowly where a pixel has always
    looked like the background: that may be a body that was there when the background was initialised.

    Attributes:
        share: (h, w) float32, 0 to 1; None before the first image.
    """

    def __init__(self) -> None:
        self.share: Floats | None = None
        self._was_hidden: Mask | None = None

    def update(self, hidden: Mask, seconds: float) -> None:
        """Update with where the ground is hidden or unknown, (h, w) bool, `seconds` after the last image."""
        if self.share is None or self._was_hidden is None:
            self.share, self._was_hidden = np.zeros(hidden.shape, np.float32), hidden.copy()
        pace = np.float32(seconds / UNCOVERED_S), np.float32(seconds / NEVER_HIDDEN_S)
        update_ground_belief(self.share, self._was_hidden, hidden, pace)

    def reset(self, reported: Mask) -> None:
        """Reset the belief to 0 where bodies are reported, (h, w) bool."""
        if self.share is not None:
            self.share[reported] = 0


def is_nearly_still(velocity: tuple[float, float], scale: float) -> bool:
    """Whether a region moves by less than `MIN_THICKNESS` within the longest span.

    A faster region is segmented by its motion, and uncovers ground, whose change would be taken for its own.

    Args:
        velocity: Of the region, frame pixels per second.
        scale: Working pixels per frame pixel.
    """
    speed = float(np.hypot(*velocity)) * scale
    return speed * max(SPANS_S) < MIN_THICKNESS


def extend_by_slow_parts(
    regions: Sequence[Region],
    others: Sequence[Region],
    slow: Mask,
    bare: Floats | None,
    scene: FrameMeasurements,
    size: tuple[int, int],
) -> tuple[tuple[Region, ...], Mask]:
    """Regions extended by the slowly changing parts beside them.

    Args:
        regions: Regions to extend, in frame pixels.
        others: Further regions, whose pixels are not available.
        slow: (h, w) bool, working pixels, from `SlowChangeDetector`.
        bare: Belief that no object hides the ground, from `GroundBelief`, of any size; None if unknown.
        scene: The frame.
        size: (width, height) of the frame.

    Returns:
        The regions, in the same order, and the added pixels, (h, w) bool; each goes to the nearest region.
    """
    masks = np.array([_reduced_mask(r, slow.shape, size) for r in regions])
    own = np.asarray(masks.any(axis=0)) if len(masks) else np.zeros_like(slow)
    if not own.any():
        return tuple(regions), own  # no pixel
    taken = np.any([own, *(_reduced_mask(r, slow.shape, size) for r in others)], axis=0)
    added = _thick_parts(_body_cells(own, slow, bare, scene) & ~taken)
    if not added.any():
        return tuple(regions), added
    away = [cv2.distanceTransform((~m).view(np.uint8), cv2.DIST_L2, 3) for m in masks]
    nearest = np.argmin(away, axis=0)
    parts = [added & (nearest == i) for i in range(len(regions))]
    pairs = zip(regions, parts, strict=True)
    return tuple(_extended(r, part, size) if part.any() else r for r, part in pairs), added


def _body_cells(own: Mask, slow: Mask, bare: Floats | None, scene: FrameMeasurements) -> Mask:
    """(h, w) bool: cells that are more likely body than ground, in components that touch the regions."""
    cells, image = scene.cells, scene.image
    mine, change = (cells.mean(m.astype(np.float32)) for m in (own, slow))
    enclosed = cells.mean(_closed_mask(own, slow).astype(np.float32))
    busy = cells.mean(np.abs(image.gx) + np.abs(image.gy))
    unchanged = (1 - mine) * (1 - change) * (1 - enclosed)
    ground = unchanged * (FLAT_WEIGHT + busy / (busy + STRUCTURE_GRADIENT))
    if bare is not None:
        seen = cv2.resize(bare, own.shape[::-1], interpolation=cv2.INTER_NEAREST)
        ground = ground + BARE_WEIGHT * cells.mean(np.asarray(seen, np.float32))
    body = np.asarray(REGION_WEIGHT * mine + CHANGE_WEIGHT * change, np.float32)
    share = _random_walk(body, np.asarray(ground, np.float32), cells)
    inside = cells.paint(share > 0.5) | own
    count, labels = cv2.connectedComponents(inside.view(np.uint8), connectivity=4)
    return chosen(labels, marked(labels, own, count))


def _thick_parts(added: Mask) -> Mask:
    """(h, w) bool: parts at least about `MIN_THICKNESS` wide; thinner ones are errors of the outline."""
    if not added.any():
        return added
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (MIN_THICKNESS, MIN_THICKNESS))
    core = cv2.morphologyEx(
        np.pad(added.view(np.uint8), MIN_THICKNESS, mode="edge"), cv2.MORPH_OPEN, disc
    )
    near = cv2.dilate(core[MIN_THICKNESS:-MIN_THICKNESS, MIN_THICKNESS:-MIN_THICKNESS], disc)
    return np.asarray((near > 0) & added)


def _random_walk(body: Floats, ground: Floats, cells: Superpixels) -> Floats:
    """Probability that a random walk from each cell ends at the body.

    Args:
        body: (cells,) rate at which a walk ends in each cell as body.
        ground: (cells,) rate at which it ends there as ground.
        cells: The superpixels; their links give the transition rates.

    Returns:
        (cells,) float32, 0 to 1.
    """
    here = np.arange(cells.count)
    ends = (body.astype(np.float64) + ground + 1e-6) / LINK_WEIGHT
    system, _ = weighted_laplacian(cells.link, here, ends)
    return np.asarray(solve_symmetric(system, body.astype(np.float64) / LINK_WEIGHT), np.float32)


def _closed_mask(own: Mask, slow: Mask) -> Mask:
    """(h, w) bool: regions and slow change after closing.

    A body without texture changes only along its outline; closing includes what that encloses.
    """
    reach = int(min(CLOSED_GAP * np.sqrt(np.count_nonzero(own)), MAX_CLOSED_GAP * max(own.shape)))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
    both = own | slow
    x, y, w, h = cv2.boundingRect(both.view(np.uint8))
    part = np.s_[y : y + h, x : x + w]
    out = np.zeros_like(both)
    out[part] = closing(both[part], (disc[reach:].sum(axis=1) // 2).astype(np.uint8))
    return out


def _likely_pixels(change: Floats) -> Mask:
    """(h, w) bool: changing pixels by hysteresis: likely ones in components that hold a sure one."""
    count, labels = cv2.connectedComponents((change > LIKELY).view(np.uint8), connectivity=8)
    return chosen(labels, marked(labels, change > SURE, count))


def _averaged(change: Floats) -> Floats:
    return np.asarray(cv2.GaussianBlur(change, (0, 0), AVERAGE), np.float32)


def _squared_change(now: WorkImage, old: WorkImage) -> Floats:
    """Squared difference of two images but for their exposure, (h, w)."""
    a, b = (np.asarray(image.grey[::4, ::4], np.float32) + 1 for image in (now, old))
    return squared_difference(now.grey, old.grey, np.float32(np.median(a / b)))


def _reduced_mask(r: Region, shape: tuple[int, ...], size: tuple[int, int]) -> Mask:
    full = r.full_mask(size).view(np.uint8)
    return np.asarray(cv2.resize(full, shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0)


def _extended(r: Region, added: Mask, size: tuple[int, int]) -> Region:
    large = cv2.resize(added.view(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    return describe_mask(large | r.full_mask(size), (0, 0), size).applied_to(r)
