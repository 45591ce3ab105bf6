"""Redetection of objects that are not in view, and their assignment to positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.background.background_memory import has_changed
from visup.percepts.appearance.models.appearance_model import Appearance, ViewModel
from visup.percepts.appearance.models.blob import Blob, overlap_of_smaller
from visup.percepts.appearance.models.colour_patches import ColourPatch, unique_colour_patch
from visup.percepts.appearance.models.moving_body import MovingBody, colour_similarity
from visup.percepts.appearance.models.pose import PatchPose, paint, window_of
from visup.percepts.appearance.models.scene import Scene, prepare_scene
from visup.percepts.appearance.tracking.detection import colour_peaks, search_image
from visup.percepts.appearance.tracking.track import TaughtObjectTrack
from visup.percepts.appearance.tracking.verification import Match, verify

SURE = 0.6  # score that suffices by itself: no other object was observed to reach it
FAIR, APART = 0.42, 1.5  # score that suffices if it exceeds those of other positions by a factor
MIN_COLOUR_EXCESS = 0.45
"""Least excess of the object's colours at a position over those around it."""
NOISE = 0.15  # score that any position may have by chance
MOVING_FAIR, MOVING_APART = 0.45, 1.2  # as FAIR and APART, among positions that changed recently
TAUGHT_POSE_BONUS = 0.1  # bonus of the position where an object was taught
RECENT_SIZES = (0.85, 1.0, 1.18)
SIZES = (0.75, 0.87, 1.0, 1.15, 1.32)
ROTATIONS = (-0.4, 0.4)
BODY_SIMILARITY = 0.5
"""Least intersection of the colour histograms of a moving body and of an object."""
BODY_SIZES = (0.5, 1.8)  # size (root of the area) of a moving body, relative to the object's
MIN_CUT_BODY_SIZE = 0.25  # least relative size of a moving body that the border cuts off
OCCLUDER_EXCESS = -0.5
"""Excess of an object's colours in a blob over it, up to which the blob occludes it."""
OCCUPIED_SHARE = 0.5
"""Share of a position covered by another object from which that position is occupied."""


@dataclass(frozen=True, slots=True)
class RedetectionCandidate:
    """A candidate position of an object.

    Attributes:
        name: Name of the object; that of its track, if it has one (`TaughtObjectTrack.key`).
        view_number: Number of the matching view.
        appearance: Appearance there.
        match: Its match.
        score: Score of the match, with the bonus of the position.
        visible: Its visible pixels, where they are known.
    """

    name: str
    view_number: int
    appearance: Appearance
    match: Match
    score: float
    visible: Blob | None = None

    def pixels(self, scene: Scene) -> Blob | None:
        """The pixels that it covers: the visible ones, or all those of the pose; None when out of view."""
        return self.visible or footprint(scene, self.match.pose, self.appearance)


def candidates(
    scene: Scene,
    track: TaughtObjectTrack,
    views: Sequence[tuple[int, ViewModel]],
    changed: NDArray[np.bool_] | None,
    recently_changed: NDArray[np.bool_] | None,
) -> list[RedetectionCandidate]:
    """Places of an object that is not in view, in the whole image.

    Args:
        scene: The frame.
        track: Its track.
        views: Its taught views, each with its number.
        changed: (h, w) bool, as from `BackgroundMemory`: the parts that may hold it; None for all.
        recently_changed: (h, w) bool, of any size: what has changed recently; None where nothing has.
    """
    if changed is not None and not changed.any():
        return []
    found = [c for k, v in views for c in view_candidates(scene, v, k, changed)]
    found += candidates_by_last_appearance(scene, track, changed)
    if recently_changed is not None and not found:
        found = [
            c for k, v in views for c in candidates_where_changed(scene, v, k, recently_changed)
        ]
    if changed is None:
        return found
    with_pixels = [(f, f.pixels(scene)) for f in found]
    return [f for f, pixels in with_pixels if pixels is not None and has_changed(changed, pixels)]


def view_candidates(
    scene: Scene, view: ViewModel, number: int, where: NDArray[np.bool_] | None = None
) -> list[RedetectionCandidate]:
    """Positions that match an object clearly better than others do.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
        where: (h, w) bool, of any size: parts of the image that may hold it; None for all.
    """
    appearance, home = view.appearance, taught_pose(scene, view)
    unit = home.scale
    poses = [PatchPose(0, 0, unit * s) for s in SIZES] + [
        PatchPose(0, 0, unit, a) for a in ROTATIONS
    ]
    matches = [
        verify(scene, appearance, home),
        *search_image(scene, appearance, poses, where=where),
    ]
    near = 6 * unit
    return [
        RedetectionCandidate(
            view.name,
            number,
            appearance,
            m,
            m.score + TAUGHT_POSE_BONUS * (m.pose.apart(home, 10) < near),
        )
        for m in _clearly_best(matches, appearance)
    ]


def taught_pose(scene: Scene, view: ViewModel) -> PatchPose:
    """The pose at which an object was taught, in this frame."""
    by = max(scene.size) / max(view.size)
    return PatchPose(view.pose.x * by, view.pose.y * by, view.pose.scale * by)


def candidates_where_changed(
    scene: Scene, view: ViewModel, number: int, where: NDArray[np.bool_]
) -> list[RedetectionCandidate]:
    """Recently changed positions that match an object better than anything else that moves.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
        where: (h, w) bool, of any size: recently changed parts.
    """
    appearance = view.appearance
    unit = view.pose.scale * max(scene.size) / max(view.size)
    poses = [PatchPose(0, 0, unit * s) for s in SIZES] + [
        PatchPose(0, 0, unit, a) for a in ROTATIONS
    ]
    found = search_image(scene, appearance, poses, where=where)
    fine = [m for m in _clearly_best(found, appearance, MOVING_APART) if m.score > MOVING_FAIR]
    if not fine:
        fine = _colour_match(scene, appearance, PatchPose(0, 0, unit), where)
    return [RedetectionCandidate(view.name, number, appearance, m, m.score) for m in fine]


def candidates_at_bodies(
    scene: Scene, view: ViewModel, number: int, bodies: Sequence[MovingBody]
) -> list[RedetectionCandidate]:
    """Moving bodies that have the colours of an object and about its size.

    A body that moves independently is one object with a known outline. Its colours are therefore sufficient,
    even if the object was taught in another posture, or from another side.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
        bodies: The moving bodies.
    """
    found = (_body_candidate(scene, view, number, b) for b in bodies)
    return [f for f in found if f is not None]


def _body_candidate(
    scene: Scene, view: ViewModel, number: int, body: MovingBody
) -> RedetectionCandidate | None:
    appearance = view.appearance
    unit = view.pose.scale * max(scene.size) / max(view.size)
    size = float(np.sqrt(body.blob.area)) / (2 * appearance.radius * unit)
    least, most = BODY_SIZES
    if not (MIN_CUT_BODY_SIZE if body.cut else least) < size < most:
        return None
    excess, similarity = colour_similarity(scene, appearance, body.blob)
    if excess < MIN_COLOUR_EXCESS or similarity < BODY_SIMILARITY:
        return None
    left, top, right, bottom = body.blob.window
    pose = PatchPose((left + right - 1) / 2, (top + bottom - 1) / 2, unit)
    share = float(np.sqrt(min(1.0, excess) * similarity))
    return RedetectionCandidate(view.name, number, appearance, Match(pose, share, share), share)


def candidates_by_colour(scene: Scene, view: ViewModel, number: int) -> list[RedetectionCandidate]:
    """The only patch of the image with an object's colours and about its size, if there is one.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
    """
    appearance, unit = view.appearance, taught_pose(scene, view).scale
    return _patch_candidates(
        view.name, number, appearance, unique_colour_patch(scene, appearance, unit)
    )


def is_unique_by_colour(view: ViewModel) -> bool:
    """Whether an object can be located by its colours alone in the image in which it was taught.

    If not (a black gripper in front of dark furniture), it is not searched by colours alone anywhere else.
    """
    scene = prepare_scene(view.scene, 0.0)
    home = footprint(scene, taught_pose(scene, view), view.appearance)
    seen = (place.visible for place in candidates_by_colour(scene, view, 0))
    return home is not None and any(
        b is not None and overlap_of_smaller(b, home) > OCCUPIED_SHARE for b in seen
    )


def candidates_by_last_appearance(
    scene: Scene, track: TaughtObjectTrack, where: NDArray[np.bool_] | None = None
) -> list[RedetectionCandidate]:
    """Positions that match an object's last appearance.

    Args:
        scene: The frame.
        track: The track of a hidden object.
        where: (h, w) bool, of any size: parts of the image that may hold it; None for all.
    """
    appearance, last = track.appearance, track.pose
    if appearance is None or last is None:
        return []
    poses = [PatchPose(0, 0, last.scale * s, last.angle) for s in RECENT_SIZES]
    found = _clearly_best(search_image(scene, appearance, poses, where=where), appearance)
    if not found:
        found = _colour_match(scene, appearance, last, where)
    places = [
        RedetectionCandidate(track.key, track.view_number, appearance, m, m.score) for m in found
    ]
    if found or where is None:
        return places
    return _patch_candidates(
        track.key,
        track.view_number,
        appearance,
        unique_colour_patch(scene, appearance, last.scale, where),
    )


def _patch_candidates(
    name: str, number: int, appearance: Appearance, found: ColourPatch | None
) -> list[RedetectionCandidate]:
    if found is None:
        return []
    match = Match(found.pose, found.share, found.share)
    return [RedetectionCandidate(name, number, appearance, match, found.share, found.blob)]


def _colour_match(
    scene: Scene, appearance: Appearance, last: PatchPose, where: NDArray[np.bool_] | None = None
) -> list[Match]:
    """The position where an object's colours concentrate, if it is unique."""
    (most, pose), (second, _) = colour_peaks(scene, appearance, last, where)
    if most < MIN_COLOUR_EXCESS or second > most / APART:
        return []
    share = min(1.0, most)
    return [Match(pose, share, share)]


def _clearly_best(
    matches: Sequence[Match], appearance: Appearance, apart: float = APART
) -> list[Match]:
    """The matches that are clearly better than those of other positions."""
    if not matches:
        return []
    top = max(matches, key=lambda m: m.score).pose
    away = [m.score for m in matches if m.pose.apart(top, 0) > appearance.radius * top.scale]
    rival = max([*away, NOISE])
    return [m for m in matches if m.score > SURE or (m.score > FAIR and m.score > apart * rival)]


def assign_candidates(
    scene: Scene, found: Sequence[RedetectionCandidate], taken: Sequence[tuple[Blob, Appearance]]
) -> dict[str, RedetectionCandidate]:
    """Assign positions to objects greedily, by score; an object gets at most one, and none that is taken.

    Args:
        scene: The frame.
        found: Candidates of all searched objects.
        taken: Blobs of objects already located, and their appearances.

    Returns:
        Name of an object -> its position.
    """
    assignment: dict[str, RedetectionCandidate] = {}
    occupied = list(taken)
    for candidate in sorted(found, key=lambda c: -c.score):
        if candidate.name in assignment:
            continue
        blob = candidate.pixels(scene)
        if blob is None or any(_is_occupied(scene, candidate, blob, *b) for b in occupied):
            continue
        assignment[candidate.name] = candidate
        occupied.append((blob, candidate.appearance))
    return assignment


def _is_occupied(
    scene: Scene,
    candidate: RedetectionCandidate,
    blob: Blob,
    other: Blob,
    other_appearance: Appearance,
) -> bool:
    """Whether a position is occupied by another object: it overlaps that object and does not occlude it.

    Args:
        scene: The frame.
        candidate: The candidate position.
        blob: Pixels of the candidate.
        other: Pixels of the other object.
        other_appearance: Appearance of the other object.
    """
    if overlap_of_smaller(blob, other) <= OCCUPIED_SHARE:
        return False
    return (
        candidate.visible is None
        or colour_similarity(scene, other_appearance, blob)[0] > OCCLUDER_EXCESS
    )


def footprint(scene: Scene, pose: PatchPose, appearance: Appearance) -> Blob | None:
    """The pixels that an object at a pose covers; None when out of view."""
    window = window_of(pose, appearance.shape, scene.size)
    if window is None:
        return None
    return Blob(window, np.greater(paint(appearance.mask, pose, window), 0.5))
