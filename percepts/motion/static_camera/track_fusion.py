"""What is told where the camera rests: silhouettes and regions of the layers, each object once.

An object that both have found is told as its silhouette, under the id under which it was told first.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from visup.agent import Region
from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.outlines.region_outline import describe_mask
from visup.percepts.motion.static_camera.blob_filters import is_salient_blob
from visup.percepts.motion.static_camera.blob_track import BlobTrack, BlobTracks, Foreground

KNOWN = 0.4  # share of a region that differs from the picture when the picture knows it
COMMON = 0.5  # share of the smaller that two outlines of one object have in common
WHOLE = 0.6  # intersection over union at which an object is seen whole in the picture
MAIN = 0.4  # share of a region that a silhouette must fill to take its id: limbs do not
MISSED = (
    0.15  # share of what tells of a region's motion that lies where the picture shows no change
)
LARGE = (
    4.0  # how much larger a region must be than one known well, for the picture to miss parts of it
)
RECENT = 0.9  # weight of what was known of that before
BESIDE = 5  # pixels: points lie on edges, half of them outside of the silhouette
LEAST_TOLD = 0.0005  # share of the image that an object must fill when it is first told


@dataclass(frozen=True, slots=True, eq=False)
class MotionEvidence:
    """Points that are seen to move by themselves.

    Attributes:
        xy: (N, 2) float32, frame pixels.
        sure: (N,) float32, log likelihood that they move as their region does, less that of rest.
    """

    xy: Floats
    sure: Floats


class TrackFusion:
    """Under which ids objects are told; one per video."""

    def __init__(self) -> None:
        self._last: dict[int, float] = {}  # when a region of the layers was last seen
        self._shown: set[int] = set()  # their ids that were told without silhouettes
        self._alias: dict[int, int] = {}  # under which other id a region is told
        self._old: set[int] = set()  # those told before the picture, and well known
        self._missed_evidence: dict[
            int, tuple[float, float]
        ] = {}  # what tells of a region: missed, all

    def knows(self, number: int) -> bool:
        """Whether a region of the layers was seen of late."""
        return number in self._last

    def note(self, regions: Sequence[Region], now: float, memory_s: float) -> None:
        """Remember which regions of the layers live, and forget those that never come back.

        Args:
            regions: Those of a frame, each with its own id.
            now: Seconds.
            memory_s: How long the layers remember what is hidden, seconds.
        """
        self._last |= {r.id: now for r in regions}
        gone = {i for i, last in self._last.items() if now - last > memory_s}
        for i in gone:
            del self._last[i]
            self._alias.pop(i, None)
            self._missed_evidence.pop(i, None)
        self._old -= gone
        self._shown -= gone - set(self._alias.values())

    def passthrough(self, regions: Sequence[Region], many: float) -> tuple[Region, ...]:
        """Regions of the layers, told without silhouettes.

        Args:
            regions: Those of the layers, each with its own id.
            many: Area from which the layers know an outline well, frame pixels.

        Returns:
            The same by public id.
        """
        self._shown |= {r.id for r in regions}
        self._old |= {r.id for r in regions if r.area >= many}
        taken: set[int] = set()
        out = []
        for r in regions:
            number = self._alias.get(r.id, r.id)
            number = r.id if number in taken else number
            taken.add(number)
            out.append(replace(r, id=number))
        return tuple(sorted(out, key=lambda r: r.id))

    def fuse(
        self,
        size: tuple[int, int],
        view: Foreground,
        silhouettes: BlobTracks,
        regions: Sequence[Region],
        ids: int,
        evidence: MotionEvidence,
        many: float,
    ) -> tuple[tuple[Region, ...], BlobTracks, int]:
        """Give ids to silhouettes that are salient, and settle with the regions of the layers.

        Args:
            size: (width, height) of the frame.
            view: What it shows.
            silhouettes: Those that are followed.
            regions: Those of the layers, each with its own id.
            ids: The last public id given.
            evidence: Which points are seen to move by themselves.
            many: Area from which the layers know an outline well, frame pixels.

        Returns:
            Regions by public id; the silhouettes with theirs; the last public id given.
        """
        scale = size[0] / view.labels.shape[1], size[1] / view.labels.shape[0]
        seen = {
            s.key: blob_region(s, scale, size, view.seconds)
            for s in silhouettes
            if s.visible is not None
        }
        numbered = {s.id: seen[s.key] for s in silhouettes if s.id and s.key in seen}
        # Small ones are seen better before the picture: people who go together, with their shadows.
        large_ones = [r for r in regions if r.area >= LARGE * many]
        missed = self._missed(large_ones, tuple(numbered.values()), size, evidence)
        older, heirs = self._older(regions, seen, missed)
        whole_view = size[0] * size[1]
        out: list[Region] = []
        known: list[BlobTrack] = []
        taken = {s.id for s in silhouettes} | {self._alias.get(r.id, r.id) for r in older}
        for s in silhouettes:
            if s.key in heirs and heirs[s.key] not in taken:
                s = replace(s, id=heirs[s.key])
                taken.add(s.id)
            own = seen.get(s.key)
            free = own is not None and not any(
                common_pixels(own, r) > COMMON * own.area for r in older
            )
            large = own is not None and own.area >= LEAST_TOLD * whole_view
            new = own is not None and large and free and not s.id
            if (
                own is not None
                and new
                and is_salient_blob(s)
                and not self._is_part(own, large_ones, numbered)
            ):
                ids, number = self._number(own, regions, ids, taken)
                s = replace(s, id=number)
                taken.add(number)
            known.append(s)
            if own is not None and free and s.id:
                out.append(replace(own, id=s.id))
        change = cv2.resize((view.labels > 0).view(np.uint8), size, interpolation=cv2.INTER_NEAREST)
        for r in regions:
            x, y, w, h = r.bbox
            if r not in older and change[y : y + h, x : x + w][r.mask].mean() >= KNOWN:
                self._same(r, out)
                # What is small and was told stays told until a silhouette of it is.
                small = r.id in self._shown and r.area < many
                if not small or any(common_pixels(s, r) for s in out):
                    continue
            out = [s for s in out if common_pixels(s, r) < COMMON * s.area]
            number = self._alias.get(r.id, r.id)
            shown = {s.id for s in out}
            out.append(replace(r, id=r.id if number in shown else number))
        return tuple(sorted(out, key=lambda r: r.id)), tuple(known), ids

    def _missed(
        self,
        regions: Sequence[Region],
        seen: Sequence[Region],
        size: tuple[int, int],
        evidence: MotionEvidence,
    ) -> set[int]:
        """Regions of which the picture misses parts: what is of one tone with the rest, or slow.

        Points there move with the region, and not as the rest does.
        """
        shown = np.zeros(size[::-1], dtype=np.uint8)
        for s in seen:
            x, y, w, h = s.bbox
            shown[y : y + h, x : x + w] |= s.mask
        beside = cv2.dilate(shown, np.ones((BESIDE, BESIDE), np.uint8)) > 0
        column, row = np.clip(evidence.xy.astype(np.int64), 0, np.array(size) - 1).T
        out = set()
        for r in regions:
            x, y, w, h = r.bbox
            box = (column >= x) & (column < x + w) & (row >= y) & (row < y + h)
            mine = np.flatnonzero(box)
            mine = mine[r.mask[row[mine] - y, column[mine] - x]]
            sure = np.maximum(evidence.sure[mine], 0)
            lost = float(sure[~beside[row[mine], column[mine]]].sum())
            before = self._missed_evidence.get(r.id, (0.0, 0.0))
            now = RECENT * before[0] + lost, RECENT * before[1] + float(sure.sum())
            self._missed_evidence[r.id] = now
            if now[0] > MISSED * max(now[1], 1.0):
                out.add(r.id)
        return out

    def _older(
        self, regions: Sequence[Region], seen: Mapping[int, Region], missed: set[int]
    ) -> tuple[list[Region], dict[int, int]]:
        """Regions of which it misses parts, or told before it was and not yet seen whole in it.

        Also the ids that pass to silhouettes, by key, which now show such a region whole.
        """
        out, heirs = [], {}
        for r in regions:
            if r.id in missed:
                out.append(r)
                continue
            if r.id not in self._old:
                continue
            both = {key: common_pixels(s, r) for key, s in seen.items()}
            whole = {key: b / (seen[key].area + r.area - b) for key, b in both.items()}
            best = max(whole, key=lambda key: whole[key], default=None)
            if best is None or whole[best] <= WHOLE:
                out.append(r)
                continue
            self._old.discard(r.id)
            heirs[best] = self._alias.get(r.id, r.id)
        return out, heirs

    def _is_part(
        self, own: Region, regions: Sequence[Region], numbered: Mapping[int, Region]
    ) -> bool:
        """Whether a silhouette that was never told touches another one of the same region."""
        for r in regions:
            host = numbered.get(self._alias.get(r.id, r.id))
            if (
                host is not None
                and common_pixels(own, r) > COMMON * own.area
                and are_near(own, host)
            ):
                return True
        return False

    def _number(
        self, own: Region, regions: Sequence[Region], ids: int, taken: set[int]
    ) -> tuple[int, int]:
        """The last id given, and that of a new silhouette: the one under which it was told before."""
        for r in regions:
            number = self._alias.get(r.id, r.id)
            much = MAIN * r.area
            if number in self._shown and number not in taken and common_pixels(own, r) > much:
                return ids, number
        return ids + 1, ids + 1

    def _same(self, r: Region, told: Sequence[Region]) -> None:
        """Note under which id a region of the layers is told."""
        best = max(told, key=lambda s: common_pixels(s, r), default=None)
        if best is not None and common_pixels(best, r) > COMMON * min(r.area, best.area):
            self._alias[r.id] = best.id


def common_pixels(a: Region, b: Region) -> int:
    """Pixels that two regions have in common."""
    (ax, ay, aw, ah), (bx, by, bw, bh) = a.bbox, b.bbox
    x0, y0, x1, y1 = max(ax, bx), max(ay, by), min(ax + aw, bx + bw), min(ay + ah, by + bh)
    if x1 <= x0 or y1 <= y0:
        return 0
    in_a = a.mask[y0 - ay : y1 - ay, x0 - ax : x1 - ax]
    return int(np.count_nonzero(in_a & b.mask[y0 - by : y1 - by, x0 - bx : x1 - bx]))


def are_near(a: Region, b: Region) -> bool:
    """Whether two regions come nearer than some pixels to each other."""
    x, y, w, h = a.bbox
    wide = np.pad(a.mask.view(np.uint8), BESIDE)
    near = cv2.dilate(wide, np.ones((2 * BESIDE + 1, 2 * BESIDE + 1), np.uint8)) > 0
    grown = replace(a, bbox=(x - BESIDE, y - BESIDE, w + 2 * BESIDE, h + 2 * BESIDE), mask=near)
    return common_pixels(grown, b) > 0


def blob_region(
    s: BlobTrack, scale: tuple[float, float], size: tuple[int, int], seconds: float
) -> Region:
    """What is visible of an object as a region.

    Args:
        s: An object that is visible.
        scale: Frame pixels per pixel of the picture, (x, y).
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
    # A box is known to about a pixel, and its last few steps are averaged.
    sigma = 0.5 * scale[0] / seconds
    return shape.region(s.id, velocity, sigma, float(1 - np.exp(-s.frames / 5.0)))
