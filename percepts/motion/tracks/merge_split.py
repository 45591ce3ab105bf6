"""Merging and splitting of tracks: parts are absorbed, pieces joined, occluded tracks released."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features._superpixels_jit import connected_groups
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.layers._affine_jit import quantile
from visup.percepts.motion.layers.affine import Affine, distances, fit_affine
from visup.percepts.motion.layers.layer_discovery import (
    affine_rate,
    layer_slack,
    median_motion,
    same_motion,
)
from visup.percepts.motion.tracks.measurements import (
    BaselineMotion,
    FrameMeasurements,
    min_region_area,
)
from visup.percepts.motion.tracks.salience import LITTLE_BORDER, border_share
from visup.percepts.motion.tracks.track import Indices, PartMotion, Track, Tracks, new_track
from visup.percepts.motion.tracks.track_fitting import moves_like

NEAR_STEPS = 4  # cells between tracks that touch
APART_S = 1.5
MERGE_VOTES = 3.0
MAX_PARTS = 3
LIMB_SHARE = 0.5  # largest limb, as a share of its object's area
SURROUNDED_SHARE = 0.75
"""Share of a track's surroundings that one other covers when it is a part of that."""
CONTACT = 5.0  # affinity of two flat cells of one tone


def assign_unknown(
    tracks: Tracks,
    scene: FrameMeasurements,
    winner: Indices,
    settings: MotionSettings,
    last_key: int,
) -> Tracks:
    """Assign cells that move as no layer does to the track they touch, or make new tracks of them.

    Limbs, wheels and shadows join their object; isolated parts are new objects.
    """
    unknown = winner == len(tracks) + 1
    if not unknown.any():
        return tracks
    out, link = list(tracks), scene.cells.link
    number, count = connected_groups(link.indptr, link.indices, unknown)
    for i in range(count):
        part = number == i
        ring = scene.cells.dilated(part[:, None], 1)[:, 0] & ~part
        # The expected owner comes first, then the neighbour.
        k = _majority(scene.owner[part], len(tracks), 0.3)
        k = _majority(winner[ring], len(tracks), 0.25) if k is None else k
        size = scene.cells.area[part].sum()
        if k is not None:
            share = np.where(part, 1, out[k].share).astype(np.float32)
            out[k] = replace(out[k], share=share)
        elif size > min_region_area(scene, settings):
            t = _unknown_track(part, scene, last_key + 1)
            if t is not None and len(out) < settings.max_regions:
                last_key += 1
                out.append(t)
    return tuple(out)


def _is_ground(part: NDArray[np.bool_], host: NDArray[np.bool_], scene: FrameMeasurements) -> bool:
    """Whether a part is too large and covers too much of the image border for a limb of its host."""
    area = scene.cells.area
    return bool(
        area[part].sum() > LIMB_SHARE * area[host].sum()
        and border_share(part.astype(np.float32), scene.cells) > LITTLE_BORDER
    )


def _majority(labels: Indices, count: int, share: float) -> int | None:
    """The track, from 0, with the most of these labels, if more than a share of them."""
    if not count or not len(labels):
        return None
    numbers = np.bincount(labels, minlength=count + 2)[1 : count + 1]
    k = int(numbers.argmax())
    return k if numbers[k] > share * len(labels) else None


def _unknown_track(part: NDArray[np.bool_], scene: FrameMeasurements, key: int) -> Track | None:
    """A new track for cells that move as no layer does; None when there are too few constraints."""
    c = scene.measured[0].constraints
    inside = np.flatnonzero(part[scene.cell_of(c)])
    if len(inside) < 6:
        return None
    weight = np.zeros(len(c), dtype=np.float32)
    weight[inside] = 1
    start = median_motion(c, inside)
    fit = fit_affine(c, weight, start, slack=layer_slack(start))
    motion = PartMotion().with_rate(c.lag, affine_rate(fit, c, scene.time), float(len(inside)))
    centre = scene.cells.centre[part].mean(axis=0)
    return new_track(key, scene.time, part, motion, centre, evidence=10.0)


def split_occluded(tracks: Tracks, scene: FrameMeasurements, winner: Indices) -> Tracks:
    """Return to a hidden track those cells of its occluder that move as the hidden one did.

    The occluder has moved on: where points move as the track did when it was last in view, and not as the
    occluder does, the track is in view again.
    """
    out = list(tracks)
    for j, t in enumerate(tracks):
        if not t.id or not t.mostly_occluded or t.occluded is None:
            continue
        there = scene.cells.mean(t.occluded) > 0.5
        for label in np.unique(winner[there]).tolist():
            k, claimed = label - 1, there & (winner == label)
            if 0 <= k < len(tracks) and k != j and _moves_as(t, tracks[k], claimed, scene):
                out[j] = replace(
                    out[j], share=np.where(claimed, 1, out[j].share).astype(np.float32)
                )
                remaining = tuple(m for m in out[k].motions if not moves_like(m, t))
                out[k] = replace(
                    out[k],
                    share=np.where(claimed, 0, out[k].share).astype(np.float32),
                    motions=remaining or out[k].motions[:1],
                )
    return tuple(out)


def _moves_as(
    hidden: Track, occluder: Track, where: NDArray[np.bool_], scene: FrameMeasurements
) -> bool:
    """Whether points in some cells move as a hidden track did, and not as its occluder."""
    m = scene.measured[-1]
    c = m.constraints
    inside = where[scene.cell_of(c)]
    rate = occluder.best_rate()
    if np.count_nonzero(inside) < 6 or rate is None or c.span_s > 0.7:
        return False
    own, other = np.zeros((2, 3)), np.zeros((2, 3))
    own[:, 2] = np.asarray(hidden.unoccluded_velocity) * c.span_s
    other[:, 2] = np.asarray(occluder.unoccluded_velocity) * c.span_s
    if np.hypot(*(own[:, 2] - other[:, 2])) < 1.0:
        return False
    to_own = np.median(distances(Affine(own), c, 0.3)[inside])
    to_other = np.median(distances(Affine(other), c, 0.3)[inside])
    return bool(to_own < 6 and to_other > 16)


def merge_tracks(
    tracks: Tracks, scene: FrameMeasurements, winner: Indices, settings: MotionSettings
) -> Tracks:
    """Merge tracks that were never observed apart and repeatedly move as one.

    Two objects that came together stay two, however rigidly coupled: they have been observed apart. Pieces
    of one object, initiated side by side, become one.
    """
    if len(tracks) < 2:
        return tracks
    members = winner[:, None] == np.arange(1, len(tracks) + 1)
    ring = scene.cells.dilated(members, 1) & ~members
    near = scene.cells.dilated(members | ring, NEAR_STEPS - 1)
    touch = (near.astype(np.float32).T @ members.astype(np.float32)) > 0
    around = ring.astype(np.float32).T @ members.astype(np.float32)
    inside = around > SURROUNDED_SHARE * ring.sum(axis=0)[:, None]
    grown = _without_edge_between(scene, winner, len(tracks))
    seen = members.any(axis=0)
    touch = (touch | touch.T) & seen & seen[:, None]
    out = _with_separation_time(tracks, (seen & seen[:, None]) & ~touch, scene.seconds)
    for j in range(len(tracks) - 1, 0, -1):
        for i in np.flatnonzero(touch[:j, j]):
            a, b = out[i], out[j]
            apart = a.separate_s.get(b.key, 0.0)
            if apart > APART_S or not _may_merge(a, b, members[:, i], members[:, j], scene):
                continue
            votes = a.merge_votes.get(b.key, 0.0)
            # A track mostly surrounded by the other is a part of it.
            if grown[i, j] or inside[i, j] or inside[j, i]:
                votes += 1.0
            else:
                votes += _vote(scene, a, members[:, i], members[:, j])
            votes = max(votes, -MERGE_VOTES)
            out[i] = replace(a, merge_votes=_with(a.merge_votes, b.key, votes))
            if votes >= MERGE_VOTES:
                out[i] = merged(out[i], b)
                out[j] = replace(b, id=-1)
                break
    return tuple(t for t in out if t.id >= 0)


def _may_merge(
    a: Track, b: Track, in_a: NDArray[np.bool_], in_b: NDArray[np.bool_], scene: FrameMeasurements
) -> bool:
    """Whether neither is the ground on which the other moves; a reported track is no ground.

    A track that goes behind another is finally surrounded by it, without being a part of it.
    """
    if bool(a.id) == bool(b.id):
        return not (a.id and (a.mostly_occluded or b.mostly_occluded))
    reported, other = (in_a, in_b) if a.id else (in_b, in_a)
    return not _is_ground(other, reported, scene)


def _with(values: Mapping[int, float], key: int, value: float) -> Mapping[int, float]:
    return MappingProxyType({**values, key: value})


def _with_separation_time(tracks: Tracks, apart: NDArray[np.bool_], seconds: float) -> list[Track]:
    """The tracks, with the time for which each was observed apart from later ones."""
    out = []
    for i, t in enumerate(tracks):
        others = [tracks[j].key for j in np.flatnonzero(apart[i]) if j > i]
        longer = {key: t.separate_s.get(key, 0.0) + seconds for key in others}
        out.append(
            replace(t, separate_s=MappingProxyType({**t.separate_s, **longer})) if longer else t
        )
    return out


def _vote(
    scene: FrameMeasurements,
    a: Track,
    in_a: NDArray[np.bool_],
    in_b: NDArray[np.bool_],
) -> float:
    votes = 0.0
    for m in scene.measured:
        c = m.constraints
        if c.lag == 1 and len(scene.measured) > 1:
            continue
        at = scene.cell_of(c)
        mine, other = in_a[at], in_b[at]
        if not (_moves(m, mine) and _moves(m, other)):
            continue
        start = scene.parts(a, c)[0]
        same = same_motion(c, mine, other, start, layer_slack(start, a.centre))
        votes += 0.0 if same is None else (1.0 if same else -1.0)
    return votes


def _without_edge_between(
    scene: FrameMeasurements, winner: Indices, count: int
) -> NDArray[np.bool_]:
    """(count, count): whether no image edge separates two tracks where they touch, as in an arm."""
    link = scene.cells.link
    strong = np.flatnonzero(link.data > CONTACT)
    a = winner[np.searchsorted(link.indptr, strong, side="right") - 1] - 1
    b = winner[link.indices[strong]] - 1
    both = (a >= 0) & (b >= 0) & (a < count) & (b < count)
    out = np.zeros((count, count), dtype=bool)
    out[a[both], b[both]] = True
    return out


def _moves(m: BaselineMotion, which: NDArray[np.bool_]) -> bool:
    """Whether these constraints show motion against the background."""
    if np.count_nonzero(which) < 4:
        return False
    return quantile(m.background.distances(m.constraints)[which], 0.7) > 9


def merged(a: Track, b: Track) -> Track:
    """Merge two tracks.

    Args:
        a: The track that survives, under the older of their public ids.
        b: The track that becomes a part of it.

    Returns:
        The first with the cells and motions of both.
    """
    ids = [i for i in (a.id, b.id) if i]
    apart = {
        k: max(a.separate_s.get(k, 0.0), b.separate_s.get(k, 0.0))
        for k in {*a.separate_s, *b.separate_s}
    }
    return replace(
        a,
        id=min(ids) if ids else 0,
        initiated=min(a.initiated, b.initiated),
        share=np.clip(a.share + b.share, 0, 1),
        motions=_parts(a.motions + b.motions),
        evidence=a.evidence + b.evidence,
        frames=max(a.frames, b.frames),
        separate_s=MappingProxyType(apart),
    )


def _parts(motions: tuple[PartMotion, ...]) -> tuple[PartMotion, ...]:
    """The best supported motions, few enough not to explain everything."""
    keep = sorted(range(len(motions)), key=lambda i: -motions[i].support)[:MAX_PARTS]
    return tuple(motions[i] for i in sorted(keep))
