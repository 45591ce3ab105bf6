"""Which regions are nothing but cast shadows: there the ground shows on, darker.

A shadow dims what it falls on by about one factor, keeps its colour, and keeps its texture; a body hides
all of that. So each region is compared with the ground as it was last seen bare, brought along with the
camera: where the two differ, what is seen must be the ground times one factor. That tells of what the
region covers only since it moved there, so evidence is gathered over frames, by region; once a region
has been seen to hide the ground it takes much to make it a shadow. Ground without texture tells less: there
the darkening must be quite even, and of the very same hue. (Colour after Horprasert, Harwood, Davis, 1999;
texture after Leone, Distante, Shadow detection for moving objects based on texture analysis, 2007.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, Region
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.tracks.measurements import FrameMeasurements

Mask = NDArray[np.bool_]
Doubles = NDArray[np.float64]
SIZE = 384  # longer side of the images that are compared, pixels
DELAY_S = 0.3  # what is seen bare counts when it was bare so long before, too: outlines lag behind
HALO = 7  # pixels: a region's outline may be off by half as much
DIMMED = (0.25, 0.93)  # brightness in a shadow, as a share of that of the ground
CHANGED = 8.0  # grey levels by which a pixel must differ from the ground to tell anything
LEAST, LEAST_SHARE = 25, 0.2  # pixels, and share of a region, that must differ
HUE = 0.06  # how far colour may differ, as a share of brightness
SHADED = 0.8  # share of what differs that must be darker ground
OPAQUE = 0.5  # share below which it surely is not
EVEN = 2.0  # how much brighter, relative to the ground, the bright parts of a shadow may be
DETAIL = 1.5  # standard deviation of texture that can be compared, grey levels
SAME_TEXTURE = 0.5  # correlation of textures from which the ground is seen through
OTHER_TEXTURE = 0.2  # correlation below which it is not
BARE_EVEN, BARE_HUE = 1.25, 0.03  # the same limits where the ground has no texture
FOR, AGAINST = 1.0, 1.5  # weight of a frame
BOUNDS = (-6.0, 3.0)
SURE = 2.0  # evidence from which a region is a shadow
STEP_PX = 0.5  # the ground is moved when it is off by so much: each time blurs it
MOST = 256  # regions of which evidence is remembered


@dataclass(frozen=True, slots=True, eq=False)
class BareGround:
    """What was seen where nothing moved, brought along with the camera.

    Attributes:
        bare: (h, w, 3) float32, as seen when it was bare for some time; NaN where it never was.
        latest: (h, w, 3) float32, as seen bare last.
        since: Seconds when `latest` was taken.
        off: (2, 3) float64, affine map by which both have to be moved yet, pixels.
    """

    bare: Floats
    latest: Floats
    since: float
    off: Doubles = field(default_factory=lambda: np.eye(2, 3))


class CastShadowFilter:
    """Leaves out the regions that are cast shadows; one per video."""

    def __init__(self) -> None:
        self._ground: BareGround | None = None
        self._evidence: dict[int, float] = {}

    def step(
        self,
        frame: Frame,
        image: Floats,
        scene: FrameMeasurements,
        regions: Sequence[Region],
        *,
        static: bool,
    ) -> tuple[Region, ...]:
        """The regions of a frame that are no shadows.

        Args:
            frame: The frame.
            image: The same as `comparable_image` makes it.
            scene: As measured; gives the camera's motion since the frame before.
            regions: All that move, frame pixels.
            static: Whether the camera is known to be static.

        Returns:
            Those that are left, in the same order.
        """
        ground = self._ground
        if ground is None or ground.bare.shape != image.shape:
            nowhere = np.full_like(image, np.nan)
            self._ground = BareGround(nowhere, nowhere, frame.time - DELAY_S)
            return tuple(regions)
        if not static:
            ground = _followed(ground, scene)
        for r in regions:
            self._weigh(r, image, ground, frame)
        self._ground = _renewed(ground, image, _covered(regions, frame, image), frame.time)
        self._evidence = dict(list(self._evidence.items())[-MOST:])
        return tuple(r for r in regions if self._evidence.get(r.id, 0.0) < SURE)

    def _weigh(self, region: Region, image: Floats, ground: BareGround, frame: Frame) -> None:
        before = self._evidence.pop(region.id, 0.0)  # what is weighed anew comes last
        now = before + shadow_evidence(*_cut(region, image, ground, frame))
        self._evidence[region.id] = min(max(now, BOUNDS[0]), BOUNDS[1])


def shadow_evidence(now: Floats, ground: Floats, where: Mask) -> float:
    """What one frame says for (positive) or against (negative) a region's being a shadow.

    Args:
        now: (h, w, 3) float32, the image about the region.
        ground: (h, w, 3) float32, the same as it was seen bare; NaN where it never was.
        where: (h, w) bool, the region.

    Returns:
        The weight; 0 when nothing can be told.
    """
    known = where & np.isfinite(ground[..., 0])
    rest = np.where(known[..., None], ground, 0)
    gap = now - rest
    differs = known & (np.einsum("ijk,ijk->ij", gap, gap) > 3 * CHANGED**2)
    if differs.sum() < max(LEAST, LEAST_SHARE * where.sum()):
        return 0.0
    a, b = now[differs], rest[differs]
    power = np.einsum("ij,ij->i", b, b) + 1.0
    bright = np.einsum("ij,ij->i", a, b) / power
    off = a - bright[:, None] * b
    hue = np.sqrt(np.einsum("ij,ij->i", off, off) / power)
    dim = (bright > DIMMED[0]) & (bright < DIMMED[1]) & (hue < HUE + 6.0 / np.sqrt(power))
    shaded = float(dim.mean())
    if shaded < OPAQUE:
        return -AGAINST
    low, high = np.quantile(bright[dim], [0.1, 0.9]).tolist()
    if shaded < SHADED or high > EVEN * low:
        return 0.0
    seen_through = _texture_agreement(now, rest, differs)
    if seen_through is None:
        even = high < BARE_EVEN * low and float(np.quantile(hue, 0.9)) < BARE_HUE
        return FOR / 2 if even else 0.0
    if seen_through > SAME_TEXTURE:
        return FOR
    return -AGAINST if seen_through < OTHER_TEXTURE else 0.0


def _texture_agreement(now: Floats, ground: Floats, where: Mask) -> float | None:
    """Correlation of the detail of two images within a mask; None where there is none to compare."""
    inside = cv2.erode(where.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    if inside.sum() < LEAST:
        return None
    a, b = (_detail(image, where)[inside] for image in (now, ground))
    if float(b.std()) < DETAIL:
        return None
    return float((a * b).mean() / (a.std() * b.std() + 1e-6))


def _detail(image: Floats, where: Mask) -> Floats:
    """What differs from the mean around, within a mask, (h, w)."""
    grey = np.where(where, image.mean(axis=2), 0).astype(np.float32)
    count = cv2.blur(where.astype(np.float32), (7, 7))
    return np.asarray(grey - cv2.blur(grey, (7, 7)) / np.maximum(count, 1e-3), dtype=np.float32)


def comparable_image(frame: Frame) -> Floats:
    """A frame as it is compared with the ground, (h, w, 3) float32, at most SIZE pixels long."""
    image = frame.image
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = min(1.0, SIZE / max(frame.size))
    size = (max(8, round(frame.size[0] * scale)), max(8, round(frame.size[1] * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.float32)


def _followed(ground: BareGround, scene: FrameMeasurements) -> BareGround:
    """The ground where it lies in the newest image."""
    if not scene.measured:
        return ground
    height, width = ground.bare.shape[:2]
    step = -np.asarray(scene.measured[0].background.models[-1].matrix, dtype=np.float64)
    step[:, 2] *= width / scene.image.shape[1]
    # From the newest image back to the one before, and on to the one that the ground was moved to last.
    back = np.vstack([step + np.eye(2, 3), [0.0, 0.0, 1.0]])
    off = ground.off @ back
    corners = np.array([[0, 0, 1], [width, 0, 1], [0, height, 1], [width, height, 1]]).T
    if np.abs((off - np.eye(2, 3)) @ corners).max() < STEP_PX:
        return replace(ground, off=off)
    return BareGround(_moved(ground.bare, off), _moved(ground.latest, off), ground.since)


def _moved(image: Floats, back: Doubles) -> Floats:
    """An image moved by an affine map from new places to old ones; NaN where nothing was seen."""
    size, flags = image.shape[1::-1], cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    nothing = (np.nan, np.nan, np.nan)
    return np.asarray(
        cv2.warpAffine(image, back, size, flags=flags, borderValue=nothing), dtype=np.float32
    )


def _renewed(ground: BareGround, image: Floats, covered: Mask, now: float) -> BareGround:
    """The ground after one more image."""
    if now - ground.since < DELAY_S:
        return ground
    bare = ~covered[..., None]
    settled = bare & np.isfinite(ground.latest)
    return replace(
        ground,
        bare=np.where(settled, ground.latest, ground.bare),
        latest=np.where(bare, image, np.float32(np.nan)),
        since=now,
    )


def _covered(regions: Sequence[Region], frame: Frame, image: Floats) -> Mask:
    out = np.zeros(image.shape[:2], dtype=np.uint8)
    for r in regions:
        (x0, y0, x1, y1), mask = _scaled(r, frame, image)
        out[y0:y1, x0:x1] |= mask.view(np.uint8)
    return np.asarray(cv2.dilate(out, np.ones((HALO, HALO), np.uint8)) > 0)


def _cut(
    region: Region, image: Floats, ground: BareGround, frame: Frame
) -> tuple[Floats, Floats, Mask]:
    (x0, y0, x1, y1), mask = _scaled(region, frame, image)
    part = np.s_[y0:y1, x0:x1]
    return image[part], ground.bare[part], mask


def _scaled(region: Region, frame: Frame, image: Floats) -> tuple[tuple[int, int, int, int], Mask]:
    """A region's box (x0, y0, x1, y1) and mask in the pixels of a smaller image."""
    sx, sy = image.shape[1] / frame.size[0], image.shape[0] / frame.size[1]
    x, y, w, h = region.bbox
    x0, y0 = min(int(x * sx), image.shape[1] - 1), min(int(y * sy), image.shape[0] - 1)
    x1, y1 = max(x0 + 1, round((x + w) * sx)), max(y0 + 1, round((y + h) * sy))
    x1, y1 = min(x1, image.shape[1]), min(y1, image.shape[0])
    small = cv2.resize(
        region.mask.view(np.uint8), (x1 - x0, y1 - y0), interpolation=cv2.INTER_NEAREST
    )
    return (x0, y0, x1, y1), np.asarray(small > 0).reshape(y1 - y0, x1 - x0)
