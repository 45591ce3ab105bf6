"""Segmentation before a static camera, by background subtraction.

Motion layers need no static camera and detect slow objects from the first frame on, but small and thin
objects give them too few constraints. While the camera is static, foreground blobs are reported instead,
together with the layer regions that subtraction does not show: slow objects that were present when the
background model was initialised.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from visup.agent import Frame, Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.static_camera.background_model import (
    BackgroundModel,
    foreground_mask,
    initial_model,
    match_exposure,
    reveal_background,
    update_background,
    with_unknown,
)
from visup.percepts.motion.static_camera.blob_filters import (
    GHOST,
    THING,
    is_deep_shadow,
    merge_parts,
    outline_contrast,
)
from visup.percepts.motion.static_camera.blob_track import (
    BlobTrack,
    BlobTracks,
    Foreground,
    Mask,
    find_blobs,
)
from visup.percepts.motion.static_camera.blob_tracker import track_blobs
from visup.percepts.motion.static_camera.camera_static import is_camera_static
from visup.percepts.motion.static_camera.slow_motion import (
    GroundBelief,
    SlowChangeDetector,
    extend_by_slow_parts,
    is_nearly_still,
)
from visup.percepts.motion.static_camera.track_fusion import (
    FusionFrame,
    MotionEvidence,
    TrackFusion,
)
from visup.percepts.motion.tracks.id_allocator import IdAllocator
from visup.percepts.motion.tracks.measurements import FrameMeasurements

REST_S = 1.0  # how long the camera must be static before the background is used, seconds
LONGEST_S = 4.0
"""Most time at rest, seconds, that is credited against frames with too little structure."""
FLOODED = 0.6  # foreground share of the image above which the view itself has changed
MANY_CELLS = 15  # superpixels from which the layers resolve the outline of a region well
YOUNG_S = 0.3  # how long a track that was never reported is continued while missed, seconds
SIZE = 768  # longer side of the background model, pixels
KNOWN = 0.6  # least foreground share of a region when the background shows what lies behind it
START_S = 2.4  # age of the background up to which it may contain a newly reported object, seconds
STRIDE_PX, MAX_STRIDES = 4.0, 32  # step of a swept mask, background pixels; most steps
HALO = 7  # dilation of regions, pixels: an outline may be off by half as much


class StaticCameraSegmenter:
    """Blobs before the background of a static camera; one per video.

    Attributes:
        active: Whether the camera is static, and has been so for long enough.
    """

    def __init__(self) -> None:
        self._slow = SlowChangeDetector()
        self._forget()
        self._fusion = TrackFusion()

    def _forget(self) -> None:
        self._background: BackgroundModel | None = None
        self._tracks: BlobTracks = ()
        self._time = self._since = self._static_s = 0.0
        self._last_key = 0
        self._bare = GroundBelief()
        self._slow.reset()
        self.active = False

    def step(
        self,
        frame: Frame,
        scene: FrameMeasurements,
        regions: Sequence[Region],
        ids: IdAllocator,
        settings: MotionSettings,
        evidence: MotionEvidence,
    ) -> tuple[Region, ...]:
        """The regions to report for a frame.

        Args:
            frame: The frame.
            scene: Its measurements.
            regions: Regions of the motion layers.
            ids: Allocates public ids.
            settings: Settings of the segmenter.
            evidence: Points with independent motion.

        Returns:
            Regions by id: those of the layers unless the camera is static.
        """
        regions = self._completed(scene, regions, frame.size)
        fresh = [r for r in regions if not self._fusion.was_seen_recently(r.id)]
        self._fusion.note(regions, frame.time, settings.memory_s)
        many = MANY_CELLS * (settings.cell / scene.image.scale) ** 2
        foreground = self._foreground(frame, scene, regions, fresh, settings)
        if foreground is None:
            return self._fusion.passthrough(regions, ids, many)
        self.active = min(frame.time - self._since, self._static_s) >= REST_S
        if not self.active:
            return self._fusion.passthrough(regions, ids, many)
        fused = FusionFrame(frame.size, foreground, evidence, many)
        out, self._tracks = self._fusion.fuse(fused, self._tracks, regions, ids)
        return out

    def _completed(
        self, scene: FrameMeasurements, regions: Sequence[Region], size: tuple[int, int]
    ) -> tuple[Region, ...]:
        """The regions; slow ones that are older than the background are extended by their slow parts.

        The background model cannot show such parts, since the object hid the ground from the start.
        """
        scale = scene.image.scale
        old = [
            r
            for r in regions
            if (not self.active or self._fusion.predates_background(r.id))
            and is_nearly_still(r.velocity, scale)
        ]
        if self._static_s <= 0 or (self.active and not old):
            self._slow.reset()
            return tuple(regions)
        self._slow.update(scene.image)
        slow = self._slow.changed_pixels() if old else None
        if slow is None:
            return tuple(regions)
        slowly = {r.id for r in old}
        others = [r for r in regions if r.id not in slowly]
        known, parts = extend_by_slow_parts(old, others, slow, self._bare.share, scene, size)
        self._slow.set_parts(parts)
        whole = {r.id: r for r in known}
        return tuple(whole.get(r.id, r) for r in regions)

    def _foreground(
        self,
        frame: Frame,
        scene: FrameMeasurements,
        regions: Sequence[Region],
        fresh: Sequence[Region],
        settings: MotionSettings,
    ) -> Foreground | None:
        """The foreground; None while the camera moves or there is no background yet."""
        if not self._is_static(is_camera_static(scene), scene.seconds):
            return None
        image = _prepare(frame)
        if self._background is None:
            hidden = region_mask(regions, frame.size, image.shape[:2])
            self._background = with_unknown(initial_model(image), hidden)
            self._time = self._since = frame.time
            return None
        self._reveal(image, frame, regions, fresh)
        return self._track_blobs(image, frame.time, settings)

    def _reveal(
        self, image: Floats, frame: Frame, regions: Sequence[Region], fresh: Sequence[Region]
    ) -> None:
        """Correct a young background model for objects that were present when it was initialised.

        Where a newly reported region stands, or stood since then, the background becomes unknown; where it is
        unknown and no region hides it, it is initialised from the image.
        """
        assert self._background is not None
        background, shape = self._background, image.shape[:2]
        age = frame.time - self._since
        if fresh and age < START_S:
            change = foreground_mask(match_exposure(background, image), image)
            for r in fresh:
                here = region_mask([r], frame.size, shape)
                if change[here].mean() < KNOWN:
                    background = with_unknown(background, here & ~change)
                swept = swept_mask(here, r, age, shape[1] / frame.size[0])
                background = with_unknown(background, swept & ~here & change)
        reported = region_mask(regions, frame.size, shape)
        self._background = background
        reveal_background(background, image, ~reported)
        self._bare.reset(reported)

    def _is_static(self, static: bool | None, seconds: float) -> bool:
        """Whether the camera is static, as far as known; otherwise the state is reset."""
        step = seconds if static else -seconds
        self._static_s = min(max(self._static_s + step, 0.0), LONGEST_S)
        if static is False or self._static_s <= 0:
            self._forget()
        return self._static_s > 0

    def _track_blobs(
        self, image: Floats, now: float, settings: MotionSettings
    ) -> Foreground | None:
        """Track blobs and update the background; None when the frame shows another view."""
        assert self._background is not None
        seconds = max(now - self._time, 1e-3)
        self._time = now
        background = match_exposure(self._background, image)
        change = foreground_mask(background, image)
        self._bare.update(change | (background.seen_s <= 0), seconds)
        if change.mean() > FLOODED:
            self._forget()
            return None
        view = find_blobs(image, change, settings.least_blob * change.size, now, seconds)
        known, self._last_key = track_blobs(self._tracks, view, self._last_key)
        known = merge_parts(known)
        known = tuple(
            s if s.id else replace(s, shadow=is_deep_shadow(s, image, background.mean))
            for s in known
        )
        contrast = [outline_contrast(s, image, background.mean) for s in known]
        ghosts = [s for s, c in zip(known, contrast, strict=True) if c is not None and c < GHOST]
        things = [
            s for s, c in zip(known, contrast, strict=True) if s.id and c is not None and c > THING
        ]
        known = tuple(s for s in known if s not in ghosts)
        self._background = background
        gone = blob_mask(ghosts, change.shape) if ghosts else None
        # With a rim: at the outline an object blends into the ground, and the model would adapt to it there,
        # then further and further inwards.
        reported = _with_rim(blob_mask([s for s in known if s.id], change.shape))
        resting = _with_rim(blob_mask(things, change.shape))
        update_background(background, image, reported, seconds, gone, resting)
        self._tracks = tuple(
            s
            for s in known
            if now - s.last_seen <= (settings.missed_s if s.id else max(YOUNG_S, 2.5 * seconds))
        )
        return view


def _with_rim(mask: Mask) -> Mask:
    """A mask dilated by two pixels: pixels at an outline mix object and ground."""
    return np.asarray(cv2.dilate(mask.view(np.uint8), np.ones((5, 5), np.uint8)) > 0)


def _prepare(frame: Frame) -> Floats:
    """The frame at the size of the background model, slightly smoothed, (h, w, 3) float32 BGR."""
    image = frame.image
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = SIZE / max(frame.size)
    if scale < 1:
        size = (max(8, round(frame.size[0] * scale)), max(8, round(frame.size[1] * scale)))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return np.asarray(cv2.GaussianBlur(image, (3, 3), 0.7), dtype=np.float32)


def region_mask(regions: Sequence[Region], size: tuple[int, int], shape: tuple[int, int]) -> Mask:
    """(h, w) bool: the background pixels that regions may hide, dilated by `HALO`.

    Args:
        regions: In frame pixels.
        size: (width, height) of the frame.
        shape: (h, w) of the background.
    """
    out = np.zeros(shape, dtype=np.uint8)
    scale = shape[1] / size[0], shape[0] / size[1]
    for r in regions:
        x, y, w, h = r.bbox
        left, top = round(x * scale[0]), round(y * scale[1])
        right, bottom = (
            min(round((x + w) * scale[0]), shape[1]),
            min(round((y + h) * scale[1]), shape[0]),
        )
        if right > left and bottom > top:
            mask = cv2.resize(
                r.mask.view(np.uint8), (right - left, bottom - top), interpolation=cv2.INTER_NEAREST
            )
            out[top:bottom, left:right] |= np.asarray(mask, dtype=np.uint8)
    if not regions:
        return out.view(bool)
    return np.asarray(cv2.dilate(out, np.ones((HALO, HALO), np.uint8)) > 0)


def swept_mask(here: Mask, region: Region, seconds: float, scale: float) -> Mask:
    """The area that a region swept during the last seconds at its current velocity, (h, w) bool.

    Args:
        here: (h, w) bool, where it is.
        region: Gives the velocity, frame pixels per second.
        seconds: How far back.
        scale: Background pixels per frame pixel.
    """
    path = -np.asarray(region.velocity) * seconds * scale
    steps = int(np.clip(np.ceil(np.hypot(*path) / STRIDE_PX), 1, MAX_STRIDES))
    out = here.copy()
    for k in range(1, steps + 1):
        dx, dy = path * k / steps
        matrix = np.array([[1, 0, dx], [0, 1, dy]])
        moved = cv2.warpAffine(
            here.view(np.uint8), matrix, here.shape[::-1], flags=cv2.INTER_NEAREST
        )
        out |= moved > 0
    return out


def blob_mask(known: Sequence[BlobTrack], shape: tuple[int, int]) -> Mask:
    """(h, w) bool: the visible pixels of some objects."""
    out = np.zeros(shape, dtype=bool)
    for s in known:
        if s.visible is not None:
            (x0, y0, x1, y1), mask = s.visible
            out[y0:y1, x0:x1] |= mask
    return out
