"""Periodic comparison of a tracked object with its taught views, against drift to another object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from visup.percepts.appearance.models.appearance_model import ViewModel
from visup.percepts.appearance.models.blob import Blob, overlap_of_smaller
from visup.percepts.appearance.models.colour_patches import has_similar_colours
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.models.scene import Scene
from visup.percepts.appearance.tracking.detection import search_image
from visup.percepts.appearance.tracking.redetection import SURE, footprint
from visup.percepts.appearance.tracking.short_term_tracking import with_observation
from visup.percepts.appearance.tracking.track import TaughtObjectTrack, TrackState
from visup.percepts.appearance.tracking.verification import Match, verify

MOVING_S, RESTING_S = 0.3, 2.0  # interval of comparisons of a moving and of a resting object
SCORE_MARGIN = 0.15  # score by which another position must match the taught views better
DOUBTFUL = 0.4  # score at rest below which a track that was never proven is dropped
REACH = 2.5  # search radius, in radii of the object
SIZES = (0.8, 1.0, 1.25)


def correct_drift(
    track: TaughtObjectTrack, views: Sequence[ViewModel], scene: Scene, others: Sequence[Blob]
) -> TaughtObjectTrack:
    """Reset a track's appearance and pose to a taught view where that matches.

    Args:
        track: The track of an object in view.
        views: All taught views.
        scene: The frame.
        others: Blobs of other objects.
    """
    appearance, pose = track.appearance, track.pose
    interval = MOVING_S if track.state is TrackState.MOVING else RESTING_S
    if appearance is None or pose is None or scene.time - track.compared_at < interval - 1e-6:
        return track
    track = replace(track, compared_at=scene.time)
    matches = [
        (k, verify(scene, v.appearance, _pose_for_view(pose, track, views[k], views)))
        for k, v in enumerate(views)
        if v.name == track.name
    ]
    number, best = max(matches, key=lambda found: found[1].score)
    near = best.pose.apart(pose, appearance.radius) < appearance.radius * pose.scale
    if best.score > SURE and near:
        track = replace(track, confirmed=True)
        return (
            _reset_to_view(track, number, best, views, scene)
            if _has_drifted(track, best)
            else track
        )
    number, best = _better_match(track, number, best, views, scene)
    taught = views[number].appearance
    blob = footprint(scene, best.pose, taught)
    doubtful = best.score < DOUBTFUL and track.state is TrackState.RESTING and not track.confirmed
    if doubtful and not _has_colours(track, views, scene):
        # What was tracked resembled the object only while it moved: it is something else.
        return replace(track, state=TrackState.ABSENT, visible=None, rest=None, path=())
    if best.score <= SURE or blob is None or any(overlap_of_smaller(blob, o) > 0.5 for o in others):
        return track
    return replace(_reset_to_view(track, number, best, views, scene), confirmed=True)


def _has_colours(track: TaughtObjectTrack, views: Sequence[ViewModel], scene: Scene) -> bool:
    """Whether what is seen of a track has the colours of its object, beyond doubt."""
    appearance = views[track.view_number].appearance
    return track.visible is not None and has_similar_colours(scene, appearance, track.visible)


def _has_drifted(track: TaughtObjectTrack, best: Match) -> bool:
    """Whether an object matches a taught view better than its adapted appearance."""
    return (
        track.state is TrackState.MOVING
        and best.score > (max(track.peak, 0) * track.explained_share) ** 0.5
    )


def _better_match(
    track: TaughtObjectTrack, number: int, here: Match, views: Sequence[ViewModel], scene: Scene
) -> tuple[int, Match]:
    """A position that clearly matches a taught view better: nearby, or anywhere for a track never proven.

    A body that was accepted by its colours alone may be something else, the object being anywhere.
    """
    assert track.pose is not None
    appearance = views[number].appearance
    current_scale = _pose_for_view(track.pose, track, views[number], views).scale
    taught_scale = views[number].pose.scale * max(scene.size) / max(views[number].size)
    poses = [PatchPose(0, 0, current_scale * s, track.pose.angle) for s in SIZES]
    poses += [PatchPose(0, 0, taught_scale * s) for s in SIZES]
    radius = REACH * appearance.radius * current_scale if track.confirmed else np.inf
    found = [
        m for m in search_image(scene, appearance, poses) if m.pose.apart(track.pose, 0) < radius
    ]
    best = max(found, key=lambda m: m.score, default=here)
    return number, best if best.score > here.score + SCORE_MARGIN else here


def _pose_for_view(
    pose: PatchPose, track: TaughtObjectTrack, view: ViewModel, views: Sequence[ViewModel]
) -> PatchPose:
    """A pose of one view converted to another, preserving the object's apparent size."""
    current, other = views[track.view_number].appearance, view.appearance
    return pose if current is other else pose.resized(current.radius / other.radius)


def _reset_to_view(
    track: TaughtObjectTrack, number: int, match: Match, views: Sequence[ViewModel], scene: Scene
) -> TaughtObjectTrack:
    assert track.appearance is not None
    taught = views[number].appearance
    out = replace(
        track,
        view_number=number,
        appearance=replace(taught, colours=track.appearance.colours),
        peak=match.peak,
        explained_share=match.explained_share,
    )
    if match.pose.apart(out.pose or match.pose, taught.radius) < 1.0:
        return out
    return with_observation(
        replace(out, state=TrackState.MOVING, rest=None, path=()), scene.time, match.pose
    )
