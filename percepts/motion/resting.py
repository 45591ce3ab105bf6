"""A camera that rests: what moves is seen pixel by pixel, before the picture of what rests.

Layers of motion need no still camera and know slow things from the first frame on; but small and
thin things have too few constraints for them. Where the camera is seen to rest, silhouettes before
the picture of the rest are reported instead, and of the layers' regions those that the picture does
not know: what was there, and slow, when the picture was made.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import cv2
import numpy as np

from visup.agent import Frame, Region
from visup.percepts.motion.contour import describe
from visup.percepts.motion.image import Floats
from visup.percepts.motion.layers import GRID, STILL, Affine, distances
from visup.percepts.motion.picture import (
    Picture,
    changed,
    edges,
    exposed,
    first_picture,
    learnt,
)
from visup.percepts.motion.scene import Scene
from visup.percepts.motion.settings import MotionSettings
from visup.percepts.motion.silhouette import Mask, Silhouette, Silhouettes, View, view_of
from visup.percepts.motion.silhouettes import follow, is_ghost, is_salient, joined

TELLS = 16.0  # information, 1 / pixels squared, of a point that would show a motion
FITS = 9.0  # squared distance within which a point rests
SPREAD = 0.5  # share of the view in which points must be seen to rest
RESTS = 0.85  # share of those parts that rest when the camera does
MOVES = 0.6  # the same below which the camera moves
REST_S = 1.0  # how long the camera must rest before the picture is believed, seconds
LONGEST_S = 4.0  # most seconds of rest that make up for times when too little is seen
FLOODED = 0.6  # share of the image that no change of what is seen in it explains
KNOWN = 0.4  # share of a region that differs from the picture when the picture knows it
COMMON = 0.5  # share of the smaller that two outlines of one object have in common
WHOLE = 0.6  # intersection over union at which an object is seen whole in the picture
MANY_CELLS = 15  # superpixels of a region whose outline the layers know well
MAIN = 0.4  # share of a region that a silhouette must fill to take its id: limbs do not
LEAST_TOLD = 0.0005  # share of the image that an object must fill when it is first told
YOUNG_S = 0.3  # how long what was never told is missed, seconds
SIZE = 768  # longer side of the picture, pixels


def camera_rests(scene: Scene) -> bool | None:
    """Whether the camera is seen to rest: all over the view, away from objects, nothing moves.

    Args:
        scene: A frame as measured.

    Returns:
        None when too little structure is seen to tell, or the view is divided.
    """
    shares = [_still_share(scene, i) for i in range(len(scene.measured))]
    if any(s is not None and s < MOVES for s in shares):
        return False
    return True if shares and all(s is not None and s >= RESTS for s in shares) else None


def _still_share(scene: Scene, number: int) -> float | None:
    c = scene.measured[number].constraints
    use = c.information[:, 0] + c.information[:, 2] > TELLS
    use &= scene.owner[scene.cell_of(c.xy)] == 0
    rows, cols = GRID
    row = np.clip(c.xy[:, 1] * rows / scene.image.shape[0], 0, rows - 1).astype(np.int64)
    col = np.clip(c.xy[:, 0] * cols / scene.image.shape[1], 0, cols - 1).astype(np.int64)
    place = (row * cols + col)[use]
    fits = distances(Affine(STILL), c, 0.15)[use] < FITS
    all_ = np.bincount(place, minlength=rows * cols)
    rest = np.bincount(place[fits], minlength=rows * cols)
    filled = all_ >= 2
    if filled.sum() < SPREAD * rows * cols:
        return None
    return float(np.mean(rest[filled] > 0.5 * all_[filled]))


class RestingView:
    """Silhouettes before the picture of what rests; one per video.

    Attributes:
        active: Whether the camera rests, and has done so for long enough.
    """

    def __init__(self) -> None:
        self._forget()
        self._shown: set[int] = set()
        self._alias: dict[int, int] = {}
        self._old: set[int] = set()

    def _forget(self) -> None:
        self._picture: Picture | None = None
        self._known: Silhouettes = ()
        self._time = self._since = self._rested_s = 0.0
        self._born = 0
        self.active = False

    def step(
        self,
        frame: Frame,
        scene: Scene,
        regions: Sequence[Region],
        ids: int,
        settings: MotionSettings,
    ) -> tuple[tuple[Region, ...], int]:
        """What is to be reported of a frame.

        Args:
            frame: The frame.
            scene: As measured.
            regions: Those of the layers of motion.
            ids: The last public id given.
            settings: Gives how long objects are remembered.

        Returns:
            Regions by id: those of the layers unless the camera rests; the last public id given.
        """
        many = MANY_CELLS * (settings.cell / scene.image.scale) ** 2
        if not self._is_at_rest(camera_rests(scene), scene.seconds):
            return self._only(regions, many), ids
        image = _prepared(frame)
        if self._picture is None:
            self._picture = first_picture(image)
            self._time = self._since = frame.time
            return self._only(regions, many), ids
        view = self._seen(image, frame.time, settings)
        if view is None:
            return self._only(regions, many), ids
        self.active = min(frame.time - self._since, self._rested_s) >= REST_S
        if not self.active:
            return self._only(regions, many), ids
        return self._reported(frame, view, regions, ids)

    def _is_at_rest(self, rests: bool | None, seconds: float) -> bool:
        """Whether the camera rests, as far as is known; else all is forgotten."""
        step = seconds if rests else -seconds
        self._rested_s = min(max(self._rested_s + step, 0.0), LONGEST_S)
        if rests is False or self._rested_s <= 0:
            self._forget()
        return self._rested_s > 0

    def _only(self, regions: Sequence[Region], many: float) -> tuple[Region, ...]:
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

    def _seen(self, image: Floats, now: float, settings: MotionSettings) -> View | None:
        """Follow the silhouettes into a frame, and learn from it; None when it shows another view."""
        assert self._picture is not None
        seconds = max(now - self._time, 1e-3)
        self._time = now
        picture = exposed(self._picture, image)
        change = changed(picture, image)
        if change.mean() > FLOODED:
            self._forget()
            return None
        view = view_of(image, change, settings.least_blob * change.size, now, seconds)
        known, self._born = follow(self._known, view, self._born)
        known = joined(known)
        now_edges, rest_edges = edges(image), edges(picture.mean)
        ghosts = [s for s in known if is_ghost(s, now_edges, rest_edges)]
        known = tuple(s for s in known if s not in ghosts)
        told = painted([s for s in known if s.id], change.shape)
        held = (cv2.dilate(told.view(np.uint8), np.ones((5, 5), np.uint8)) > 0) & change
        self._picture = learnt(picture, image, held, seconds, painted(ghosts, change.shape))
        self._known = tuple(
            s
            for s in known
            if now - s.seen <= (settings.missed_s if s.id else max(YOUNG_S, 2.5 * seconds))
        )
        return view

    def _reported(
        self, frame: Frame, view: View, regions: Sequence[Region], ids: int
    ) -> tuple[tuple[Region, ...], int]:
        """Give ids to silhouettes that are salient, and settle with the regions of the layers."""
        scale = frame.size[0] / view.labels.shape[1], frame.size[1] / view.labels.shape[0]
        seen = {
            s.key: region_of(s, scale, frame.size, view.seconds)
            for s in self._known
            if s.now is not None
        }
        older, heirs = self._older(regions, seen)
        whole_view = frame.size[0] * frame.size[1]
        out: list[Region] = []
        known: list[Silhouette] = []
        taken = {s.id for s in self._known} | {self._alias.get(r.id, r.id) for r in older}
        for s in self._known:
            if s.key in heirs and heirs[s.key] not in taken:
                s = replace(s, id=heirs[s.key])
                taken.add(s.id)
            own = seen.get(s.key)
            free = own is not None and not any(common(own, r) > COMMON * own.area for r in older)
            large = own is not None and own.area >= LEAST_TOLD * whole_view
            if own is not None and large and free and not s.id and is_salient(s):
                ids, number = self._number(own, regions, ids, taken)
                s = replace(s, id=number)
                taken.add(number)
            known.append(s)
            if own is not None and free and s.id:
                out.append(replace(own, id=s.id))
        self._known = tuple(known)
        change = cv2.resize(
            (view.labels > 0).view(np.uint8), frame.size, interpolation=cv2.INTER_NEAREST
        )
        for r in regions:
            x, y, w, h = r.bbox
            if r not in older and change[y : y + h, x : x + w][r.mask].mean() >= KNOWN:
                self._same(r, out)
                continue
            out = [s for s in out if common(s, r) < COMMON * s.area]
            number = self._alias.get(r.id, r.id)
            shown = {s.id for s in out}
            out.append(replace(r, id=r.id if number in shown else number))
        return tuple(sorted(out, key=lambda r: r.id)), ids

    def _older(
        self, regions: Sequence[Region], seen: Mapping[int, Region]
    ) -> tuple[list[Region], dict[int, int]]:
        """Regions told before the picture was believed, and not seen whole in it yet.

        Also the ids that pass to silhouettes, by key, which now show such a region whole.
        """
        out, heirs = [], {}
        for r in regions:
            if r.id not in self._old:
                continue
            both = {key: common(s, r) for key, s in seen.items()}
            whole = {key: b / (seen[key].area + r.area - b) for key, b in both.items()}
            best = max(whole, key=lambda key: whole[key], default=None)
            if best is None or whole[best] <= WHOLE:
                out.append(r)
                continue
            self._old.discard(r.id)
            heirs[best] = self._alias.get(r.id, r.id)
        return out, heirs

    def _number(
        self, own: Region, regions: Sequence[Region], ids: int, taken: set[int]
    ) -> tuple[int, int]:
        """The last id given, and that of a new silhouette: the one under which it was told before."""
        for r in regions:
            number = self._alias.get(r.id, r.id)
            much = MAIN * r.area
            if number in self._shown and number not in taken and common(own, r) > much:
                return ids, number
        return ids + 1, ids + 1

    def _same(self, r: Region, told: Sequence[Region]) -> None:
        """Note under which id a region of the layers is told."""
        best = max(told, key=lambda s: common(s, r), default=None)
        if best is not None and common(best, r) > COMMON * min(r.area, best.area):
            self._alias[r.id] = best.id


def _prepared(frame: Frame) -> Floats:
    image = frame.image
    if image.ndim == 2 or image.shape[2] == 1:
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    scale = SIZE / max(frame.size)
    if scale < 1:
        size = (max(8, round(frame.size[0] * scale)), max(8, round(frame.size[1] * scale)))
        image = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return np.asarray(cv2.GaussianBlur(image, (3, 3), 0.7), dtype=np.float32)


def painted(known: Sequence[Silhouette], shape: tuple[int, int]) -> Mask:
    """(h, w) bool: what is visible of some objects."""
    out = np.zeros(shape, dtype=bool)
    for s in known:
        if s.now is not None:
            (x0, y0, x1, y1), mask = s.now
            out[y0:y1, x0:x1] |= mask
    return out


def common(a: Region, b: Region) -> int:
    """Pixels that two regions have in common."""
    (ax, ay, aw, ah), (bx, by, bw, bh) = a.bbox, b.bbox
    x0, y0, x1, y1 = max(ax, bx), max(ay, by), min(ax + aw, bx + bw), min(ay + ah, by + bh)
    if x1 <= x0 or y1 <= y0:
        return 0
    in_a = a.mask[y0 - ay : y1 - ay, x0 - ax : x1 - ax]
    return int(np.count_nonzero(in_a & b.mask[y0 - by : y1 - by, x0 - bx : x1 - bx]))


def region_of(
    s: Silhouette, scale: tuple[float, float], size: tuple[int, int], seconds: float
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
    assert s.now is not None
    (x0, y0, x1, y1), mask = s.now
    left, top = round(x0 * scale[0]), round(y0 * scale[1])
    right, bottom = min(round(x1 * scale[0]), size[0]), min(round(y1 * scale[1]), size[1])
    large = cv2.resize(
        mask.astype(np.uint8), (right - left, bottom - top), interpolation=cv2.INTER_NEAREST
    )
    shape = describe(large.astype(bool), (left, top), size)
    velocity = (s.velocity[0] * scale[0], s.velocity[1] * scale[1])
    # A box is known to about a pixel, and its last few steps are averaged.
    sigma = 0.5 * scale[0] / seconds
    return shape.region(s.id, velocity, sigma, float(1 - np.exp(-s.frames / 5.0)))
