"""Looking for things that are not in view: which of the places that look alike are theirs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.percepts.appearance.looks.pose import PatchPose, paint, window_of
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import Appearance, ViewModel
from visup.percepts.appearance.tracking.detection import colour_peaks, search
from visup.percepts.appearance.tracking.track import Blob, ThingTrack
from visup.percepts.appearance.tracking.verification import Match, verify

SURE = 0.6  # score that no other thing is seen to reach
FAIR, APART = 0.42, 1.5  # score that will do where no other place has a share of it
GATHERED = 0.45  # how much more of its colours a place must have than what is around
NOISE = 0.15  # score that any place may have
MOVING_FAIR, MOVING_APART = 0.45, 1.2  # the same among places that have changed of late
AT_HOME = 0.1  # how much the place where a thing was taught speaks for it
RECENT_SIZES = (0.85, 1.0, 1.18)
SIZES = (0.75, 0.87, 1.0, 1.15, 1.32)
TURNS = (-0.4, 0.4)
TAKEN = 0.5  # share of a place that is another thing's


@dataclass(frozen=True, slots=True)
class ThingPlace:
    """A place where a thing may be.

    Attributes:
        name: Of the thing.
        number: Of the view that it looks like.
        looks: What it looks like there.
        match: How it agrees.
        score: With what speaks for the place.
    """

    name: str
    number: int
    looks: Appearance
    match: Match
    score: float


def candidates(scene: Scene, view: ViewModel, number: int) -> list[ThingPlace]:
    """Places that look like a thing, and not only a little more so than others do.

    Args:
        scene: The frame.
        view: What the thing looked like when it was taught.
        number: Of the view.
    """
    it, home = view.appearance, home_of(scene, view)
    unit = home.scale
    poses = [PatchPose(0, 0, unit * s) for s in SIZES] + [PatchPose(0, 0, unit, a) for a in TURNS]
    matches = [verify(scene, it, home), *search(scene, it, poses)]
    near = 6 * unit
    return [
        ThingPlace(view.name, number, it, m, m.score + AT_HOME * (m.pose.apart(home, 10) < near))
        for m in _outstanding(matches, it)
    ]


def home_of(scene: Scene, view: ViewModel) -> PatchPose:
    """Where a thing was when it was taught, in the frame."""
    by = max(scene.size) / max(view.size)
    return PatchPose(view.pose.x * by, view.pose.y * by, view.pose.scale * by)


def moving_places(
    scene: Scene, view: ViewModel, number: int, where: NDArray[np.bool_]
) -> list[ThingPlace]:
    """Places that have changed of late and look like a thing: more so than all else that moves.

    Args:
        scene: The frame.
        view: What the thing looked like when it was taught.
        number: Of the view.
        where: (h, w) bool, of any size: what has changed of late.
    """
    it = view.appearance
    unit = view.pose.scale * max(scene.size) / max(view.size)
    poses = [PatchPose(0, 0, unit * s) for s in SIZES] + [PatchPose(0, 0, unit, a) for a in TURNS]
    found = search(scene, it, poses, where=where)
    fine = [m for m in _outstanding(found, it, MOVING_APART) if m.score > MOVING_FAIR]
    if not fine:
        fine = _gathered(scene, it, PatchPose(0, 0, unit), where)
    return [ThingPlace(view.name, number, it, m, m.score) for m in fine]


def lost_places(scene: Scene, track: ThingTrack) -> list[ThingPlace]:
    """Places that look like a thing did when it was last seen.

    Args:
        scene: The frame.
        track: A thing that is hidden.
    """
    it, last = track.looks, track.pose
    if it is None or last is None:
        return []
    poses = [PatchPose(0, 0, last.scale * s, last.angle) for s in RECENT_SIZES]
    found = _outstanding(search(scene, it, poses), it)
    if not found:
        found = _gathered(scene, it, last)
    return [ThingPlace(track.name, track.number, it, m, m.score) for m in found]


def _gathered(
    scene: Scene, it: Appearance, last: PatchPose, where: NDArray[np.bool_] | None = None
) -> list[Match]:
    """The one place where a thing's colours are gathered, if there is just one."""
    (most, pose), (second, _) = colour_peaks(scene, it, last, where)
    if most < GATHERED or second > most / APART:
        return []
    share = min(1.0, most)
    return [Match(pose, share, share)]


def _outstanding(matches: Sequence[Match], it: Appearance, apart: float = APART) -> list[Match]:
    """Those that look like a thing, and not only a little more so than other places do."""
    if not matches:
        return []
    top = max(matches, key=lambda m: m.score).pose
    away = [m.score for m in matches if m.pose.apart(top, 0) > it.radius * top.scale]
    rival = max([*away, NOISE])
    return [m for m in matches if m.score > SURE or (m.score > FAIR and m.score > apart * rival)]


def assigned(
    scene: Scene, found: Sequence[ThingPlace], taken: Sequence[Blob]
) -> dict[str, ThingPlace]:
    """The best place for each thing, no two things in one.

    Args:
        scene: The frame.
        found: Candidates for all things that are looked for.
        taken: Where things are already.
    """
    out: dict[str, ThingPlace] = {}
    full = list(taken)
    for it in sorted(found, key=lambda c: -c.score):
        if it.name in out:
            continue
        blob = footprint(scene, it.match.pose, it.looks)
        if blob is None or any(overlap(blob, b) > TAKEN for b in full):
            continue
        out[it.name] = it
        full.append(blob)
    return out


def footprint(scene: Scene, pose: PatchPose, it: Appearance) -> Blob | None:
    """The pixels that a thing at a pose covers; None when it is out of view."""
    window = window_of(pose, it.shape, scene.size)
    if window is None:
        return None
    return Blob(window, np.greater(paint(it.mask, pose, window), 0.5))


def overlap(a: Blob, b: Blob) -> float:
    """What two blobs share, of the smaller."""
    left, top = max(a.window[0], b.window[0]), max(a.window[1], b.window[1])
    right, bottom = min(a.window[2], b.window[2]), min(a.window[3], b.window[3])
    if right <= left or bottom <= top:
        return 0.0
    both = [
        o.mask[top - o.window[1] : bottom - o.window[1], left - o.window[0] : right - o.window[0]]
        for o in (a, b)
    ]
    return float(np.count_nonzero(both[0] & both[1]) / max(min(a.area, b.area), 1))
