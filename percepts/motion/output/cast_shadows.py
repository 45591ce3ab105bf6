"""Cast-shadow removal: regions where the ground is only darkened are not objects.

A shadow dims the ground by about one factor and keeps its colour and texture; a body hides them. So each
region is compared with the ground as last seen bare, warped along with the camera: where the two differ,
the image must be the ground times one factor. One frame says this only of ground that the region has just
covered, so evidence is accumulated over frames; a region that was seen to hide the ground needs much to
become a shadow. Untextured ground is weaker evidence: there the darkening must be uniform and of the same
hue. (Colour after Horprasert, Harwood, Davis, 1999; texture after Leone, Distante, Shadow detection for
moving objects based on texture analysis, 2007.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.agent import Frame, Region
from visup.percepts.motion.features.work_image import Floats, reduced
from visup.percepts.motion.output._cast_shadows_jit import changed_tones, masked_greys
from visup.percepts.motion.tracks.measurements import FrameMeasurements

Mask = NDArray[np.bool_]
Doubles = NDArray[np.float64]
SIZE = 384  # longer side of the images that are compared, pixels
DELAY_S = 0.3  # ground must have been bare for this long to count: outlines lag behind
HALO = 7  # pixels: a region's outline may be off by half as much
SHADOW_BRIGHTNESS = (0.25, 0.93)  # brightness in a shadow, as a share of that of the ground
CHANGED = 8.0  # grey levels by which a pixel must differ from the ground to be evidence
LEAST, MIN_SHARE = 25, 0.2  # pixels, and share of a region, that must differ
HUE = 0.06  # most difference of colour, as a share of brightness
SHADOW_SHARE = 0.8  # share of the differing pixels that must be darker ground
OPAQUE_SHARE = 0.5  # share below which it is certainly no shadow
MAX_UNEVENNESS = 2.0
"""Most ratio of the bright parts of a shadow to the dark ones, relative to the ground."""
MIN_TEXTURE = 1.5  # least standard deviation of comparable texture, grey levels
SAME_TEXTURE = 0.5  # correlation of textures from which the ground shows through
OTHER_TEXTURE = 0.2  # correlation below which it does not
PLAIN_UNEVENNESS, PLAIN_HUE = 1.25, 0.03  # the same limits where the ground has no texture
FRAME_FOR, FRAME_AGAINST = 1.0, 1.5  # weight of a frame
EVIDENCE_BOUNDS = (-6.0, 3.0)
RECHECK_FRAMES = 4  # frames from one look to the next at a region that is certainly none
SHADOW_EVIDENCE = 2.0  # evidence from which a region counts as a shadow
STEP_PX = 0.5  # the ground is warped where it is off by this much: each warp blurs it
MOST = 256  # most regions with stored evidence


@dataclass(frozen=True, slots=True, eq=False)
class BareGround:
    """The ground as seen where nothing moved, and how the camera has moved since.

    Both images are warped only when they are renewed, and in between the part that is looked at.

    Attributes:
        bare: (h, w, 3) float32, seen bare for at least `DELAY_S`; NaN where it never was.
        latest: (h, w, 3) float32, as last seen bare.
        since: Seconds when `latest` was taken.
        off: (2, 3) float64, affine map from the newest image to both, pixels.
    """

    bare: Floats
    latest: Floats
    since: float
    off: Doubles = field(default_factory=lambda: np.eye(2, 3))


class CastShadowFilter:
    """Removes regions that are cast shadows; one per video."""

    def __init__(self) -> None:
        self._ground: BareGround | None = None
        self._evidence: dict[int, float] = {}
        self._frames = 0

    def step(
        self,
        frame: Frame,
        scene: FrameMeasurements,
        regions: Sequence[Region],
        *,
        static: bool,
    ) -> tuple[Region, ...]:
        """The regions of a frame that are no shadows.

        Args:
            frame: The frame.
            scene: Its measurements, for the camera's motion since the previous frame.
            regions: All that move, frame pixels.
            static: Whether the camera is known to be static.

        Returns:
            The remaining regions, in the same order.
        """
        self._frames += 1
        if self._ground is not None and not static:
            self._ground = _aligned(self._ground, scene)
        due = [r for r in regions if self._is_due(r)]
        if due or self._ground is None or frame.time - self._ground.since >= DELAY_S:
            self._compare(frame, regions, due)
        return tuple(r for r in regions if self._evidence.get(r.id, 0.0) < SHADOW_EVIDENCE)

    def _is_due(self, region: Region) -> bool:
        """Whether a region is looked at; what has long been no shadow is in turn with others."""
        certainly_none = self._evidence.get(region.id, 0.0) <= EVIDENCE_BOUNDS[0]
        return not certainly_none or (self._frames + region.id) % RECHECK_FRAMES == 0

    def _compare(self, frame: Frame, regions: Sequence[Region], due: Sequence[Region]) -> None:
        """Compare regions with the ground, and renew the ground when it is due."""
        image, ground = comparable_image(frame), self._ground
        if ground is None or ground.bare.shape != image.shape:
            nowhere = np.full_like(image, np.nan)
            self._ground = BareGround(nowhere, nowhere, frame.time - DELAY_S)
            return
        for r in due:
            self._accumulate(r, image, ground, frame)
        if frame.time - ground.since >= DELAY_S:
            covered = _covered(regions, frame, image)
            self._ground = _updated(ground, image, covered, frame.time)
        self._evidence = dict(list(self._evidence.items())[-MOST:])

    def _accumulate(self, region: Region, image: Floats, ground: BareGround, frame: Frame) -> None:
        before = self._evidence.pop(
            region.id, 0.0
        )  # reinserted: the oldest entries are dropped first
        now = before + shadow_evidence(*_cut(region, image, ground, frame))
        self._evidence[region.id] = min(max(now, EVIDENCE_BOUNDS[0]), EVIDENCE_BOUNDS[1])


def shadow_evidence(now: Floats, ground: Floats, where: Mask) -> float:
    """One frame's evidence for (positive) or against (negative) a region being a shadow.

    Args:
        now: (h, w, 3) float32, the image about the region.
        ground: (h, w, 3) float32, the ground there as seen bare; NaN where it never was.
        where: (h, w) bool, the region.

    Returns:
        The evidence; 0 when there is none.
    """
    now, ground = np.ascontiguousarray(now), np.ascontiguousarray(ground)
    differs, bright, tint, power = changed_tones(now, ground, where, 3 * CHANGED**2)
    if len(bright) < max(LEAST, MIN_SHARE * np.count_nonzero(where)):
        return 0.0
    hue = np.sqrt(tint)
    dim = (
        (bright > SHADOW_BRIGHTNESS[0])
        & (bright < SHADOW_BRIGHTNESS[1])
        & (hue < HUE + 6.0 / np.sqrt(power))
    )
    shaded = float(dim.mean())
    if shaded < OPAQUE_SHARE:
        return -FRAME_AGAINST
    low, high = np.quantile(bright[dim], [0.1, 0.9]).tolist()
    if shaded < SHADOW_SHARE or high > MAX_UNEVENNESS * low:
        return 0.0
    seen_through = _texture_agreement(now, ground, differs)
    if seen_through is None:
        even = high < PLAIN_UNEVENNESS * low and float(np.quantile(hue, 0.9)) < PLAIN_HUE
        return FRAME_FOR / 2 if even else 0.0
    if seen_through > SAME_TEXTURE:
        return FRAME_FOR
    return -FRAME_AGAINST if seen_through < OTHER_TEXTURE else 0.0


def _texture_agreement(now: Floats, ground: Floats, where: Mask) -> float | None:
    """Correlation of the detail of two images within a mask; None without texture to compare."""
    inside = cv2.erode(where.view(np.uint8), np.ones((3, 3), np.uint8)) > 0
    if inside.sum() < LEAST:
        return None
    a, b = (_detail(image, where)[inside] for image in (now, ground))
    if float(b.std()) < MIN_TEXTURE:
        return None
    return float((a * b).mean() / (a.std() * b.std() + 1e-6))


def _detail(image: Floats, where: Mask) -> Floats:
    """Difference from the local mean within a mask, (h, w)."""
    grey = masked_greys(image, where)
    count = cv2.blur(where.astype(np.float32), (7, 7))
    return np.asarray(grey - cv2.blur(grey, (7, 7)) / np.maximum(count, 1e-3), dtype=np.float32)


def comparable_image(frame: Frame) -> Floats:
    """A frame prepared for comparison with the ground, (h, w, 3) float32, at most SIZE pixels long."""
    image = frame.image
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    return reduced(image, SIZE).astype(np.float32)


def _aligned(ground: BareGround, scene: FrameMeasurements) -> BareGround:
    """The ground with the camera's motion to the newest image."""
    if not scene.measured:
        return ground
    width = ground.bare.shape[1]
    step = -np.asarray(scene.measured[0].background.models[-1].matrix, dtype=np.float64)
    step[:, 2] *= width / scene.image.shape[1]
    # From the newest image to the previous one, composed with the map from there.
    back = np.vstack([step + np.eye(2, 3), [0.0, 0.0, 1.0]])
    return replace(ground, off=ground.off @ back)


def _is_off(ground: BareGround) -> bool:
    """Whether the ground has to be warped to fit the newest image."""
    height, width = ground.bare.shape[:2]
    corners = np.array([[0, 0, 1], [width, 0, 1], [0, height, 1], [width, height, 1]]).T
    return bool(np.abs((ground.off - np.eye(2, 3)) @ corners).max() >= STEP_PX)


def _bare_part(ground: BareGround, box: tuple[int, int, int, int]) -> Floats:
    """The bare ground in a box (x0, y0, x1, y1) of the newest image."""
    x0, y0, x1, y1 = box
    if not _is_off(ground):
        return ground.bare[y0:y1, x0:x1]
    back = ground.off.copy()
    back[:, 2] += back[:, :2] @ np.array([x0, y0])
    return _moved(ground.bare, back, (x1 - x0, y1 - y0))


def _moved(image: Floats, back: Doubles, size: tuple[int, int]) -> Floats:
    """A (width, height) image, warped by an affine map from new to old positions; NaN outside the old one."""
    flags, nothing = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, (np.nan, np.nan, np.nan)
    return np.asarray(
        cv2.warpAffine(image, back, size, flags=flags, borderValue=nothing), dtype=np.float32
    )


def _updated(ground: BareGround, image: Floats, covered: Mask, now: float) -> BareGround:
    """The ground updated by one more image."""
    known, latest, off = ground.bare, ground.latest, ground.off
    if _is_off(ground):
        size = (image.shape[1], image.shape[0])
        known, latest, off = _moved(known, off, size), _moved(latest, off, size), np.eye(2, 3)
    bare = ~covered[..., None]
    confirmed_bare = bare & np.isfinite(latest)
    return BareGround(
        np.where(confirmed_bare, latest, known), np.where(bare, image, np.float32(np.nan)), now, off
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
    box, mask = _scaled(region, frame, image)
    x0, y0, x1, y1 = box
    return image[y0:y1, x0:x1], _bare_part(ground, box), mask


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
