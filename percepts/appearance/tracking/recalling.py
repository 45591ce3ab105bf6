"""Periodic comparison of a tracked object with its taught views, against drift to another object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from visup.percepts.appearance.looks.blob import Blob, overlap
from visup.percepts.appearance.looks.patches import looks_alike
from visup.percepts.appearance.looks.pose import PatchPose
from visup.percepts.appearance.looks.scene import Scene
from visup.percepts.appearance.looks.thing_model import ViewModel
from visup.percepts.appearance.tracking.detection import search
from visup.percepts.appearance.tracking.finding import SURE, footprint
from visup.percepts.appearance.tracking.following import noted
from visup.percepts.appearance.tracking.track import State, ThingTrack
from visup.percepts.appearance.tracking.verification import Match, verify

MOVING_S, RESTING_S = 0.3, 2.0  # interval of comparisons of a moving and of a resting object
BETTER = 0.15  # score by which another position must match the taught views better
DOUBTFUL = 0.4  # score at rest below which a track that was never proven is dropped
REACH = 2.5  # search radius, in radii of the object
SIZES = (0.8, 1.0, 1.25)


def recalled(
    track: ThingTrack, views: Sequence[ViewModel], scene: Scene, others: Sequence[Blob]
) -> ThingTrack:
    """Reset a track's appearance and pose to a taught view where that matches.

    Args:
        track: The track of an object in view.
        views: All taught views.
        scene: The frame.
        others: Blobs of other objects.
    """
    it, pose = track.looks, track.pose
    wait = MOVING_S if track.state is State.MOVING else RESTING_S
    if it is None or pose is None or scene.time - track.asked < wait - 1e-6:
        return track
    track = replace(track, asked=scene.time)
    known = [
        (k, verify(scene, v.appearance, _as_large(pose, track, views[k], views)))
        for k, v in enumerate(views)
        if v.name == track.name
    ]
    number, best = max(known, key=lambda found: found[1].score)
    near = best.pose.apart(pose, it.radius) < it.radius * pose.scale
    if best.score > SURE and near:
        track = replace(track, proven=True)
        return _as_taught(track, number, best, views, scene) if _strayed(track, best) else track
    number, best = _elsewhere(track, number, best, views, scene)
    taught = views[number].appearance
    blob = footprint(scene, best.pose, taught)
    doubtful = best.score < DOUBTFUL and track.state is State.RESTING and not track.proven
    if doubtful and not _has_colours(track, views, scene):
        # What was tracked resembled the object only while it moved: it is something else.
        return replace(track, state=State.ABSENT, visible=None, rest=None, path=())
    if best.score <= SURE or blob is None or any(overlap(blob, o) > 0.5 for o in others):
        return track
    return replace(_as_taught(track, number, best, views, scene), proven=True)


def _has_colours(track: ThingTrack, views: Sequence[ViewModel], scene: Scene) -> bool:
    """Whether what is seen of a track has the colours of its object, beyond doubt."""
    it = views[track.number].appearance
    return track.visible is not None and looks_alike(scene, it, track.visible)


def _strayed(track: ThingTrack, best: Match) -> bool:
    """Whether an object matches a taught view better than its adapted appearance."""
    return (
        track.state is State.MOVING and best.score > (max(track.peak, 0) * track.explained) ** 0.5
    )


def _elsewhere(
    track: ThingTrack, number: int, here: Match, views: Sequence[ViewModel], scene: Scene
) -> tuple[int, Match]:
    """A position that clearly matches a taught view better: nearby, or anywhere for a track never proven.

    A body that was accepted by its colours alone may be something else, the object being anywhere.
    """
    assert track.pose is not None
    it = views[number].appearance
    size = _as_large(track.pose, track, views[number], views).scale
    taught = views[number].pose.scale * max(scene.size) / max(views[number].size)
    poses = [PatchPose(0, 0, size * s, track.pose.angle) for s in SIZES]
    poses += [PatchPose(0, 0, taught * s) for s in SIZES]
    far = REACH * it.radius * size if track.proven else np.inf
    found = [m for m in search(scene, it, poses) if m.pose.apart(track.pose, 0) < far]
    best = max(found, key=lambda m: m.score, default=here)
    return number, best if best.score > here.score + BETTER else here


def _as_large(
    pose: PatchPose, track: ThingTrack, view: ViewModel, views: Sequence[ViewModel]
) -> PatchPose:
    """A pose of one view converted to another, preserving the object's apparent size."""
    now, then = views[track.number].appearance, view.appearance
    return pose if now is then else pose.resized(now.radius / then.radius)


def _as_taught(
    track: ThingTrack, number: int, match: Match, views: Sequence[ViewModel], scene: Scene
) -> ThingTrack:
    assert track.looks is not None
    taught = views[number].appearance
    out = replace(
        track,
        number=number,
        looks=replace(taught, colours=track.looks.colours),
        peak=match.peak,
        explained=match.explained,
    )
    if match.pose.apart(out.pose or match.pose, taught.radius) < 1.0:
        return out
    return noted(replace(out, state=State.MOVING, rest=None, path=()), scene.time, match.pose)
