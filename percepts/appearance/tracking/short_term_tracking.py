"""Frame-to-frame tracking of an object: at rest, moving, covered or lost."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.point_tracking import STILL, PointMotion, similarity_of
from visup.percepts.appearance.models.appearance_model import Appearance
from visup.percepts.appearance.models.deformation import (
    Points,
    deformation,
    deformed,
    point_deformations,
    with_former_size,
)
from visup.percepts.appearance.models.pose import Doubles, PatchPose
from visup.percepts.appearance.models.rest_memory import Displacement, displacement_since
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.adaptation import PATH_S, refreshed, still_px
from visup.percepts.appearance.tracking.track import IN_VIEW, TaughtObjectTrack, TrackState
from visup.percepts.appearance.tracking.track_pixels import points_of_own_colour
from visup.percepts.appearance.tracking.verification import (
    colour_agreement,
    explained_pixels,
    filter_peak,
    mean_difference,
    template_of,
    verify,
)

UNCHANGED_SHARE = 0.97  # unchanged share of an object's window from which the object has not moved
LOSE_S = 0.5  # how long an object is tracked without being observed
MIN_PEAK, MIN_SHARE = 0.25, 0.3  # least filter peak and explained share of a tracked object
UNSURE_PEAK = 0.4  # filter peak below which colours localise the object
OWN_COLOURS = 0.25  # least excess of the object's colours over the surroundings
SHIFTED_PX = 0.5  # least shift at which an object at rest is looked at closely, working pixels
MOVED_PX = 1.0  # least motion that ends rest, working pixels
FIRM_MOVE_SHARE = 0.6
"""Share of an object's pixels that a move must explain if many points agree on it."""
MOVE_MARGIN = 0.04  # otherwise: share of pixels by which the move must explain more than rest does
COVERED_SHARE = 0.2  # unchanged share below which an object at rest is covered
UNCOVERED_SHARE = 0.5  # unchanged share above which a hidden object is seen at rest again
REDETECTION_SCORE = 0.6  # match score above which a hidden object is seen again, not at rest
BENT_SHARE = 0.6  # share of its pixels that a deformation must explain to locate an object
LESS_DIFFERENCE = 0.03  # share by which it must differ less from the frame than what is rigid does
COLOUR_MARGIN = 0.05  # most colour excess that it may cost: it would stretch over the background
BENT_RATE = 0.3  # share of the frame in an appearance that has just been deformed
STEADY_PEAK_SHARE = 0.8
"""Share of the last peak from which agreeing points need no scale and rotation search."""
REFINEMENT_INTERVAL = 4  # frames between two such searches in any case
_GROWTH, _TURN = 1.035, 0.07  # scale factor and rotation (radians) per frame that are tried
_BETTER_PEAK = 1.03  # factor by which the filter must respond better to these
_FEWEST_POINTS = 5  # fewest points to estimate rotation and scale


@dataclass(frozen=True, slots=True, eq=False)
class FrameMotion:
    """The motion from one frame to the next.

    Attributes:
        scene: The new frame.
        camera: (2, 3) similarity of the image; `STILL` itself when the camera rests.
        points: Points on objects, by the number of their track.
        number: Number of the frame.
        same: For each object with a rest memory, by name, (h, w) bool: unchanged pixels of its window.
        shifts: For each object at rest, by name, how far it has shifted.
    """

    scene: Scene
    camera: Doubles
    points: PointMotion
    number: int
    same: Mapping[str, NDArray[np.bool_]]
    shifts: Mapping[str, Displacement]

    @property
    def static(self) -> bool:
        """Whether the camera rests."""
        return self.camera is STILL


def track_object(track: TaughtObjectTrack, owner: int, motion: FrameMotion) -> TaughtObjectTrack:
    """The track in the next frame.

    Args:
        track: The previous track.
        owner: Number of its points.
        motion: The frame's motion.
    """
    if track.state is TrackState.ABSENT or track.pose is None or track.appearance is None:
        return track
    if track.state is TrackState.HIDDEN:
        return _redetect_hidden(track, motion)
    if track.state is TrackState.RESTING and motion.static and track.rest is not None:
        return _track_at_rest(track, motion.points.of(owner), motion)
    points = motion.points.of(owner)
    return _deformed(track, _track_moving(track, points, motion), points, motion)


def displacements(tracks: Iterable[TaughtObjectTrack], scene: Scene) -> dict[str, Displacement]:
    """How far each object at rest has shifted in a frame since it came to rest, by name."""
    resting = (t for t in tracks if t.state is TrackState.RESTING)
    return {t.key: displacement_since(t.rest, scene) for t in resting if t.rest is not None}


def is_calm(same: NDArray[np.bool_], shift: Displacement | None) -> bool:
    """Whether an object at rest has neither changed nor shifted."""
    shifted = shift is not None and shift.certain and shift.length >= SHIFTED_PX
    return not shifted and bool(np.mean(same) > UNCHANGED_SHARE)


def with_observation(track: TaughtObjectTrack, time: float, pose: PatchPose) -> TaughtObjectTrack:
    """The track with an observation at a pose and time (seconds) added to its path."""
    path = tuple(p for p in track.path if time - p[0] <= PATH_S)
    return replace(track, pose=pose, path=(*path, (time, pose)), last_seen=time)


def _track_at_rest(
    track: TaughtObjectTrack, points: Points, motion: FrameMotion
) -> TaughtObjectTrack:
    """Track an object at rest: it stays so unless a move explains more, or it is covered."""
    scene, pose, appearance, rest = motion.scene, track.pose, track.appearance, track.rest
    assert pose is not None
    assert appearance is not None
    assert rest is not None
    same = motion.same[track.key]
    unchanged_share = float(np.mean(same[rest.blob.mask]))
    shift = motion.shifts.get(track.key)
    if is_calm(same, shift):
        return with_observation(
            replace(track, explained_share=unchanged_share, peak=1.0), scene.time, pose
        )
    if shift is not None and shift.certain and shift.length >= max(MOVED_PX, still_px(track)):
        at = replace(pose, x=pose.x + shift.dx, y=pose.y + shift.dy)
        _, peak = _filter_peak_of(scene, at, appearance)
        return _observed_moving(track, at, peak, unchanged_share, scene)
    best, peak, firm = _localise(track, pose, points, motion)
    template = template_of(appearance.lab, appearance.mask)
    _, there = explained_pixels(template, scene.patch(best, appearance.shape))
    _, here = explained_pixels(template, scene.patch(pose, appearance.shape))
    here = max(here, unchanged_share)
    # An object as bright as its background hardly changes what it uncovers; its points decide.
    least = FIRM_MOVE_SHARE if firm else here + MOVE_MARGIN
    if best.apart(pose, appearance.radius) >= MOVED_PX and peak >= 0.3 and there >= least:
        return _observed_moving(track, best, peak, there, scene)
    if (
        unchanged_share < COVERED_SHARE
        and colour_agreement(scene, best, appearance)[0] > OWN_COLOURS
    ):
        return _observed_moving(track, best, peak, there, scene)
    track = replace(track, explained_share=here, peak=peak)
    if unchanged_share >= COVERED_SHARE or here >= 0.3:
        return with_observation(track, scene.time, pose)
    if scene.time - track.last_seen > LOSE_S:
        return replace(track, state=TrackState.HIDDEN, visible=None)
    return track


def _track_moving(
    track: TaughtObjectTrack, points: Points, motion: FrameMotion
) -> TaughtObjectTrack:
    scene, appearance = motion.scene, track.appearance
    assert appearance is not None
    assert track.pose is not None
    base = track.pose.moved(motion.camera)
    best, peak, firm = _localise(track, base, points, motion)
    template = template_of(appearance.lab, appearance.mask)
    _, share = explained_pixels(template, scene.patch(best, appearance.shape))
    colours, middle = colour_agreement(scene, best, appearance)
    if peak < UNSURE_PEAK and colours > OWN_COLOURS and not firm:
        # It bends or turns: its colours localise it.
        best = _between(best, middle, 0.4)
    if (peak > MIN_PEAK and share > MIN_SHARE) or colours > OWN_COLOURS:
        return replace(_observed_moving(track, best, peak, share, scene), colour_excess=colours)
    if scene.time - track.last_seen > LOSE_S:
        return replace(track, state=TrackState.HIDDEN, visible=None, rest=None, pose=best)
    guess = _pose_from_points(track.pose, points)[0] or base
    return replace(
        track, state=TrackState.MOVING, pose=guess, peak=peak, explained_share=share, rest=None
    )


def _deformed(
    old: TaughtObjectTrack, rigid: TaughtObjectTrack, points: Points, motion: FrameMotion
) -> TaughtObjectTrack:
    """The track with an appearance that is deformed as its points moved, if that explains the frame better.

    Args:
        old: The previous track.
        rigid: The track in this frame with the appearance as it was.
        points: Points of the object.
        motion: The frame's motion.
    """
    scene, pose, appearance = motion.scene, old.pose, old.appearance
    if old.state not in IN_VIEW or pose is None or appearance is None:
        return rigid
    points = points_of_own_colour(scene, points, appearance.colours)
    found = _bent(appearance, pose, points, motion)
    if found is None:
        return rigid
    pose, bent = found
    patch = scene.patch(pose, bent.shape)
    _, share = explained_pixels(template_of(bent.lab, bent.mask), patch)
    colours, _ = colour_agreement(scene, pose, bent)
    if rigid.last_seen == scene.time and rigid.pose is not None:
        there = mean_difference(appearance, scene.patch(rigid.pose, bent.shape))
        better = mean_difference(bent, patch) <= (1 - LESS_DIFFERENCE) * there
    else:
        better = share >= BENT_SHARE
    if not better or colours < rigid.colour_excess - COLOUR_MARGIN:
        return rigid
    now = replace(old, appearance=refreshed(bent, patch, BENT_RATE), colour_excess=colours)
    return _observed_moving(now, pose, rigid.peak, share, scene)


def _bent(
    appearance: Appearance, pose: PatchPose, points: Points, motion: FrameMotion
) -> tuple[PatchPose, Appearance] | None:
    """The new pose and the deformed appearance; None if the points fit a similarity or are too few."""
    similar = _pose_from_points(pose, points)[0]
    if similar is None or point_deformations(appearance.shape, pose, similar, points) is None:
        return None
    new = with_former_size(similar, pose, points, motion.camera)
    bend = deformation(appearance.shape, pose, new, points)
    return None if bend is None else (new, deformed(appearance, bend))


def _observed_moving(
    track: TaughtObjectTrack, pose: PatchPose, peak: float, share: float, scene: Scene
) -> TaughtObjectTrack:
    now = replace(track, state=TrackState.MOVING, peak=peak, explained_share=share, rest=None)
    return with_observation(now, scene.time, pose)


def _redetect_hidden(track: TaughtObjectTrack, motion: FrameMotion) -> TaughtObjectTrack:
    """Search for a hidden object where it was."""
    assert track.pose is not None
    scene, appearance, pose = motion.scene, track.appearance, track.pose.moved(motion.camera)
    if track.rest is not None and motion.static:
        same = motion.same[track.key]
        if np.mean(same[track.rest.blob.mask]) > UNCOVERED_SHARE:
            return with_observation(replace(track, state=TrackState.RESTING), scene.time, pose)
    elif track.rest is not None:
        track = replace(track, rest=None)
    if appearance is not None and motion.number % 3 == 0:
        match = verify(scene, appearance, pose)
        if match.score > REDETECTION_SCORE:
            now = replace(track, state=TrackState.MOVING, rest=None, path=())
            return with_observation(now, scene.time, match.pose)
    return replace(track, pose=pose)


def _localise(
    track: TaughtObjectTrack, base: PatchPose, points: Points, motion: FrameMotion
) -> tuple[PatchPose, float, bool]:
    """Localise an object by its filter, near the position predicted by its points and its path.

    Returns:
        The pose, the filter's peak, and whether many points agree on the move.
    """
    appearance, scene = track.appearance, motion.scene
    assert appearance is not None
    assert track.pose is not None
    guess, firm = _pose_from_points(track.pose, points)
    best, peak = base, 0.0
    if guess is not None:
        at, peak = _filter_peak_of(scene, guess, appearance)
        # Points are precise but drift; the filter corrects them slowly.
        best = _between(guess, at, 0.25) if at.apart(guess, 0) < 1.6 * guess.scale else at
        if firm and peak > STEADY_PEAK_SHARE * track.peak and motion.number % REFINEMENT_INTERVAL:
            return best, peak, True
    at, other_peak = _filter_peak_of(scene, base, appearance)
    if other_peak > peak:
        best, peak = at, other_peak
    return (*_refine_scale_and_rotation(best, peak, appearance, scene), firm)


def _refine_scale_and_rotation(
    best: PatchPose, peak: float, appearance: Appearance, scene: Scene
) -> tuple[PatchPose, float]:
    """The pose slightly scaled or rotated, when the filter responds better to that."""
    for factor, turn in ((_GROWTH, 0.0), (1 / _GROWTH, 0.0), (1.0, _TURN), (1.0, -_TURN)):
        at, other_peak = _filter_peak_of(scene, best.resized(factor, turn), appearance)
        if other_peak > peak * _BETTER_PEAK:
            scale = best.scale * (1 + 0.5 * (factor - 1))
            best, peak = PatchPose(at.x, at.y, scale, best.angle + 0.5 * turn), other_peak
    return best, peak


def _filter_peak_of(
    scene: Scene, pose: PatchPose, appearance: Appearance
) -> tuple[PatchPose, float]:
    return filter_peak(scene, pose, appearance.shape, appearance.colours, appearance.filter)


def _between(a: PatchPose, b: PatchPose, share: float) -> PatchPose:
    return replace(a, x=a.x + share * (b.x - a.x), y=a.y + share * (b.y - a.y))


def _pose_from_points(pose: PatchPose, points: Points) -> tuple[PatchPose | None, bool]:
    """The pose moved with most of an object's points, None when too few; and whether it is firm."""
    before, after = points
    found = similarity_of(before, after, 1.5) if len(before) >= _FEWEST_POINTS else None
    if found is not None and found[1] > 0.5:
        by = float(np.hypot(found[0][0, 0], found[0][1, 0]))
        if 0.8 < by < 1.25:
            return pose.moved(found[0]), len(before) >= 2 * _FEWEST_POINTS
    if len(before) < 2:
        return None, False
    dx, dy = np.median(after - before, axis=0).tolist()
    return replace(pose, x=pose.x + dx, y=pose.y + dy), False
