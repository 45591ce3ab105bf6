"""Frame-to-frame tracking of an object: at rest, moving, covered or lost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.pose import Doubles, PatchPose
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance
from visup.percepts.appearance.scenery.points import STILL, PointMotion, similarity_of
from visup.percepts.appearance.tracking.learning import PATH_S
from visup.percepts.appearance.tracking.track import State, ThingTrack
from visup.percepts.appearance.tracking.verification import (
    colour_agreement,
    explained_pixels,
    respond,
    template_of,
    verify,
)

Points = tuple[NDArray[np.float32], NDArray[np.float32]]

AS_IT_WAS = 0.97  # unchanged share of an object's window from which the object has not moved
LOSE_S = 0.5  # how long an object is tracked without being observed
LEAST_PEAK, LEAST_SHARE = 0.25, 0.3  # least filter peak and explained share of a tracked object
UNSURE_PEAK = 0.4  # filter peak below which colours localise the object
OWN_COLOURS = 0.25  # least excess of the object's colours over the surroundings
MOVED_PX = 1.0  # least motion that ends rest, working pixels
CARRIED = 0.6  # share of an object's pixels that a move must explain if many points agree on it
BETTER = 0.04  # otherwise: share of pixels by which the move must explain more than rest does
COVERED = 0.2  # unchanged share below which an object at rest is covered
UNCOVERED = 0.5  # unchanged share above which a hidden object is seen at rest again
FOUND_AGAIN = 0.6  # match score above which a hidden object is seen again, not at rest
PLAIN = 0.8  # share of the last peak from which agreeing points need no scale and rotation search
LOOK_CLOSER = 4  # frames between two such searches in any case
_GROWTH, _TURN = 1.035, 0.07  # scale factor and rotation (radians) per frame that are tried
_SURER = 1.03  # factor by which the filter must respond better to these
_FIRM = 5  # fewest points to estimate rotation and scale


@dataclass(frozen=True, slots=True, eq=False)
class FrameMotion:
    """The motion from one frame to the next.

    Attributes:
        scene: The new frame.
        camera: (2, 3) similarity of the picture; `STILL` itself when the camera rests.
        points: Points on objects, by the number of their track.
        number: Number of the frame.
        same: For each object with a rest memory, by name, (h, w) bool: unchanged pixels of its window.
    """

    scene: Scene
    camera: Doubles
    points: PointMotion
    number: int
    same: Mapping[str, NDArray[np.bool_]]

    @property
    def static(self) -> bool:
        """Whether the camera rests."""
        return self.camera is STILL


def followed(track: ThingTrack, owner: int, motion: FrameMotion) -> ThingTrack:
    """The track in the next frame.

    Args:
        track: The previous track.
        owner: Number of its points.
        motion: The frame's motion.
    """
    if track.state is State.ABSENT or track.pose is None or track.looks is None:
        return track
    if track.state is State.HIDDEN:
        return _redetected(track, motion)
    if track.state is State.RESTING and motion.static and track.rest is not None:
        return _at_rest(track, motion.points.of(owner), motion)
    return _moving(track, motion.points.of(owner), motion)


def noted(track: ThingTrack, time: float, pose: PatchPose) -> ThingTrack:
    """The track with an observation at a pose and time (seconds) added to its path."""
    path = tuple(p for p in track.path if time - p[0] <= PATH_S)
    return replace(track, pose=pose, path=(*path, (time, pose)), seen=time)


def _at_rest(track: ThingTrack, points: Points, motion: FrameMotion) -> ThingTrack:
    """Track an object at rest: it stays so unless a move explains more, or it is covered."""
    scene, pose, it, rest = motion.scene, track.pose, track.looks, track.rest
    assert pose is not None
    assert it is not None
    assert rest is not None
    same = motion.same[track.name]
    unchanged_share = float(np.mean(same[rest.blob.mask]))
    if np.mean(same) > AS_IT_WAS:
        return noted(replace(track, explained=unchanged_share, peak=1.0), scene.time, pose)
    best, peak, firm = _located(track, pose, points, motion)
    template = template_of(it.lab, it.mask)
    _, there = explained_pixels(template, scene.patch(best, it.shape))
    _, here = explained_pixels(template, scene.patch(pose, it.shape))
    here = max(here, unchanged_share)
    # An object as bright as its background hardly changes what it uncovers; its points decide.
    least = CARRIED if firm else here + BETTER
    if best.apart(pose, it.radius) >= MOVED_PX and peak >= 0.3 and there >= least:
        return _seen_moving(track, best, peak, there, scene)
    if unchanged_share < COVERED and colour_agreement(scene, best, it)[0] > OWN_COLOURS:
        return _seen_moving(track, best, peak, there, scene)
    track = replace(track, explained=here, peak=peak)
    if unchanged_share >= COVERED or here >= 0.3:
        return noted(track, scene.time, pose)
    if scene.time - track.seen > LOSE_S:
        return replace(track, state=State.HIDDEN, visible=None)
    return track


def _moving(track: ThingTrack, points: Points, motion: FrameMotion) -> ThingTrack:
    scene, it = motion.scene, track.looks
    assert it is not None
    assert track.pose is not None
    base = track.pose.moved(motion.camera)
    best, peak, firm = _located(track, base, points, motion)
    template = template_of(it.lab, it.mask)
    _, share = explained_pixels(template, scene.patch(best, it.shape))
    colours, middle = colour_agreement(scene, best, it)
    if peak < UNSURE_PEAK and colours > OWN_COLOURS and not firm:
        # It bends or turns: its colours localise it.
        best = _between(best, middle, 0.4)
    if (peak > LEAST_PEAK and share > LEAST_SHARE) or colours > OWN_COLOURS:
        return replace(_seen_moving(track, best, peak, share, scene), colours=colours)
    if scene.time - track.seen > LOSE_S:
        return replace(track, state=State.HIDDEN, visible=None, rest=None, pose=best)
    guess = _by_points(track.pose, points)[0] or base
    return replace(track, state=State.MOVING, pose=guess, peak=peak, explained=share, rest=None)


def _seen_moving(
    track: ThingTrack, pose: PatchPose, peak: float, share: float, scene: Scene
) -> ThingTrack:
    now = replace(track, state=State.MOVING, peak=peak, explained=share, rest=None)
    return noted(now, scene.time, pose)


def _redetected(track: ThingTrack, motion: FrameMotion) -> ThingTrack:
    """Search for a hidden object where it was."""
    assert track.pose is not None
    scene, it, pose = motion.scene, track.looks, track.pose.moved(motion.camera)
    if track.rest is not None and motion.static:
        same = motion.same[track.name]
        if np.mean(same[track.rest.blob.mask]) > UNCOVERED:
            return noted(replace(track, state=State.RESTING), scene.time, pose)
    elif track.rest is not None:
        track = replace(track, rest=None)
    if it is not None and motion.number % 3 == 0:
        match = verify(scene, it, pose)
        if match.score > FOUND_AGAIN:
            now = replace(track, state=State.MOVING, rest=None, path=())
            return noted(now, scene.time, match.pose)
    return replace(track, pose=pose)


def _located(
    track: ThingTrack, base: PatchPose, points: Points, motion: FrameMotion
) -> tuple[PatchPose, float, bool]:
    """Localise an object by its filter, near the position predicted by its points and its path.

    Returns:
        The pose, the filter's peak, and whether many points agree on the move.
    """
    it, scene = track.looks, motion.scene
    assert it is not None
    assert track.pose is not None
    guess, firm = _by_points(track.pose, points)
    best, peak = base, 0.0
    if guess is not None:
        at, peak = _answer(scene, guess, it)
        # Points are precise but drift; the filter corrects them slowly.
        best = _between(guess, at, 0.25) if at.apart(guess, 0) < 1.6 * guess.scale else at
        if firm and peak > PLAIN * track.peak and motion.number % LOOK_CLOSER:
            return best, peak, True
    at, height = _answer(scene, base, it)
    if height > peak:
        best, peak = at, height
    return (*_resized(best, peak, it, scene), firm)


def _resized(best: PatchPose, peak: float, it: Appearance, scene: Scene) -> tuple[PatchPose, float]:
    """The pose slightly scaled or rotated, when the filter responds better to that."""
    for by, turn in ((_GROWTH, 0.0), (1 / _GROWTH, 0.0), (1.0, _TURN), (1.0, -_TURN)):
        at, height = _answer(scene, best.resized(by, turn), it)
        if height > peak * _SURER:
            scale = best.scale * (1 + 0.5 * (by - 1))
            best, peak = PatchPose(at.x, at.y, scale, best.angle + 0.5 * turn), height
    return best, peak


def _answer(scene: Scene, pose: PatchPose, it: Appearance) -> tuple[PatchPose, float]:
    return respond(scene, pose, it.shape, it.colours, it.filter)


def _between(a: PatchPose, b: PatchPose, share: float) -> PatchPose:
    return replace(a, x=a.x + share * (b.x - a.x), y=a.y + share * (b.y - a.y))


def _by_points(pose: PatchPose, points: Points) -> tuple[PatchPose | None, bool]:
    """The pose moved with most of an object's points, None when too few; and whether it is firm."""
    before, after = points
    found = similarity_of(before, after, 1.5) if len(before) >= _FIRM else None
    if found is not None and found[1] > 0.5:
        by = float(np.hypot(found[0][0, 0], found[0][1, 0]))
        if 0.8 < by < 1.25:
            return pose.moved(found[0]), len(before) >= 2 * _FIRM
    if len(before) < 2:
        return None, False
    dx, dy = np.median(after - before, axis=0).tolist()
    return replace(pose, x=pose.x + dx, y=pose.y + dy), False
