"""The true masks of a mission, prepared for outline noise.

A mask is stored as the signed distance to its outline; adding a smooth random field before thresholding at
zero moves the outline in and out. Names of objects play no role here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Region
from visup.agent.model.errors import SettingsError
from visup.evaluation.missions.files import read_json
from visup.percepts.opencv_names import opencv_name
from visup.rules.coupling.relative_motion import TargetOutline, outline_template, register_outline
from visup.rules.geometry.outlines import prepared_outline
from visup.testing import region_of

MARGIN = 8
"""Margin around a mask in which its outline may move, pixels."""

LAG_S = 0.24
"""Time over which true velocities are measured, seconds; measured velocities of a camera lag likewise."""

_STEP = 1 / 8  # resolution of the stored signed distances, pixels


@dataclass(frozen=True, slots=True, eq=False)
class TrueMask:
    """One object in one frame.

    Attributes:
        at: (x, y) of the crop in the image, pixels.
        inside: (h, w) int8, signed distance to the outline, positive inside, in eighths of a pixel.
        visible_px: Pixels of the mask.
        velocity: (vx, vy) pixels per second, or None if not known.
    """

    at: tuple[int, int]
    inside: NDArray[np.int8]
    visible_px: int
    velocity: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Mission:
    """A mission with its truth.

    Attributes:
        name: Name of its folder.
        description: `mission.json`: the input of the supervisor.
        truth: `truth.json`: the ground truth.
        masks: Masks by frame and object.
    """

    name: str
    description: Mapping[str, Any]
    truth: Mapping[str, Any]
    masks: tuple[Mapping[str, TrueMask], ...]

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the image, pixels."""
        width, height = self.truth["size"]
        return int(width), int(height)

    @property
    def fps(self) -> float:
        """Frames per second."""
        return float(self.truth["fps"])


def load_mission(folder: Path, *, every: int = 1) -> Mission:
    """Read a mission's truth and masks.

    Args:
        folder: Folder with `mission.json`, `truth.json` and `masks/`.
        every: Read the masks of every n-th frame only.

    Raises:
        SettingsError: A file is missing or cannot be read.
    """
    truth = read_json(folder / "truth.json")
    labels: dict[str, int] = truth["labels"]
    masks = tuple(
        _masks(folder / "masks" / f"{row['index']:05d}.png", labels) if k % every == 0 else {}
        for k, row in enumerate(truth["frames"])
    )
    lag = max(1, round(LAG_S * float(truth["fps"]) / every)) * every
    width, height = truth["size"]
    with_velocity = tuple(
        moved_since(masks[max(0, k - lag)], current, lag / float(truth["fps"]), (width, height))
        for k, current in enumerate(masks)
    )
    return Mission(folder.name, read_json(folder / "mission.json"), truth, with_velocity)


def moved_since(
    before: Mapping[str, TrueMask],
    now: Mapping[str, TrueMask],
    dt: float,
    size: tuple[int, int],
) -> dict[str, TrueMask]:
    """Masks with the velocities of their outlines.

    Args:
        before: Earlier masks.
        now: The masks now.
        dt: Seconds between the two.
        size: (width, height) of the image, pixels.

    Returns:
        The present masks. Objects not visible before have no velocity; edges of occlusion by another object
        are ignored.
    """
    earlier = {name: _region(mask, size) for name, mask in before.items()}
    moved = {}
    for name, mask in now.items():
        velocity = None
        if name in earlier:
            others = [r for n, r in earlier.items() if n != name]
            velocity = _velocity(earlier[name], others, _region(mask, size), dt, size)
        moved[name] = replace(mask, velocity=velocity)
    return moved


@lru_cache(maxsize=64)  # a mask is needed again when it lies the lag before another
def _region(mask: TrueMask, size: tuple[int, int]) -> Region:
    return region_of(mask.inside > 0, 0, at=mask.at, size=size)


def _velocity(
    old: Region, others: Sequence[Region], new: Region, dt: float, size: tuple[int, int]
) -> tuple[float, float] | None:
    template = outline_template(old, others, size)
    if template is None:
        return None
    target = TargetOutline.of(prepared_outline(new).points)
    registration = register_outline(template, target, _displacements(old, new))
    return (
        None if registration is None else (registration.shift[0] / dt, registration.shift[1] / dt)
    )


def _displacements(old: Region, new: Region) -> Iterator[tuple[float, float]]:
    """Possible displacements, pixels: of the centroid and of each corner, as a side may be covered or cut."""
    (x, y), (x0, y0) = new.centroid, old.centroid
    yield x - x0, y - y0
    (left, top, width, height), (left0, top0, width0, height0) = new.bbox, old.bbox
    for right, low in product((0, 1), repeat=2):
        yield (
            float(left + right * width - left0 - right * width0),
            float(top + low * height - top0 - low * height0),
        )


def _masks(path: Path, labels: Mapping[str, int]) -> dict[str, TrueMask]:
    label_image = cv2.imread(opencv_name(path), cv2.IMREAD_GRAYSCALE)
    if label_image is None:
        raise SettingsError("a mask is missing or cannot be read", where=str(path))
    masks = {name: true_mask(np.asarray(label_image == label)) for name, label in labels.items()}
    return {name: mask for name, mask in masks.items() if mask is not None}


def true_mask(mask: NDArray[np.bool_]) -> TrueMask | None:
    """The distance representation of a whole-image mask (H, W) bool, or None if it is empty."""
    x, y, w, h = cv2.boundingRect(mask.astype(np.uint8))
    if w == 0:
        return None
    left, top = max(0, x - MARGIN), max(0, y - MARGIN)
    crop = mask[top : y + h + MARGIN, left : x + w + MARGIN].astype(np.uint8)
    # The image border is no outline: objects continue beyond it.
    distance = cv2.distanceTransform(crop, cv2.DIST_L2, 5) - cv2.distanceTransform(
        1 - crop, cv2.DIST_L2, 5
    )
    distance -= np.where(crop, 0.5, -0.5)
    eighths = np.clip(np.round(distance / _STEP), -127, 127).astype(np.int8)
    return TrueMask((left, top), eighths, int(np.count_nonzero(crop)))


class ContourNoise:
    """A random field that displaces outlines: smooth in space, half of its variance persistent in time.

    As measured on the outlines of visup's own segmenter, errors are correlated over some ten to twenty pixels
    of the outline; about half of their variance is new in each frame, and the rest persists for seconds.

    Args:
        sigma: Standard deviation, pixels.
        length: Correlation length, pixels.
        tau_s: Time constant of the persistent half, seconds.
        size: (width, height) of the image, pixels.
        rng: Random generator.
    """

    def __init__(
        self,
        sigma: float,
        length: float,
        tau_s: float,
        size: tuple[int, int],
        rng: np.random.Generator,
    ) -> None:
        self._sigma, self._cell, self._tau, self._rng = sigma, length / 2, tau_s, rng
        self._shape = (int(size[1] / self._cell) + 5, int(size[0] / self._cell) + 5)
        self._persistent = self._white_noise()
        self._time: float | None = None

    def _white_noise(self) -> NDArray[np.float32]:
        """White noise smoothed over neighbouring cells, with unit variance."""
        white = self._rng.standard_normal(self._shape, dtype=np.float32)
        smooth = cv2.GaussianBlur(white, (0, 0), 1.0, borderType=cv2.BORDER_REFLECT_101)
        return np.asarray(smooth * np.float32(2 * np.sqrt(np.pi)))

    def at(self, time: float, corner: tuple[int, int], shape: tuple[int, int]) -> NDArray[Any]:
        """The field over a part of the image.

        Args:
            time: Seconds, not before that of the last call.
            corner: (x, y) of the part, pixels.
            shape: Its (height, width).

        Returns:
            (height, width) float32, outward displacement of outlines in pixels.
        """
        if self._time is not None:
            keep = np.float32(np.exp(-(time - self._time) / self._tau))
            self._persistent = keep * self._persistent + np.sqrt(1 - keep**2) * self._white_noise()
        self._time = time
        field = np.sqrt(np.float32(0.5)) * (self._persistent + self._white_noise())
        # Interpolates between the cells.
        scaling = np.array([[1, 0, corner[0]], [0, 1, corner[1]]], dtype=np.float32) / self._cell
        scaling[:, 2] += 1.0
        part = cv2.warpAffine(
            field,
            scaling,
            (shape[1], shape[0]),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        return np.asarray(self._sigma * part)


def displaced_distance(mask: TrueMask, shift: NDArray[Any]) -> NDArray[Any]:
    """Signed distance of each pixel of the crop to the displaced outline, pixels; positive inside."""
    return np.asarray(mask.inside * np.float32(_STEP) + shift)
