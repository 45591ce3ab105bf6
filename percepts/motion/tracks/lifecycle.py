"""The lifecycle of tracks: initiation, update, confirmation, deletion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.layers.dense_labelling import CLIP, Labelling
from visup.percepts.motion.layers.layer_discovery import affine_rate, discover_layers
from visup.percepts.motion.tracks._track_points_jit import drop_explained
from visup.percepts.motion.tracks.id_allocator import IdAllocator
from visup.percepts.motion.tracks.measurements import (
    BaselineMotion,
    FrameMeasurements,
    min_region_area,
    part_motions,
)
from visup.percepts.motion.tracks.merge_split import NEAR_STEPS, merged
from visup.percepts.motion.tracks.salience import (
    has_absorbed_background,
    has_left_its_place,
    is_salient,
)
from visup.percepts.motion.tracks.track import PartMotion, Track, Tracks, new_track
from visup.percepts.motion.tracks.track_fitting import moves_like
from visup.percepts.motion.tracks.track_update import update_track

LIKELY = 60.0  # log likelihood ratio at which a track that has lasted is confirmed
SURE = 200.0  # the same for a track that has just appeared
BEHIND = 0.3  # share of a cell from which an object is expected there behind another
FAR = 16.0  # squared Mahalanobis distance beyond which a motion does not explain a point
SLIVER = 3.5  # ratio of length to width beyond which a thin track is no object


def initiate(
    tracks: Tracks, scene: FrameMeasurements, settings: MotionSettings, last_key: int
) -> Tracks:
    """Add tracks for groups of constraints that no layer explains.

    Args:
        tracks: The known tracks.
        scene: The frame.
        settings: Its `max_regions` bounds the number of tracks.
        last_key: The greatest key allocated so far.

    Returns:
        The known tracks, then the new ones.
    """
    out = list(tracks)
    owned = scene.owner > 0
    for m in scene.measured:
        c = m.constraints
        free = _unexplained(m, out, scene, owned)
        for model, index in discover_layers(c, free, scene.image.shape, settings.cell):
            if len(out) >= settings.max_regions:
                return tuple(out)
            share = np.zeros(scene.cells.count, dtype=np.float32)
            share[scene.cell_of(c)[index]] = 1
            share = scene.cells.dilated(share[:, None] > 0, 1)[:, 0] * 0.7 * ~owned
            last_key += 1
            rate = affine_rate(model, c, scene.time)
            motion = PartMotion().with_rate(c.lag, rate, float(len(index)))
            t = new_track(last_key, scene.time, share, motion, c.xy[index].mean(axis=0))
            host = _former_owner(out, share > 0, motion, scene)
            if host is None:
                out.append(t)
            else:
                out[host] = merged(out[host], t)
            owned = owned | (share > 0)
    return tuple(out)


def _former_owner(
    tracks: Sequence[Track], where: NDArray[np.bool_], motion: PartMotion, scene: FrameMeasurements
) -> int | None:
    """The track hidden in most of these cells, or else recently present in most of them."""
    if not where.any():
        return None
    for i, t in enumerate(tracks):
        if (
            t.id
            and t.occluded is not None
            and (scene.cells.mean(t.occluded)[where] > BEHIND).mean() > 0.5
            and moves_like(motion, t)
        ):
            return i
    for i, t in enumerate(tracks):
        if not t.id or t.recent_share is None:
            continue
        # A region emerging from behind an object is not a part of it.
        others = [
            o.predicted_share > BEHIND
            for o in tracks
            if o is not t and o.occluded is not None and o.predicted_share is not None
        ]
        free = where & ~np.any(others, axis=0) if others else where
        most = np.count_nonzero(free) > 0.5 * np.count_nonzero(where)
        if most and np.mean(t.recent_share[free] > 0.3) > 0.5:
            return i if moves_like(motion, t) else _uncovered(tracks, i, where, motion, scene)
    return None


def _uncovered(
    tracks: Sequence[Track],
    host: int,
    where: NDArray[np.bool_],
    motion: PartMotion,
    scene: FrameMeasurements,
) -> int | None:
    """Owner of a part that turned up where a track was: the track, unless another moves like the part.

    A region uncovered by an occluder moves like the hidden object and adjoins the rest of it.
    """
    near = scene.cells.dilated(where[:, None], NEAR_STEPS)[:, 0]
    best, most = host, 0
    for i, t in enumerate(tracks):
        if i != host and t.id and t.predicted_share is not None and moves_like(motion, t):
            there = int(
                np.count_nonzero(near & ((t.predicted_share > BEHIND) | (t.share > BEHIND)))
            )
            if there > most:
                best, most = i, there
    return best


def _unexplained(
    m: BaselineMotion, tracks: Sequence[Track], scene: FrameMeasurements, owned: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    c = m.constraints
    at = scene.cell_of(c)
    out = np.asarray(~owned[at] & (m.background.distances(c) > FAR))
    if tracks and out.any():
        members = np.stack([t.share for t in tracks], axis=1) > 0.3
        near = scene.cells.dilated(members, NEAR_STEPS)[at]
        points = c.xy, c.moved, c.information
        drop_explained(out, points, near, part_motions(scene, tracks, c), FAR)
    return out


def update_tracks(
    tracks: Tracks,
    scene: FrameMeasurements,
    labelling: Labelling,
    likelihood: Floats,
    settings: MotionSettings,
) -> Tracks:
    """Update each track's shape and evidence from the posterior.

    Args:
        tracks: K tracks, predicted.
        scene: The frame.
        labelling: Labels of its superpixels.
        likelihood: (N, K + 2) float32, log likelihood of the labels at the points.
        settings: Settings, for the least area of a region.
    """
    least = 0.3 * min_region_area(scene, settings)
    at = labelling.winner[scene.at]
    gain = np.clip(likelihood[np.arange(len(at)), at] - likelihood[:, 0], -CLIP, CLIP)
    gains = np.bincount(at, gain, len(tracks) + 1).tolist()
    out = []
    for k, t in enumerate(tracks, 1):
        t = replace(t, evidence=min(0.98 * t.evidence + gains[k], 2000.0))
        out.append(update_track(t, k, labelling, scene.cells, scene.time, least))
    return tuple(out)


def delete(tracks: Tracks, scene: FrameMeasurements, settings: MotionSettings) -> Tracks:
    """Drop lost candidates, tracks hidden for too long, and tracks that became background."""
    out = []
    for t in tracks:
        gone = scene.time - t.last_seen
        if t.id == 0:
            keep = gone <= 0.2 and t.evidence > -20
        else:
            keep = gone <= (settings.memory_s if t.occluded is not None else 0.5)
            # As certainly background as it had to be an object to be reported.
            keep = keep and t.evidence > -LIKELY and not has_absorbed_background(t, scene)
        if keep:
            out.append(t)
    keys = {t.key for t in out}
    return tuple(_without_deleted_keys(t, keys) for t in out)


def _without_deleted_keys(t: Track, keys: set[int]) -> Track:
    """A track without the pairwise statistics of deleted tracks, whose keys are never reused."""
    if t.separate_s.keys() <= keys and t.merge_votes.keys() <= keys:
        return t

    def known(values: Mapping[int, float]) -> Mapping[int, float]:
        return MappingProxyType({k: v for k, v in values.items() if k in keys})

    return replace(t, separate_s=known(t.separate_s), merge_votes=known(t.merge_votes))


def _is_thin(t: Track, scene: FrameMeasurements) -> bool:
    """Whether a track has no interior cell; such a track needs more evidence to be reported."""
    rest = t.share <= 0.5
    return bool(scene.cells.dilated(rest[:, None], 1)[:, 0].all())


def _is_sliver(t: Track, scene: FrameMeasurements) -> bool:
    """Whether a thin track is a long strip.

    Such strips arise where two backgrounds meet, and along a straight edge, which shows one component of
    motion only; truly thin objects are sacrificed for that.
    """
    mine = t.share > 0.5
    if not mine.any():
        return False
    spread = np.cov(scene.cells.centre[mine].T, aweights=scene.cells.area[mine], ddof=0)
    long, short = np.sqrt(np.maximum(np.linalg.eigvalsh(np.atleast_2d(spread))[::-1], 1.0))
    return bool(long > SLIVER * short)


@dataclass(frozen=True, slots=True)
class ConfirmContext:
    """How clearly tracks must move to be reported.

    Attributes:
        sought: Which tracks lie where cogitation asked to look: half as much will do for those.
        in_place: Whether the camera shakes in place: nothing at rest can seem to move then, so what has left
            its place need not last.
    """

    sought: Sequence[bool]
    in_place: bool


def confirm(
    tracks: Tracks,
    scene: FrameMeasurements,
    ids: IdAllocator,
    settings: MotionSettings,
    asked: ConfirmContext,
) -> Tracks:
    """Give public ids to tracks that have lasted and clearly move.

    Args:
        tracks: All tracks.
        scene: The frame.
        ids: Allocator of public ids.
        settings: Its `confirm_s` is how long a track must last.
        asked: How clearly each must move.
    """
    out = []
    for t, wanted in zip(tracks, asked.sought, strict=True):
        need = 0.5 if wanted else 1.0
        if (
            not t.id
            and t.last_seen == scene.time
            and _is_confirmed(t, scene, settings, need, in_place=asked.in_place)
        ):
            t = replace(t, id=ids.new())
        out.append(t)
    return tuple(out)


def _is_confirmed(
    t: Track, scene: FrameMeasurements, settings: MotionSettings, need: float, *, in_place: bool
) -> bool:
    """Whether to report a track: at once when its motion is clear, else once it has lasted."""
    thin = _is_thin(t, scene)
    if t.frames < 2 or t.evidence < need * (2 if thin else 1) * LIKELY:
        return False
    if thin and _is_sliver(t, scene):
        return False
    if t.evidence > need * SURE and is_salient(t, scene, at_once=True, need=need):
        return True
    lasts = t.frames >= 3 and scene.time - t.initiated >= need * settings.confirm_s
    far = in_place and t.evidence > need * SURE and has_left_its_place(t, scene)
    return (lasts or far) and is_salient(t, scene, need=need)
