"""How an object looked when it came to rest, and how far it has shifted since.

An object that sets out slowly changes few pixels at first: only its edges. The shift is the least squares
solution of the brightness constancy equation over the whole object (Lucas and Kanade, "An iterative image
registration technique with an application to stereo vision", 1981), with gain and offset of the light
(Hager and Belhumeur, "Efficient region tracking with parametric models of geometry and illumination", 1998).

An approximation: it is one linear step. Shifts of more than about 2 working pixels are underestimated, and a
rotation is measured only as far as it shifts the object.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.models.blob import Blob
from visup.percepts.appearance.models.pose import Bytes, Doubles
from visup.percepts.appearance.models.scene import Scene

Floats = NDArray[np.float32]

_BLUR = 1.5  # standard deviation of the smoothing that makes brightness linear, working pixels
_MARGIN = 2  # how far the compared pixels extend beyond the outline, working pixels
_MAX_PIXELS = 4000  # most pixels that are compared
_CERTAIN = 0.5  # explained share of the change from which it is a shift, not an occluder or light


@dataclass(frozen=True, slots=True, eq=False)
class RestMemory:
    """The pixels of an object at rest, to be compared with later frames.

    Attributes:
        blob: The object, as completely as observed.
        lab: (h, w, 3) uint8, Lab, of the blob's window.
        support: (N,) int64, indices of the compared pixels in the window.
        grey: (N,) float32, their smoothed brightness.
        light: (N, 2) float32, orthonormal: how they change with gain and offset of the light.
        motion: (N, 2) float32: how they change per pixel of shift to the right and down, but for `light`.
        solution: (2, 2) float64, inverse of the normal equations of `motion`.
    """

    blob: Blob
    lab: Bytes
    support: NDArray[np.int64]
    grey: Floats
    light: Floats
    motion: Floats
    solution: Doubles


@dataclass(frozen=True, slots=True)
class Displacement:
    """How far an object has shifted from where it rested.

    Attributes:
        dx: To the right, working pixels.
        dy: Down, working pixels.
        explained: Share of the change in brightness that the shift explains, 0 to 1.
    """

    dx: float
    dy: float
    explained: float

    @property
    def certain(self) -> bool:
        """Whether the object has shifted rather than changed in another way."""
        return self.explained >= _CERTAIN

    @property
    def length(self) -> float:
        """Working pixels."""
        return float(np.hypot(self.dx, self.dy))


def remember_at_rest(scene: Scene, blob: Blob) -> RestMemory:
    """The memory of an object that has come to rest."""
    left, top, right, bottom = blob.window
    lab = scene.lab[0][top:bottom, left:right].copy()
    grey = _smooth(lab[..., 0])
    support = _compared_pixels(blob.mask)
    here = grey.ravel()[support]
    light = np.linalg.qr(np.stack([here, np.ones_like(here)], axis=1))[0].astype(np.float32)
    slopes = (cv2.Scharr(grey, cv2.CV_32F, *axis) for axis in ((1, 0), (0, 1)))
    change = np.stack([-s.ravel()[support] / 32 for s in slopes], axis=1)
    motion = np.asarray(change - light @ (light.T @ change), dtype=np.float32)
    solution = np.asarray(np.linalg.pinv(motion.T @ motion), dtype=np.float64)
    return RestMemory(blob, lab, support, here, light, motion, solution)


def displacement_since(rest: RestMemory, scene: Scene) -> Displacement:
    """How far the object has shifted in a frame since it came to rest."""
    left, top, right, bottom = rest.blob.window
    now = _smooth(scene.grey[top:bottom, left:right])
    change = now.ravel()[rest.support] - rest.grey
    change -= rest.light @ (rest.light.T @ change)
    seen = (rest.motion.T @ change).astype(np.float64)
    dx, dy = (rest.solution @ seen).tolist()
    whole = float(change @ change)
    return Displacement(dx, dy, float(seen @ (dx, dy)) / whole if whole > 0 else 0.0)


def _smooth(grey: Bytes) -> Floats:
    return np.asarray(cv2.GaussianBlur(grey.astype(np.float32), (0, 0), _BLUR), dtype=np.float32)


def _compared_pixels(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(N,) int64: indices of pixels on an object and just beyond its outline, evenly thinned out."""
    size = 2 * _MARGIN + 1
    near = cv2.dilate(mask.view(np.uint8), np.ones((size, size), np.uint8))
    step = int(np.ceil(np.sqrt(np.count_nonzero(near) / _MAX_PIXELS)))
    thin = np.zeros_like(near)
    thin[::step, ::step] = near[::step, ::step]
    return np.flatnonzero(thin)
