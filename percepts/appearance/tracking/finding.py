"""Redetection of objects that are not in view, and their assignment to positions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.blob import Blob, overlap
from visup.percepts.appearance.looks.bodies import MovingBody, body_colours
from visup.percepts.appearance.looks.patches import FoundPatch, only_patch
from visup.percepts.appearance.looks.pose import PatchPose, paint, window_of
from visup.percepts.appearance.looks.scene import Scene, prepare_scene
from visup.percepts.appearance.looks.thing_model import Appearance, ViewModel
from visup.percepts.appearance.scenery.background_memory import holds
from visup.percepts.appearance.tracking.detection import colour_peaks, search
from visup.percepts.appearance.tracking.track import ThingTrack
from visup.percepts.appearance.tracking.verification import Match, verify

SURE = 0.6  # score that suffices by itself: no other object was observed to reach it
FAIR, APART = 0.42, 1.5  # score that suffices if it exceeds those of other positions by a factor
GATHERED = 0.45  # least excess of the object's colours at a position over those around it
NOISE = 0.15  # score that any position may have by chance
MOVING_FAIR, MOVING_APART = 0.45, 1.2  # as FAIR and APART, among positions that changed recently
AT_HOME = 0.1  # bonus of the position where an object was taught
RECENT_SIZES = (0.85, 1.0, 1.18)
SIZES = (0.75, 0.87, 1.0, 1.15, 1.32)
TURNS = (-0.4, 0.4)
BODY_ALIKE = 0.5  # least intersection of the colour histograms of a moving body and of an object
BODY_SIZES = (0.5, 1.8)  # size (root of the area) of a moving body, relative to the object's
BODY_CUT = 0.25  # least relative size of a moving body that the border cuts off
BEFORE = -0.5  # excess of an object's colours in a blob over it, up to which the blob occludes it
TAKEN = 0.5  # share of a position covered by another object from which that position is occupied


@dataclass(frozen=True, slots=True)
class ThingPlace:
    """A candidate position of an object.

    Attributes:
        name: Name of the object.
        number: Number of the matching view.
        looks: Appearance there.
        match: Its match.
        score: Score of the match, with the bonus of the position.
        seen: Its visible pixels, where they are known.
    """

    name: str
    number: int
    looks: Appearance
    match: Match
    score: float
    seen: Blob | None = None

    def pixels(self, scene: Scene) -> Blob | None:
        """The pixels that it covers: the visible ones, or all those of the pose; None when out of view."""
        return self.seen or footprint(scene, self.match.pose, self.looks)


def searched(
    scene: Scene,
    track: ThingTrack,
    views: Sequence[tuple[int, ViewModel]],
    changed: NDArray[np.bool_] | None,
    lately: NDArray[np.bool_] | None,
) -> list[ThingPlace]:
    """Places of an object that is not in view, in the whole picture.

    Args:
        scene: The frame.
        track: Its track.
        views: Its taught views, each with its number.
        changed: (h, w) bool, as from `BackgroundMemory`: the parts that may hold it; None for all.
        lately: (h, w) bool, of any size: what has changed recently; None where nothing has.
    """
    if changed is not None and not changed.any():
        return []
    found = [c for k, v in views for c in candidates(scene, v, k, changed)]
    found += lost_places(scene, track, changed)
    if lately is not None and not found:
        found = [c for k, v in views for c in moving_places(scene, v, k, lately)]
    if changed is None:
        return found
    places = [(f, f.pixels(scene)) for f in found]
    return [f for f, place in places if place is not None and holds(changed, place)]


def candidates(
    scene: Scene, view: ViewModel, number: int, where: NDArray[np.bool_] | None = None
) -> list[ThingPlace]:
    """Positions that match an object clearly better than others do.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
        where: (h, w) bool, of any size: parts of the picture that may hold it; None for all.
    """
    it, home = view.appearance, home_of(scene, view)
    unit = home.scale
    poses = [PatchPose(0, 0, unit * s) for s in SIZES] + [PatchPose(0, 0, unit, a) for a in TURNS]
    matches = [verify(scene, it, home), *search(scene, it, poses, where=where)]
    near = 6 * unit
    return [
        ThingPlace(view.name, number, it, m, m.score + AT_HOME * (m.pose.apart(home, 10) < near))
        for m in _outstanding(matches, it)
    ]


def home_of(scene: Scene, view: ViewModel) -> PatchPose:
    """The pose at which an object was taught, in this frame."""
    by = max(scene.size) / max(view.size)
    return PatchPose(view.pose.x * by, view.pose.y * by, view.pose.scale * by)


def moving_places(
    scene: Scene, view: ViewModel, number: int, where: NDArray[np.bool_]
) -> list[ThingPlace]:
    """Recently changed positions that match an object better than anything else that moves.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
        where: (h, w) bool, of any size: recently changed parts.
    """
    it = view.appearance
    unit = view.pose.scale * max(scene.size) / max(view.size)
    poses = [PatchPose(0, 0, unit * s) for s in SIZES] + [PatchPose(0, 0, unit, a) for a in TURNS]
    found = search(scene, it, poses, where=where)
    fine = [m for m in _outstanding(found, it, MOVING_APART) if m.score > MOVING_FAIR]
    if not fine:
        fine = _gathered(scene, it, PatchPose(0, 0, unit), where)
    return [ThingPlace(view.name, number, it, m, m.score) for m in fine]


def body_places(
    scene: Scene, view: ViewModel, number: int, bodies: Sequence[MovingBody]
) -> list[ThingPlace]:
    """Moving bodies that have the colours of an object and about its size.

    A body that moves independently is one object with a known outline. Its colours are therefore sufficient,
    even if the object was taught in another posture, or from another side.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
        bodies: The moving bodies.
    """
    found = (_place_of(scene, view, number, b) for b in bodies)
    return [f for f in found if f is not None]


def _place_of(scene: Scene, view: ViewModel, number: int, body: MovingBody) -> ThingPlace | None:
    it = view.appearance
    unit = view.pose.scale * max(scene.size) / max(view.size)
    size = float(np.sqrt(body.blob.area)) / (2 * it.radius * unit)
    least, most = BODY_SIZES
    if not (BODY_CUT if body.cut else least) < size < most:
        return None
    excess, alike = body_colours(scene, it, body.blob)
    if excess < GATHERED or alike < BODY_ALIKE:
        return None
    left, top, right, bottom = body.blob.window
    pose = PatchPose((left + right - 1) / 2, (top + bottom - 1) / 2, unit)
    share = float(np.sqrt(min(1.0, excess) * alike))
    return ThingPlace(view.name, number, it, Match(pose, share, share), share)


def coloured_places(scene: Scene, view: ViewModel, number: int) -> list[ThingPlace]:
    """The only patch of the picture with an object's colours and about its size, if there is one.

    Args:
        scene: The frame.
        view: The taught view.
        number: Its number.
    """
    it, unit = view.appearance, home_of(scene, view).scale
    return _patch_places(view.name, number, it, only_patch(scene, it, unit))


def has_distinctive_colours(view: ViewModel) -> bool:
    """Whether an object can be located by its colours alone in the picture in which it was taught.

    If not (a black gripper in front of dark furniture), it is not searched by colours alone anywhere else.
    """
    scene = prepare_scene(view.scene, 0.0)
    home = footprint(scene, home_of(scene, view), view.appearance)
    seen = (place.seen for place in coloured_places(scene, view, 0))
    return home is not None and any(b is not None and overlap(b, home) > TAKEN for b in seen)


def lost_places(
    scene: Scene, track: ThingTrack, where: NDArray[np.bool_] | None = None
) -> list[ThingPlace]:
    """Positions that match an object's last appearance.

    Args:
        scene: The frame.
        track: The track of a hidden object.
        where: (h, w) bool, of any size: parts of the picture that may hold it; None for all.
    """
    it, last = track.looks, track.pose
    if it is None or last is None:
        return []
    poses = [PatchPose(0, 0, last.scale * s, last.angle) for s in RECENT_SIZES]
    found = _outstanding(search(scene, it, poses, where=where), it)
    if not found:
        found = _gathered(scene, it, last, where)
    places = [ThingPlace(track.name, track.number, it, m, m.score) for m in found]
    if found or where is None:
        return places
    return _patch_places(track.name, track.number, it, only_patch(scene, it, last.scale, where))


def _patch_places(
    name: str, number: int, it: Appearance, found: FoundPatch | None
) -> list[ThingPlace]:
    if found is None:
        return []
    match = Match(found.pose, found.share, found.share)
    return [ThingPlace(name, number, it, match, found.share, found.blob)]


def _gathered(
    scene: Scene, it: Appearance, last: PatchPose, where: NDArray[np.bool_] | None = None
) -> list[Match]:
    """The position where an object's colours concentrate, if it is unique."""
    (most, pose), (second, _) = colour_peaks(scene, it, last, where)
    if most < GATHERED or second > most / APART:
        return []
    share = min(1.0, most)
    return [Match(pose, share, share)]


def _outstanding(matches: Sequence[Match], it: Appearance, apart: float = APART) -> list[Match]:
    """The matches that are clearly better than those of other positions."""
    if not matches:
        return []
    top = max(matches, key=lambda m: m.score).pose
    away = [m.score for m in matches if m.pose.apart(top, 0) > it.radius * top.scale]
    rival = max([*away, NOISE])
    return [m for m in matches if m.score > SURE or (m.score > FAIR and m.score > apart * rival)]


def assigned(
    scene: Scene, found: Sequence[ThingPlace], taken: Sequence[tuple[Blob, Appearance]]
) -> dict[str, ThingPlace]:
    """Assign positions to objects greedily, by score; an object gets at most one, and none that is taken.

    Args:
        scene: The frame.
        found: Candidates of all searched objects.
        taken: Blobs of objects already located, and their appearances.

    Returns:
        Name of an object -> its position.
    """
    out: dict[str, ThingPlace] = {}
    full = list(taken)
    for it in sorted(found, key=lambda c: -c.score):
        if it.name in out:
            continue
        blob = it.pixels(scene)
        if blob is None or any(_belongs(scene, it, blob, *b) for b in full):
            continue
        out[it.name] = it
        full.append((blob, it.looks))
    return out


def _belongs(
    scene: Scene, place: ThingPlace, blob: Blob, other: Blob, other_looks: Appearance
) -> bool:
    """Whether a position is occupied by another object: it overlaps that object and does not occlude it.

    Args:
        scene: The frame.
        place: The candidate position.
        blob: Pixels of the candidate.
        other: Pixels of the other object.
        other_looks: Appearance of the other object.
    """
    if overlap(blob, other) <= TAKEN:
        return False
    return place.seen is None or body_colours(scene, other_looks, blob)[0] > BEFORE


def footprint(scene: Scene, pose: PatchPose, it: Appearance) -> Blob | None:
    """The pixels that an object at a pose covers; None when out of view."""
    window = window_of(pose, it.shape, scene.size)
    if window is None:
        return None
    return Blob(window, np.greater(paint(it.mask, pose, window), 0.5))
