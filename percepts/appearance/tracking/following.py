"""Where a thing went from one frame to the next: at rest, moved, covered or lost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.pose import Doubles, PatchPose
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance
from visup.percepts.appearance.tracking.learning import PATH_S
from visup.percepts.appearance.tracking.points import STILL, PointMotion, similarity_of
from visup.percepts.appearance.tracking.track import State, ThingTrack
from visup.percepts.appearance.tracking.verification import (
    colour_agreement,
    explained_pixels,
    respond,
    template_of,
    verify,
)

Points = tuple[NDArray[np.float32], NDArray[np.float32]]

AS_IT_WAS = 0.97  # share of a window unchanged where nothing happened
LOSE_S = 0.5  # how long a thing is followed without being seen
LEAST_PEAK, LEAST_SHARE = 0.25, 0.3  # of what is still the thing
UNSURE_PEAK = 0.4  # of the filter, below which colours are asked where the thing is
OWN_COLOURS = 0.25  # how much more of its colours a thing shows than what is around it
MOVED_PX = 1.0  # working pixels
CARRIED = 0.6  # share that it must explain where many points of it agree on the move
BETTER = 0.04  # share of its pixels that a move must explain beyond rest
COVERED = 0.2  # share unchanged below which a thing at rest cannot be seen
UNCOVERED = 0.5
FOUND_AGAIN = 0.6
PLAIN = 0.8  # share of the last answer at which points that agree need no closer look
LOOK_CLOSER = 4  # frames, after which it is taken all the same
_GROWTH, _TURN = 1.035, 0.07  # of a thing from frame to frame, and radians, that are tried
_SURER = 1.03  # how much more the filter must answer for these
_FIRM = 5  # points that tell a turn and a growth


@dataclass(frozen=True, slots=True, eq=False)
class FrameMotion:
    """What moved from one frame to the next.

    Attributes:
        scene: The new frame.
        camera: (2, 3) similarity of the picture; `STILL` itself when the camera rests.
        points: On things, by the number of their track.
        number: Of the frame.
        same: For each thing whose rest is remembered, by its name, (h, w) bool: pixels of its window
            that look as they did.
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
    """A thing one frame on.

    Args:
        track: As it was.
        owner: Whose points are its own.
        motion: What moved.
    """
    if track.state is State.ABSENT or track.pose is None or track.looks is None:
        return track
    if track.state is State.HIDDEN:
        return _looked_again(track, motion)
    if track.state is State.RESTING and motion.static and track.rest is not None:
        return _at_rest(track, motion.points.of(owner), motion)
    return _moving(track, motion.points.of(owner), motion)


def noted(track: ThingTrack, time: float, pose: PatchPose) -> ThingTrack:
    """A thing that is seen at a pose."""
    path = tuple(p for p in track.path if time - p[0] <= PATH_S)
    return replace(track, pose=pose, path=(*path, (time, pose)), seen=time)


def _at_rest(track: ThingTrack, points: Points, motion: FrameMotion) -> ThingTrack:
    """It rests, unless a move explains more of its pixels, or nothing of it is left to be seen."""
    scene, pose, it, rest = motion.scene, track.pose, track.looks, track.rest
    assert pose is not None
    assert it is not None
    assert rest is not None
    same = motion.same[track.name]
    kept = float(np.mean(same[rest.blob.mask]))
    if np.mean(same) > AS_IT_WAS:
        return noted(replace(track, explained=kept, peak=1.0), scene.time, pose)
    best, peak, firm = _located(track, pose, points, motion)
    template = template_of(it.lab, it.mask)
    _, there = explained_pixels(template, scene.patch(best, it.shape))
    _, here = explained_pixels(template, scene.patch(pose, it.shape))
    here = max(here, kept)
    # What is as bright as what is behind it hardly changes the place that it leaves; its points tell.
    least = CARRIED if firm else here + BETTER
    if best.apart(pose, it.radius) >= MOVED_PX and peak >= 0.3 and there >= least:
        return _seen_moving(track, best, peak, there, scene)
    if kept < COVERED and colour_agreement(scene, best, it)[0] > OWN_COLOURS:
        return _seen_moving(track, best, peak, there, scene)
    track = replace(track, explained=here, peak=peak)
    if kept >= COVERED or here >= 0.3:
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
        # It bends, or turns another side to the camera: its colours tell where it is.
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


def _looked_again(track: ThingTrack, motion: FrameMotion) -> ThingTrack:
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
    """Where a thing's filter answers most, near where its points and its past expect it.

    Returns:
        The pose, how strongly it answers, and whether many points agree on where it went.
    """
    it, scene = track.looks, motion.scene
    assert it is not None
    assert track.pose is not None
    guess, firm = _by_points(track.pose, points)
    best, peak = base, 0.0
    if guess is not None:
        at, peak = _answer(scene, guess, it)
        # Points are precise, the filter is sure of the place: it pulls them back slowly.
        best = _between(guess, at, 0.25) if at.apart(guess, 0) < 1.6 * guess.scale else at
        if firm and peak > PLAIN * track.peak and motion.number % LOOK_CLOSER:
            return best, peak, True
    at, height = _answer(scene, base, it)
    if height > peak:
        best, peak = at, height
    return (*_resized(best, peak, it, scene), firm)


def _resized(best: PatchPose, peak: float, it: Appearance, scene: Scene) -> tuple[PatchPose, float]:
    """A little larger, smaller or turned, when the filter answers better to that."""
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
    """Where most of a thing's points went, None when too few were followed; and if it is sure."""
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
