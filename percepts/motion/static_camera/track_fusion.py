"""Track fusion while the camera is static: blobs and layer regions reported once per object.

An object found by both is reported as its blob, under the id under which it was reported first.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np

from visup.agent import Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines.region_outline import describe_mask
from visup.percepts.motion.static_camera.blob_filters import is_salient_blob
from visup.percepts.motion.static_camera.blob_track import BlobTrack, BlobTracks, Foreground
from visup.percepts.motion.static_camera.side_by_side import SLENDER, are_side_by_side
from visup.percepts.motion.tracks.id_allocator import IdAllocator

FOREGROUND_SHARE = 0.4  # foreground share of a region from which background subtraction shows it
MIN_OVERLAP = 0.5  # least overlap of two outlines of one object, as a share of the smaller
WHOLE_IOU = 0.6  # intersection over union above which background subtraction shows all of an object
MAIN_SHARE = 0.4
"""Least share of a region that a blob must fill to take over its id: a limb fills less."""
MISSED_SHARE = 0.15
"""Share of a region's motion evidence outside of the foreground, above which parts are missed."""
MIN_SIZE = 0.35  # least size of a body in a region, as a share of the largest body there
LARGE_FACTOR = 4.0  # least area of a region of which parts may be missed, in `well_known_area`
EVIDENCE_DECAY = 0.9  # decay factor of motion evidence per frame
NEAR_PX = 5  # tolerance, pixels: points lie on edges, half of them outside of the blob
MIN_AREA = 0.0005  # least area of an object when first reported, as a share of the image


@dataclass(frozen=True, slots=True, eq=False)
class MotionEvidence:
    """Points with independent motion.

    Attributes:
        xy: (N, 2) float32, frame pixels.
        sure: (N,) float32, log likelihood ratio of moving with their region against being at rest.
    """

    xy: Floats
    sure: Floats


@dataclass(frozen=True, slots=True, eq=False)
class FusionFrame:
    """Inputs of the fusion of one frame besides blobs and regions.

    Attributes:
        size: (width, height) of the frame.
        foreground: Its foreground.
        evidence: Points with independent motion.
        well_known_area: Area from which the layers resolve an outline well, frame pixels.
    """

    size: tuple[int, int]
    foreground: Foreground
    evidence: MotionEvidence
    well_known_area: float


class TrackFusion:
    """Fuses blobs and layer regions, and assigns public ids; one per video."""

    def __init__(self) -> None:
        # All by the layers' id of a region.
        self._last: dict[int, float] = {}  # time when it was last seen
        self._reported_without_blob: set[int] = set()  # regions that were reported without blobs
        self._alias: dict[int, int] = {}  # id under which it is reported, if another one
        # Well resolved regions that are older than the background model, not yet shown by a blob.
        self._predating: set[int] = set()
        self._missed_evidence: dict[int, tuple[float, float]] = {}  # outside the foreground, all

    def was_seen_recently(self, number: int) -> bool:
        """Whether a region of the layers was seen recently."""
        return number in self._last

    def predates_background(self, number: int) -> bool:
        """Whether a region was reported before the background was known, and is not yet shown by a blob."""
        return number in self._predating

    def note(self, regions: Sequence[Region], now: float, memory_s: float) -> None:
        """Record the current regions of the layers, and forget expired ones.

        Args:
            regions: Regions of a frame, each under the layers' id.
            now: Seconds.
            memory_s: How long the layers remember occluded regions, seconds.
        """
        self._last |= {r.id: now for r in regions}
        gone = {i for i, last in self._last.items() if now - last > memory_s}
        for i in gone:
            del self._last[i]
            self._alias.pop(i, None)
            self._missed_evidence.pop(i, None)
        self._predating -= gone
        self._reported_without_blob -= gone - set(self._alias.values())

    def passthrough(
        self, regions: Sequence[Region], ids: IdAllocator, well_known_area: float
    ) -> tuple[Region, ...]:
        """Regions of the layers, reported without blobs.

        Args:
            regions: Regions of the layers, each under the layers' id.
            ids: Allocates new ids.
            well_known_area: Area from which the layers resolve an outline well, frame pixels.

        Returns:
            The same regions under their public ids, sorted by id.
        """
        self._reported_without_blob |= {r.id for r in regions}
        self._predating |= {r.id for r in regions if r.area >= well_known_area}
        taken: set[int] = set()
        out = []
        for r in regions:
            number = self._public_id(r, taken, ids)
            taken.add(number)
            out.append(replace(r, id=number))
        return tuple(sorted(out, key=lambda r: r.id))

    def fuse(
        self, frame: FusionFrame, blobs: BlobTracks, regions: Sequence[Region], ids: IdAllocator
    ) -> tuple[tuple[Region, ...], BlobTracks]:
        """Report each object once, as its blob or as its region of the layers.

        Args:
            frame: Inputs of the frame.
            blobs: Blob tracks; salient ones are given ids.
            regions: Regions of the layers, each under the layers' id.
            ids: Allocates new ids.

        Returns:
            The reported regions, sorted by public id, and the blob tracks with their public ids.
        """
        seen = _visible_regions(blobs, frame)
        numbered = {s.id: seen[s.key] for s in blobs if s.id and s.key in seen}
        # Background subtraction resolves small regions better, such as people who walk together.
        large = [r for r in regions if r.area >= LARGE_FACTOR * frame.well_known_area]
        missed = self._with_missed_parts(large, tuple(numbered.values()), frame)
        older, heirs = self._preferred_regions(regions, seen, missed)
        out: list[Region] = []
        known: list[BlobTrack] = []
        taken = {s.id for s in blobs} | {self._known_id(r) for r in older}
        for s in blobs:
            if s.key in heirs and heirs[s.key] not in taken:
                s = replace(s, id=heirs[s.key])
            own = seen.get(s.key)
            free = own is not None and not any(_is_mostly_in(own, r) for r in older)
            if (
                own is not None
                and free
                and not s.id
                and self._is_new(s, own, frame, large, numbered)
            ):
                s = replace(s, id=self._blob_id(own, regions, ids, taken))
            taken.add(s.id)
            known.append(s)
            if own is not None and free and s.id:
                out.append(replace(own, id=s.id))
        return self._merge_reports(out, regions, older, frame, ids), tuple(known)

    def _merge_reports(
        self,
        blobs: list[Region],
        regions: Sequence[Region],
        older: Sequence[Region],
        frame: FusionFrame,
        ids: IdAllocator,
    ) -> tuple[Region, ...]:
        """The reported blobs, and the regions of objects that background subtraction shows badly or not."""
        out, labels = blobs, frame.foreground.labels
        change = cv2.resize(
            (labels > 0).view(np.uint8), frame.size, interpolation=cv2.INTER_NEAREST
        )
        for r in regions:
            x, y, w, h = r.bbox
            if r not in older and self._is_shown(r, out):
                continue
            if r not in older and change[y : y + h, x : x + w][r.mask].mean() >= FOREGROUND_SHARE:
                self._note_alias(r, out)
                # A small region that was reported stays so until its blob is reported.
                small = r.id in self._reported_without_blob and r.area < frame.well_known_area
                if not small or any(common_pixels(s, r) for s in out):
                    continue
            out = [s for s in out if not common_pixels(s, r) >= MIN_OVERLAP * s.area]
            out.append(replace(r, id=self._public_id(r, {s.id for s in out}, ids)))
        return tuple(sorted(out, key=lambda r: r.id))

    def _is_shown(self, r: Region, blobs: Sequence[Region]) -> bool:
        """Whether the blob of a region is reported.

        The region need not be covered by the blob: a layer at rest grows into the ground, since both move
        alike.
        """
        return any(
            s.id == self._known_id(r) and common_pixels(s, r) > MIN_OVERLAP * min(s.area, r.area)
            for s in blobs
        )

    def _known_id(self, r: Region) -> int:
        """The id under which a region was reported, its own if never."""
        return self._alias.get(r.id, r.id)

    def _public_id(self, r: Region, taken: Collection[int], ids: IdAllocator) -> int:
        """The id under which a region is reported: as before, else its own, else a new permanent one."""
        for number in (self._known_id(r), r.id):
            if number not in taken:
                return number
        self._alias[r.id] = ids.new()
        return self._alias[r.id]

    def _is_new(
        self,
        s: BlobTrack,
        own: Region,
        frame: FusionFrame,
        regions: Sequence[Region],
        numbered: Mapping[int, Region],
    ) -> bool:
        """Whether a blob is a new object: large enough, salient, and not a part of another one."""
        large = own.area >= MIN_AREA * (frame.size[0] * frame.size[1])
        return large and is_salient_blob(s) and not self._is_part(own, regions, numbered)

    def _with_missed_parts(
        self, regions: Sequence[Region], seen: Sequence[Region], frame: FusionFrame
    ) -> set[int]:
        """Ids of regions of which background subtraction misses parts: of the background's tone, or slow.

        The evidence is points outside of the foreground that move with the region, not with the background.
        """
        shown = np.zeros(frame.size[::-1], dtype=np.uint8)
        for s in seen:
            x, y, w, h = s.bbox
            shown[y : y + h, x : x + w] |= s.mask
        beside = cv2.dilate(shown, np.ones((NEAR_PX, NEAR_PX), np.uint8)) > 0
        column, row = np.clip(frame.evidence.xy.astype(np.int64), 0, np.array(frame.size) - 1).T
        out = set()
        for r in regions:
            x, y, w, h = r.bbox
            box = (column >= x) & (column < x + w) & (row >= y) & (row < y + h)
            mine = np.flatnonzero(box)
            mine = mine[r.mask[row[mine] - y, column[mine] - x]]
            sure = np.maximum(frame.evidence.sure[mine], 0)
            lost = float(sure[~beside[row[mine], column[mine]]].sum())
            before = self._missed_evidence.get(r.id, (0.0, 0.0))
            now = EVIDENCE_DECAY * before[0] + lost, EVIDENCE_DECAY * before[1] + float(sure.sum())
            self._missed_evidence[r.id] = now
            if now[0] > MISSED_SHARE * max(now[1], 1.0):
                out.add(r.id)
        return out

    def _preferred_regions(
        self, regions: Sequence[Region], seen: Mapping[int, Region], missed: set[int]
    ) -> tuple[list[Region], dict[int, int]]:
        """Regions to be reported instead of blobs, and the ids of others that pass to blobs.

        Reported are regions with missed parts, and those older than the background model that no blob shows
        completely yet. Once blobs do, the largest of them inherits the region's public id.

        Args:
            regions: Regions of the layers.
            seen: Visible blobs, by key.
            missed: Ids of regions with missed parts.

        Returns:
            The regions, and for each heir its key -> the public id.
        """
        out, heirs = [], {}
        for r in regions:
            if r.id in missed:
                out.append(r)
                continue
            if r.id not in self._predating:
                continue
            parts = _blobs_covering(r, seen)
            if not parts:
                out.append(r)
                continue
            self._predating.discard(r.id)
            heirs[parts[0]] = self._known_id(r)
        return out, heirs

    def _is_part(
        self, own: Region, regions: Sequence[Region], numbered: Mapping[int, Region]
    ) -> bool:
        """Whether an unreported blob touches a reported one of the same region."""
        for r in regions:
            host = numbered.get(self._known_id(r))
            if (
                host is not None
                and common_pixels(own, r) > MIN_OVERLAP * own.area
                and are_near(own, host)
            ):
                return True
        return False

    def _blob_id(
        self, own: Region, regions: Sequence[Region], ids: IdAllocator, taken: Collection[int]
    ) -> int:
        """The id of a new blob: the one under which it was reported before, or a new one."""
        for r in regions:
            number = self._known_id(r)
            main = common_pixels(own, r) > MAIN_SHARE * r.area
            if number in self._reported_without_blob and number not in taken and main:
                return number
        return ids.new()

    def _note_alias(self, r: Region, reported: Sequence[Region]) -> None:
        """Record the id under which a region of the layers is reported."""
        best = max(reported, key=lambda s: common_pixels(s, r), default=None)
        if best is not None and common_pixels(best, r) > MIN_OVERLAP * min(r.area, best.area):
            self._alias[r.id] = best.id


def _blobs_covering(r: Region, seen: Mapping[int, Region]) -> list[int]:
    """Keys of the blobs that show all of a region, the one with the largest part first; empty if none do.

    Either one blob, or people side by side whom the layers have segmented as one, since they walk together.
    """
    common = {key: common_pixels(s, r) for key, s in seen.items()}
    order = sorted(common, key=lambda key: -common[key])
    least = MIN_SIZE * common[order[0]] if order else 0.0
    large = [key for key in order if common[key] > max(MIN_OVERLAP * seen[key].area, least)]
    boxes = combinations((seen[key].bbox for key in large), 2)
    people = all(are_side_by_side(a, b, SLENDER) for a, b in boxes)
    both = large if people and len(large) > 1 else []
    for parts in (order[:1], both):
        shared = sum(common[key] for key in parts)
        if shared > WHOLE_IOU * (sum(seen[key].area for key in parts) + r.area - shared):
            return parts
    return []


def _visible_regions(blobs: BlobTracks, frame: FusionFrame) -> dict[int, Region]:
    """The visible part of each blob as a region, by key."""
    width, height = frame.size
    rows, columns = frame.foreground.labels.shape
    scale, seconds = (width / columns, height / rows), frame.foreground.seconds
    return {
        s.key: blob_region(s, scale, frame.size, seconds) for s in blobs if s.visible is not None
    }


def _is_mostly_in(own: Region, other: Region) -> bool:
    return common_pixels(own, other) > MIN_OVERLAP * own.area


def common_pixels(a: Region, b: Region) -> int:
    """Pixels that two regions have in common."""
    (ax, ay, aw, ah), (bx, by, bw, bh) = a.bbox, b.bbox
    x0, y0, x1, y1 = max(ax, bx), max(ay, by), min(ax + aw, bx + bw), min(ay + ah, by + bh)
    if x1 <= x0 or y1 <= y0:
        return 0
    in_a = a.mask[y0 - ay : y1 - ay, x0 - ax : x1 - ax]
    return int(np.count_nonzero(in_a & b.mask[y0 - by : y1 - by, x0 - bx : x1 - bx]))


def are_near(a: Region, b: Region) -> bool:
    """Whether two regions are within `NEAR_PX` pixels of each other."""
    x, y, w, h = a.bbox
    wide = np.pad(a.mask.view(np.uint8), NEAR_PX)
    near = cv2.dilate(wide, np.ones((2 * NEAR_PX + 1, 2 * NEAR_PX + 1), np.uint8)) > 0
    box = (x - NEAR_PX, y - NEAR_PX, w + 2 * NEAR_PX, h + 2 * NEAR_PX)
    grown = replace(a, bbox=box, mask=near)
    return common_pixels(grown, b) > 0


def blob_region(
    s: BlobTrack, scale: tuple[float, float], size: tuple[int, int], seconds: float
) -> Region:
    """The visible part of an object as a region.

    Args:
        s: A visible object.
        scale: Frame pixels per pixel of the foreground, (x, y).
        size: (width, height) of the frame.
        seconds: Between frames.

    Returns:
        The region, in frame pixels.
    """
    assert s.visible is not None
    (x0, y0, x1, y1), mask = s.visible
    left, top = round(x0 * scale[0]), round(y0 * scale[1])
    right, bottom = min(round(x1 * scale[0]), size[0]), min(round(y1 * scale[1]), size[1])
    large = cv2.resize(
        mask.astype(np.uint8), (right - left, bottom - top), interpolation=cv2.INTER_NEAREST
    )
    shape = describe_mask(large.astype(bool), (left, top), size)
    velocity = (s.velocity[0] * scale[0], s.velocity[1] * scale[1])
    # A box is accurate to about a pixel, and velocity is averaged over a few steps.
    sigma = 0.5 * scale[0] / seconds
    return shape.region(s.id, velocity, sigma, float(1 - np.exp(-s.frames / 5.0)))
