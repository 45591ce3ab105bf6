"""The tracker that follows all taught objects of one video together."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.background_memory import BackgroundMemory
from visup.percepts.appearance.background.camera_motion import CameraTrack, track_camera
from visup.percepts.appearance.background.change_map import ChangeMap
from visup.percepts.appearance.background.point_tracking import (
    NO_POINTS,
    STILL,
    PointMotion,
    track_points,
)
from visup.percepts.appearance.models.appearance_model import ViewModel
from visup.percepts.appearance.models.blob import Blob, without
from visup.percepts.appearance.models.moving_body import MovingBody
from visup.percepts.appearance.models.pose import Doubles
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.adaptation import (
    adapt_appearance,
    put_at_rest,
    relearn_appearance,
)
from visup.percepts.appearance.tracking.drift_correction import correct_drift
from visup.percepts.appearance.tracking.instances import further_instances
from visup.percepts.appearance.tracking.look_alikes import look_alikes, resolve_look_alike
from visup.percepts.appearance.tracking.redetection import (
    SURE,
    RedetectionCandidate,
    assign_candidates,
    candidates,
    candidates_at_bodies,
    candidates_by_colour,
    is_unique_by_colour,
)
from visup.percepts.appearance.tracking.segmentation import (
    Claim,
    appearance_log_odds,
    assign_pixels,
    rest_log_odds,
    unchanged,
    without_specks,
)
from visup.percepts.appearance.tracking.short_term_tracking import (
    FrameMotion,
    displacements,
    is_calm,
    track_object,
    with_observation,
)
from visup.percepts.appearance.tracking.track import IN_VIEW, TaughtObjectTrack, TrackState
from visup.percepts.appearance.tracking.track_pixels import (
    object_mask,
    occupied_blobs,
    points_on,
    visible_pixels,
)

Mask = NDArray[np.bool_]

HOLD_S = 0.12  # how long a lost object is still reported at its predicted position
MIN_VISIBLE_SHARE = 0.04  # visible share below which an object is hidden
SEARCH_INTERVAL = 3  # frames between two searches of the whole image


class TaughtObjectTracker:
    """Tracks all taught objects; one per video.

    Args:
        views: Models of their views.

    Attributes:
        views: As given.
        tracks: One for each name, in the order of teaching, then those of further instances.
        scene: The last frame.
    """

    def __init__(self, views: Sequence[ViewModel]) -> None:
        self.views = tuple(views)
        names = dict.fromkeys(v.name for v in views)
        self.tracks = tuple(TaughtObjectTrack(n, self._view_numbers(n)[0]) for n in names)
        self.scene: Scene | None = None
        self._change = ChangeMap()
        self._background = BackgroundMemory()
        self._count = 0
        self._static = True
        self._camera: Doubles | None = STILL
        self._camera_track = CameraTrack()
        self._alike = look_alikes(self.views)
        self._distinctive = [is_unique_by_colour(v) for v in self.views]

    @property
    def camera(self) -> Doubles | None:
        """(2, 3) similarity of the image since the previous frame, frame pixels; None if unknown.

        The common motion of points away from objects is taken for the camera's: where most of the image
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
    ) -> tuple[TaughtObjectTrack, ...]:
        """Track the objects in the next frame.

        Args:
            scene: The frame.
            new_id: Returns the id of an object detected for the first time.
            bodies: Segmented moving bodies of the frame; not needed unless `seeks_new`.

        Returns:
            The tracks; see there.
        """
        old, self.scene = self.scene, scene
        self._count += 1
        same: dict[str, Mask] = {}
        if old is not None and old.size == scene.size:
            same = {t.key: unchanged(scene, t.rest) for t in self.tracks if t.rest is not None}
            self._track_objects(old, scene, same)
        else:
            self._camera, self._camera_track = STILL, CameraTrack()
            self._background = BackgroundMemory()
            self.tracks = tuple(_with_unknown_position(t) for t in self.tracks)
        self._change.update(scene, STILL if self._camera is None else self._camera)
        self._background.move(self._camera)
        self._redetect(scene, bodies)
        self._segment(scene, same)
        self._background.update(scene, visible_pixels(self.tracks, scene))
        tracks = (_with_id(t, scene, new_id) for t in self.tracks)
        self.tracks = tuple(t for t in tracks if t.id or t.instance == 1)
        return self.tracks

    def _view_numbers(self, name: str) -> list[int]:
        return [k for k, v in enumerate(self.views) if v.name == name]

    def _track_objects(self, old: Scene, scene: Scene, same: Mapping[str, Mask]) -> None:
        shifts = displacements(self.tracks, scene)
        calm = {n for n, mask in same.items() if is_calm(mask, shifts.get(n))}
        resting = [t for t in self.tracks if t.state is TrackState.RESTING and t.key in calm]
        seen = [t for t in self.tracks if t.state in IN_VIEW]
        if self._static and seen and len(resting) == len(seen):
            # The camera rests, too: nothing has moved by a pixel.
            moved = PointMotion(NO_POINTS, NO_POINTS, np.zeros(0, dtype=np.int64))
            camera: Doubles | None = STILL
        else:
            taken = object_mask(self.tracks, old)
            self._camera_track, camera = track_camera(self._camera_track, old, scene, taken)
            moved = self._track_points(old, scene, calm if self._static else set())
        self._static = camera is STILL
        self._camera = camera
        motion = FrameMotion(
            scene, STILL if camera is None else camera, moved, self._count, same, shifts
        )
        tracks = [track_object(t, k, motion) for k, t in enumerate(self.tracks)]
        for k, t in enumerate(tracks):
            if t.state in IN_VIEW and t.last_seen == scene.time:
                others = [o.visible for o in tracks if o is not t and o.visible is not None]
                tracks[k] = correct_drift(t, self.views, scene, others)
        self.tracks = tuple(tracks)

    def _track_points(self, old: Scene, scene: Scene, calm: Collection[str]) -> PointMotion:
        """Tracked points of objects that may move."""
        points = [(-1, NO_POINTS)]
        for k, t in enumerate(self.tracks):
            rests = t.state is TrackState.RESTING and t.key in calm
            if t.visible is not None and not rests:
                points.append((k, points_on(old, t.visible)))
        owner = np.concatenate([np.full(len(p), k) for k, p in points]).astype(np.int64)
        return track_points(old, scene, np.concatenate([p for _, p in points]), owner)

    def _redetect(self, scene: Scene, bodies: Sequence[MovingBody]) -> None:
        """Search for objects that are not in view: all of them at first, then one at a time.

        In every frame, moving bodies are compared with the objects that have not been detected yet. An object
        that was detected before is searched by its last appearance instead: a moving body with its colours
        may be another object that was in view all the time.
        """
        lost = sorted(
            (t for t in self.tracks if t.state not in IN_VIEW), key=lambda t: t.compared_at
        )
        first = self._count == 1
        searched = lost if first else lost[: self._count % SEARCH_INTERVAL == 0]
        names = {t.key for t in searched}
        candidates = self._search_image(scene, searched)
        new = {t.key for t in lost if not t.id}
        taken = [
            (b, self.views[t.view_number].appearance)
            for t in self.tracks
            if t.state in IN_VIEW
            for b in occupied_blobs(t, scene)
        ]
        # What matches only where another object is has not been found.
        left = new - set(assign_candidates(scene, candidates, taken))
        at_bodies = self._search_at_bodies(scene, bodies, left)
        left -= {c.name for c in at_bodies}
        candidates += [*at_bodies, *self._search_by_colour(scene, left & names)]
        redetected = self._resolve_look_alikes(assign_candidates(scene, candidates, taken), scene)
        compared = [
            replace(t, compared_at=scene.time) if t.key in names else t for t in self.tracks
        ]
        blobs = [b for b, _ in taken]
        for track, place in self._further_instances(scene, new, redetected, blobs):
            compared.append(track)
            redetected[track.key] = place
        occluders = [p.visible for p in redetected.values() if p.visible is not None]
        rest = (_without_occluders(t, occluders) for t in compared)
        self.tracks = tuple(_redetected(t, redetected.get(t.key), scene) for t in rest)

    def _further_instances(
        self,
        scene: Scene,
        new: Collection[str],
        placed: Mapping[str, RedetectionCandidate],
        taken: Sequence[Blob],
    ) -> list[tuple[TaughtObjectTrack, RedetectionCandidate]]:
        """Further instances of the objects that are detected for the first time, with their positions."""
        first = {n: p for n, p in placed.items() if n in new}
        pixels = (p.pixels(scene) for p in placed.values())
        occupied = [*taken, *(b for b in pixels if b is not None)]
        numbers = {t.name: t.instance for t in self.tracks}  # the last of each name is the highest
        found = []
        for place in further_instances(scene, first, self._views_of(set(first)), occupied):
            numbers[place.name] += 1
            track = TaughtObjectTrack(place.name, place.view_number, instance=numbers[place.name])
            found.append((track, replace(place, name=track.key)))
        return found

    def _search_image(
        self, scene: Scene, tracks: Sequence[TaughtObjectTrack]
    ) -> list[RedetectionCandidate]:
        """Candidate positions in the whole image, or else where it has changed recently.

        Places that look as they did while the object was seen elsewhere are left out.
        """
        recently_changed = self._change.recently_changed(scene)
        found: list[RedetectionCandidate] = []
        for t in tracks:
            views, changed = self._views_of({t.name}), self._background.changed(scene, t.key)
            places = candidates(scene, t, views, changed, recently_changed)
            found += [replace(c, name=t.key) for c in places]
        return found

    def _search_at_bodies(
        self, scene: Scene, bodies: Sequence[MovingBody], names: Collection[str]
    ) -> list[RedetectionCandidate]:
        """Candidate positions of objects at moving bodies that are not tracked objects already."""
        known = {t.id for t in self.tracks}
        free = [b for b in bodies if b.id not in known]
        return [
            c for k, v in self._views_of(names) for c in candidates_at_bodies(scene, v, k, free)
        ]

    def _search_by_colour(self, scene: Scene, names: Collection[str]) -> list[RedetectionCandidate]:
        """Candidate positions by colours alone, for objects with distinctive colours and no look-alikes."""
        views = self._views_of(names)
        sought = [(k, v) for k, v in views if self._distinctive[k] and not self._alike[k]]
        return [c for k, v in sought for c in candidates_by_colour(scene, v, k)]

    def _views_of(self, names: Collection[str]) -> list[tuple[int, ViewModel]]:
        """The views of some objects, each with its number."""
        return [(k, v) for k, v in enumerate(self.views) if v.name in names]

    def _resolve_look_alikes(
        self, placed: Mapping[str, RedetectionCandidate], scene: Scene
    ) -> dict[str, RedetectionCandidate]:
        """Resolve positions of look-alikes that are not all searched at once."""
        sought = {t.key for t in self.tracks if t.state not in IN_VIEW} - set(placed)
        found: dict[str, RedetectionCandidate] = {}
        for place in placed.values():
            own = resolve_look_alike(scene, place, self.views, self._alike, sought - set(found))
            found[own.name] = own
        return found

    def _segment(self, scene: Scene, same: Mapping[str, Mask]) -> None:
        claims = [_claim(t, scene, same) for t in self.tracks]
        blobs = assign_pixels(claims, scene.size)
        shown = zip(self.tracks, claims, blobs, strict=True)
        self.tracks = tuple(self._with_pixels(t, c, b, scene) for t, c, b in shown)

    def _with_pixels(
        self, track: TaughtObjectTrack, claim: Claim | None, blob: Blob | None, scene: Scene
    ) -> TaughtObjectTrack:
        """A track with the pixels it won, and its appearance adapted to them."""
        pose, appearance, rest = track.pose, track.appearance, track.rest
        if claim is None or blob is None or pose is None or appearance is None:
            return replace(track, visible=None)
        resting = track.state is TrackState.RESTING
        if resting and rest is not None and np.array_equal(blob.mask, rest.blob.mask):
            return track if track.visible is rest.blob else replace(track, visible=rest.blob)
        blob = without_specks(blob)
        if blob is None or blob.area < MIN_VISIBLE_SHARE * appearance.area * pose.scale**2:
            return replace(track, visible=None)
        if resting:
            return replace(track, visible=blob)
        track = replace(track, visible=blob)
        if self._count % 2:
            track = adapt_appearance(
                track, scene, claim, blob, self.views[track.view_number].appearance
            )
        return put_at_rest(track, scene, self._count == 1) if self._static else track


def _redetected(
    track: TaughtObjectTrack, place: RedetectionCandidate | None, scene: Scene
) -> TaughtObjectTrack:
    if place is None:
        return track
    appearance, pose = place.appearance, place.match.pose
    if place.visible is not None and track.id:
        appearance = relearn_appearance(appearance, pose, place.visible, scene)
    new = replace(
        track,
        view_number=place.view_number,
        state=TrackState.MOVING,
        appearance=appearance,
        rest=None,
        path=(),
        confirmed=track.confirmed or place.match.score > SURE,
        peak=place.match.peak,
        explained_share=place.match.explained_share,
    )
    return with_observation(new, scene.time, pose)


def _without_occluders(track: TaughtObjectTrack, before: Sequence[Blob]) -> TaughtObjectTrack:
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


def _with_unknown_position(track: TaughtObjectTrack) -> TaughtObjectTrack:
    """A track in an image of another size: its position is unknown."""
    return replace(track, state=TrackState.ABSENT, visible=None, rest=None, path=())


def _with_id(
    track: TaughtObjectTrack, scene: Scene, new_id: Callable[[Blob], int]
) -> TaughtObjectTrack:
    if track.id or track.visible is None:
        return track
    return replace(track, id=new_id(track.visible), first_seen=scene.time)


def _claim(track: TaughtObjectTrack, scene: Scene, same: Mapping[str, Mask]) -> Claim | None:
    """The claim of an object in view on the image."""
    if track.state not in IN_VIEW or scene.time - track.last_seen > HOLD_S:
        return None
    if track.state is TrackState.RESTING and track.rest is not None:
        return rest_log_odds(track.rest, same[track.key])
    assert track.pose is not None
    assert track.appearance is not None
    return appearance_log_odds(scene, track.pose, track.appearance)
