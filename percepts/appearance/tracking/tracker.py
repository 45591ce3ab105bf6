"""The tracker that follows all taught objects of one video together."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.blob import Blob, without
from visup.percepts.appearance.looks.bodies import MovingBody
from visup.percepts.appearance.looks.pose import Doubles
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import ViewModel
from visup.percepts.appearance.scenery.background_memory import BackgroundMemory
from visup.percepts.appearance.scenery.camera import CameraTrack, followed_camera
from visup.percepts.appearance.scenery.change import ChangeMap
from visup.percepts.appearance.scenery.points import (
    NO_POINTS,
    STILL,
    PointMotion,
    follow_points,
)
from visup.percepts.appearance.tracking.finding import (
    SURE,
    ThingPlace,
    assigned,
    body_places,
    coloured_places,
    footprint,
    has_distinctive_colours,
    searched,
)
from visup.percepts.appearance.tracking.following import (
    AS_IT_WAS,
    FrameMotion,
    followed,
    noted,
)
from visup.percepts.appearance.tracking.learning import learned, relearned, rested
from visup.percepts.appearance.tracking.look_alikes import look_alikes, settled
from visup.percepts.appearance.tracking.recalling import recalled
from visup.percepts.appearance.tracking.segmentation import (
    Claim,
    cleaned,
    compete,
    rest_scores,
    thing_scores,
    unchanged,
)
from visup.percepts.appearance.tracking.track import IN_VIEW, State, ThingTrack

Mask = NDArray[np.bool_]

POINTS = 24  # most points tracked on each object
HOLD_S = 0.12  # how long a lost object is still reported at its predicted position
LEAST_SEEN = 0.04  # visible share below which an object is hidden
EVERY = 3  # frames between two searches of the whole picture


class ThingTracker:
    """Tracks all taught objects; one per video.

    Args:
        views: Models of their views.

    Attributes:
        views: As given.
        tracks: One for each name, in the order of teaching.
        scene: The last frame.
    """

    def __init__(self, views: Sequence[ViewModel]) -> None:
        self.views = tuple(views)
        names = dict.fromkeys(v.name for v in views)
        self.tracks = tuple(ThingTrack(n, self._numbers(n)[0]) for n in names)
        self.scene: Scene | None = None
        self._change = ChangeMap()
        self._background = BackgroundMemory()
        self._count = 0
        self._static = True
        self._camera: Doubles | None = STILL
        self._scenery = CameraTrack()
        self._alike = look_alikes(self.views)
        self._distinctive = [has_distinctive_colours(v) for v in self.views]

    @property
    def camera(self) -> Doubles | None:
        """(2, 3) similarity of the picture since the previous frame, frame pixels; None if unknown.

        The common motion of points away from objects is taken for the camera's: where most of the picture
        moves by itself, such as water, the estimate is wrong.
        """
        if self._camera is None or self._camera is STILL or self.scene is None:
            return self._camera
        found = self._camera.copy()
        found[:, 2] /= self.scene.scale
        return found

    @property
    def seeks_new(self) -> bool:
        """Whether some object has not been detected yet: only those are compared with moving bodies."""
        return any(not t.id for t in self.tracks)

    def save(self) -> Mapping[str, Any]:
        """The state after the frames so far."""
        return {k: v for k, v in vars(self).items() if k not in ("views", "_alike", "_distinctive")}

    def load(self, state: Mapping[str, Any]) -> None:
        """Restore the state of a tracker of the same views."""
        vars(self).update(state)

    def step(
        self, scene: Scene, new_id: Callable[[Blob], int], bodies: Sequence[MovingBody] = ()
    ) -> tuple[ThingTrack, ...]:
        """Track the objects in the next frame.

        Args:
            scene: The frame.
            new_id: Returns the id of an object detected for the first time.
            bodies: Segmented moving bodies of the frame; not needed unless `seeks_new`.

        Returns:
            One track for each name, in the order of teaching.
        """
        old, self.scene = self.scene, scene
        self._count += 1
        same: dict[str, Mask] = {}
        if old is not None and old.size == scene.size:
            same = {t.name: unchanged(scene, t.rest) for t in self.tracks if t.rest is not None}
            self._follow(old, scene, same)
        else:
            self._camera, self._scenery = STILL, CameraTrack()
            self._background = BackgroundMemory()
            self.tracks = tuple(_forgotten(t) for t in self.tracks)
        self._change.update(scene, STILL if self._camera is None else self._camera)
        self._background.move(self._camera)
        self._find(scene, bodies)
        self._share_pixels(scene, same)
        self._background.update(scene, _seen_in(self.tracks, scene))
        self.tracks = tuple(_numbered(t, scene, new_id) for t in self.tracks)
        return self.tracks

    def _numbers(self, name: str) -> list[int]:
        return [k for k, v in enumerate(self.views) if v.name == name]

    def _follow(self, old: Scene, scene: Scene, same: Mapping[str, Mask]) -> None:
        calm = {n for n, mask in same.items() if np.mean(mask) > AS_IT_WAS}
        resting = [t for t in self.tracks if t.state is State.RESTING and t.name in calm]
        seen = [t for t in self.tracks if t.state in IN_VIEW]
        if self._static and seen and len(resting) == len(seen):
            # The camera rests, too: nothing has moved by a pixel.
            moved = PointMotion(NO_POINTS, NO_POINTS, np.zeros(0, dtype=np.int64))
            camera: Doubles | None = STILL
        else:
            taken = _taken(self.tracks, old)
            self._scenery, camera = followed_camera(self._scenery, old, scene, taken)
            moved = self._followed_points(old, scene, calm if self._static else set())
        self._static = camera is STILL
        self._camera = camera
        motion = FrameMotion(scene, STILL if camera is None else camera, moved, self._count, same)
        tracks = [followed(t, k, motion) for k, t in enumerate(self.tracks)]
        for k, t in enumerate(tracks):
            if t.state in IN_VIEW and t.seen == scene.time:
                others = [o.visible for o in tracks if o is not t and o.visible is not None]
                tracks[k] = recalled(t, self.views, scene, others)
        self.tracks = tuple(tracks)

    def _followed_points(self, old: Scene, scene: Scene, calm: Collection[str]) -> PointMotion:
        """Tracked points of objects that may move."""
        points = [(-1, NO_POINTS)]
        for k, t in enumerate(self.tracks):
            rests = t.state is State.RESTING and t.name in calm
            if t.visible is not None and not rests:
                points.append((k, _points_on(old, t.visible)))
        owner = np.concatenate([np.full(len(p), k) for k, p in points]).astype(np.int64)
        return follow_points(old, scene, np.concatenate([p for _, p in points]), owner)

    def _find(self, scene: Scene, bodies: Sequence[MovingBody]) -> None:
        """Search for objects that are not in view: all of them at first, then one at a time.

        In every frame, moving bodies are compared with the objects that have not been detected yet. An object
        that was detected before is searched by its last appearance instead: a moving body with its colours
        may be another object that was in view all the time.
        """
        lost = sorted((t for t in self.tracks if t.state not in IN_VIEW), key=lambda t: t.asked)
        first = self._count == 1
        due = lost if first else lost[: self._count % EVERY == 0]
        found = self._searched(scene, due)
        new = {t.name for t in lost if not t.id}
        found += self._moving(scene, bodies, new - {f.name for f in found})
        found += self._coloured(scene, (new & {t.name for t in due}) - {f.name for f in found})
        taken = [
            (b, self.views[t.number].appearance)
            for t in self.tracks
            if t.state in IN_VIEW
            for b in _occupied(t, scene)
        ]
        placed = self._settled(assigned(scene, found, taken), scene)
        names = {t.name for t in due}
        asked = (replace(t, asked=scene.time) if t.name in names else t for t in self.tracks)
        before = [p.seen for p in placed.values() if p.seen is not None]
        rest = (_uncovered(t, before) for t in asked)
        self.tracks = tuple(_found(t, placed.get(t.name), scene) for t in rest)

    def _searched(self, scene: Scene, due: Sequence[ThingTrack]) -> list[ThingPlace]:
        """Candidate positions in the whole picture, or else where it has changed recently.

        Places that look as they did while the object was seen elsewhere are left out.
        """
        lately = self._change.lately(scene)
        found: list[ThingPlace] = []
        for t in due:
            views, changed = self._views_of({t.name}), self._background.changed(scene, t.name)
            found += searched(scene, t, views, changed, lately)
        return found

    def _moving(
        self, scene: Scene, bodies: Sequence[MovingBody], names: Collection[str]
    ) -> list[ThingPlace]:
        """Candidate positions of objects at moving bodies that are not tracked objects already."""
        known = {t.id for t in self.tracks}
        free = [b for b in bodies if b.id not in known]
        return [c for k, v in self._views_of(names) for c in body_places(scene, v, k, free)]

    def _coloured(self, scene: Scene, names: Collection[str]) -> list[ThingPlace]:
        """Candidate positions by colours alone, for objects with distinctive colours and no look-alikes."""
        views = self._views_of(names)
        sought = [(k, v) for k, v in views if self._distinctive[k] and not self._alike[k]]
        return [c for k, v in sought for c in coloured_places(scene, v, k)]

    def _views_of(self, names: Collection[str]) -> list[tuple[int, ViewModel]]:
        """The views of some objects, each with its number."""
        return [(k, v) for k, v in enumerate(self.views) if v.name in names]

    def _settled(self, placed: Mapping[str, ThingPlace], scene: Scene) -> dict[str, ThingPlace]:
        """Resolve positions of look-alikes that are not all searched at once."""
        sought = {t.name for t in self.tracks if t.state not in IN_VIEW} - set(placed)
        found: dict[str, ThingPlace] = {}
        for place in placed.values():
            own = settled(scene, place, self.views, self._alike, sought - set(found))
            found[own.name] = own
        return found

    def _share_pixels(self, scene: Scene, same: Mapping[str, Mask]) -> None:
        claims = [_claim(t, scene, same) for t in self.tracks]
        blobs = compete(claims, scene.size)
        shown = zip(self.tracks, claims, blobs, strict=True)
        self.tracks = tuple(self._shown(t, c, b, scene) for t, c, b in shown)

    def _shown(
        self, track: ThingTrack, claim: Claim | None, blob: Blob | None, scene: Scene
    ) -> ThingTrack:
        """A track with the pixels it won, and its appearance adapted to them."""
        pose, it, rest = track.pose, track.looks, track.rest
        if claim is None or blob is None or pose is None or it is None:
            return replace(track, visible=None)
        resting = track.state is State.RESTING
        if resting and rest is not None and np.array_equal(blob.mask, rest.blob.mask):
            return track if track.visible is rest.blob else replace(track, visible=rest.blob)
        blob = cleaned(blob)
        if blob is None or blob.area < LEAST_SEEN * it.area * pose.scale**2:
            return replace(track, visible=None)
        if resting:
            return replace(track, visible=blob)
        track = replace(track, visible=blob)
        if self._count % 2:
            track = learned(track, scene, claim, blob, self.views[track.number].appearance)
        return rested(track, scene, self._count == 1) if self._static else track


def _found(track: ThingTrack, place: ThingPlace | None, scene: Scene) -> ThingTrack:
    if place is None:
        return track
    looks, pose = place.looks, place.match.pose
    if place.seen is not None and track.id:
        looks = relearned(looks, pose, place.seen, scene)
    new = replace(
        track,
        number=place.number,
        state=State.MOVING,
        looks=looks,
        rest=None,
        path=(),
        proven=track.proven or place.match.score > SURE,
        peak=place.match.peak,
        explained=place.match.explained,
    )
    return noted(new, scene.time, pose)


def _uncovered(track: ThingTrack, before: Sequence[Blob]) -> ThingTrack:
    """A track without the pixels of newly found objects in its rest memory, since those occlude it.

    Args:
        track: The track of any object.
        before: Pixels of the newly found objects.
    """
    if track.rest is None:
        return track
    blob = track.rest.blob
    for other in before:
        blob = without(blob, other)
    return track if blob is track.rest.blob else replace(track, rest=replace(track.rest, blob=blob))


def _forgotten(track: ThingTrack) -> ThingTrack:
    """A track in a picture of another size: its position is unknown."""
    return replace(track, state=State.ABSENT, visible=None, rest=None, path=())


def _numbered(track: ThingTrack, scene: Scene, new_id: Callable[[Blob], int]) -> ThingTrack:
    if track.id or track.visible is None:
        return track
    return replace(track, id=new_id(track.visible), since=scene.time)


def _claim(track: ThingTrack, scene: Scene, same: Mapping[str, Mask]) -> Claim | None:
    """The claim of an object in view on the picture."""
    if track.state not in IN_VIEW or scene.time - track.seen > HOLD_S:
        return None
    if track.state is State.RESTING and track.rest is not None:
        return rest_scores(track.rest, same[track.name])
    assert track.pose is not None
    assert track.looks is not None
    return thing_scores(scene, track.pose, track.looks)


def _seen_in(tracks: Sequence[ThingTrack], scene: Scene) -> dict[str, Blob]:
    """The visible pixels of the objects that are seen in a frame, by name."""
    seen = (t for t in tracks if t.state in IN_VIEW and t.seen == scene.time)
    return {t.name: t.visible for t in seen if t.visible is not None}


def _taken(tracks: Sequence[ThingTrack], scene: Scene) -> Mask:
    """(h, w) bool: visible objects."""
    out = np.zeros(scene.size[::-1], dtype=bool)
    for t in tracks:
        if t.visible is not None:
            left, top, right, bottom = t.visible.window
            out[top:bottom, left:right] |= t.visible.mask
    return out


def _occupied(track: ThingTrack, scene: Scene) -> Iterator[Blob]:
    """Blobs of an object in view; one just redetected has no pixels of its own yet."""
    if track.visible is not None:
        yield track.visible
    elif track.seen == scene.time and track.pose is not None and track.looks is not None:
        covered = footprint(scene, track.pose, track.looks)
        if covered is not None:
            yield covered


def _points_on(scene: Scene, blob: Blob) -> NDArray[np.float32]:
    """(N, 2) float32: trackable points of an object."""
    left, top, right, bottom = blob.window
    inner = cv2.erode(blob.mask.view(np.uint8), np.ones((3, 3), np.uint8))
    grey = np.ascontiguousarray(scene.grey[top:bottom, left:right])
    found = cv2.goodFeaturesToTrack(grey, POINTS, 0.02, 3, mask=inner)
    if found is None:
        return np.zeros((0, 2), dtype=np.float32)
    return np.asarray(found.reshape(-1, 2) + np.array([left, top]), dtype=np.float32)
