"""Foreground objects: superpixels believed to move, assigned to objects with persistent ids.

The belief says what moves, tracks say what moves separately. A cell goes to the track that owns it, else to
the object that owned the place it comes from, else to the nearest connected object; connected cells near
none are a candidate, which becomes an object once it is believed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.fast_replace import replace
from visup.percepts.motion.features._superpixels_jit import connected_groups
from visup.percepts.motion.features.superpixels import Superpixels
from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground.belief import Belief
from visup.percepts.motion.foreground.cues import NAMES, FrameCues
from visup.percepts.motion.tracks.id_allocator import IdAllocator

Keys = NDArray[np.int64]
MOVING_BELIEF = 0.5  # belief from which a cell is part of an object
CARRIED_SHARE = 0.4
"""Share of a cell carried from an object from which the cell remains that object's."""
OWNED_SHARE = 0.5  # share of a new track owned by an object from which the track is that object's
REPORT_BELIEF = 0.75
"""Least mean belief to report an object: on unknown footage two of three are ghosts at 0.6 to 0.7, one of ten
at 0.8 to 0.9, with and without a track."""
KEEP_BELIEF = 0.7  # the same for one reported before (hysteresis)
OWN_BELIEF = 0.5  # least mean belief by its own cues to report one that never had a track
WHOLE_SHARE = 0.9  # share of an object's moving cells in a track from which the track is the object
TRACK_BELIEF = 0.5  # mean belief in the cells of such a track
MIN_PX = 0.25  # least residual motion, pixels per frame: twice the sampling error
RESIDUAL = NAMES.index("residual")
NEWEST_WEIGHT = 0.4  # weight of the newest frame in a running mean
CONNECTED_STEPS = 12  # steps from cell to cell over which cells connect to an object
MISSED_S = 0.5  # an unobserved object is deleted after this many seconds


@dataclass(frozen=True, slots=True)
class MovingObject:
    """One object of the foreground.

    Attributes:
        key: Internal key, from 1.
        id: Public number; 0 for a candidate.
        track: Public id of its track, observed or not; 0 when there is none.
        last_seen: Seconds.
        existence: Running mean of the belief in its superpixels; 0 before it was observed.
        existence_alone: The same from the cues of superpixels alone.
        had_track: Whether it ever had a track.
        was_reported: Whether it was ever believed enough to be reported.
    """

    key: int
    id: int
    track: int
    last_seen: float
    existence: float = 0.0
    existence_alone: float = 0.0
    had_track: bool = False
    was_reported: bool = False

    @property
    def is_reportable(self) -> bool:
        """Whether to report it.

        Context may sustain an object but not begin one: otherwise anything that resembles a mover and lies
        where one was believed would confirm itself for ever.
        """
        if self.was_reported:
            return self.existence >= KEEP_BELIEF
        supported = self.had_track or self.existence_alone >= OWN_BELIEF
        return supported and self.existence >= REPORT_BELIEF


@dataclass(frozen=True, slots=True, eq=False)
class ForegroundObjects:
    """The objects after a frame.

    Attributes:
        owner: (count,) int64, key of the object that has each superpixel, or 0.
        share: (count,) float32, probability that each superpixel belongs to an object.
        known: The objects by key.
        last_key: The greatest key given so far.
    """

    owner: Keys
    share: Floats
    known: Mapping[int, MovingObject]
    last_key: int

    def reported(self, now: float) -> list[MovingObject]:
        """Objects with a public id that exist and were observed at `now`, seconds, sorted by id."""
        known = [o for o in self.known.values() if o.id and o.is_reportable]
        seen = [o for o in known if o.last_seen == now]
        return sorted(seen, key=lambda o: o.id)

    def id_of_track(self, track: int) -> int:
        """The public id of the object a track belongs to; the track's own where there is none."""
        owners = (o.id for o in self.known.values() if track > 0 and o.track == track)
        return next(owners, track)


def initial_objects() -> ForegroundObjects:
    """The objects before the first frame."""
    return ForegroundObjects(
        np.zeros(0, np.int64), np.zeros(0, np.float32), MappingProxyType({}), 0
    )


@dataclass(frozen=True, slots=True, eq=False)
class TrackCells:
    """The reported tracks, and the cells of those observed in a frame.

    Attributes:
        seen: Public ids of the K observed tracks.
        alive: Public ids of all live tracks, hidden ones too.
        winner: (count,) int64, index from 1 among those observed of the track that owns each cell, or 0.
        share: (count,) float32, probability of that track; 0 where there is none.
    """

    seen: Sequence[int]
    alive: Collection[int]
    winner: Keys
    share: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ReportingConditions:
    """Conditions for reporting an object.

    Attributes:
        least: Its least area, working pixels.
        ids: Allocator of public ids.
        is_standing: Whether cells, (count,) bool, move as an object at rest on the ground there would:
            without a track those are not reported.
        alone: Whether objects without a track may be reported at all.
    """

    least: float
    ids: IdAllocator
    is_standing: Callable[[NDArray[np.bool_]], bool]
    alone: bool


def update_objects(
    before: ForegroundObjects,
    cues: FrameCues,
    belief: Belief,
    tracks: TrackCells,
    now: float,
    conditions: ReportingConditions,
) -> ForegroundObjects:
    """The objects of a frame.

    Args:
        before: The objects after the previous frame, whose cells are those that `cues` come from.
        cues: The cues of the frame.
        belief: The belief in its superpixels.
        tracks: The reported tracks that are observed.
        now: Seconds.
        conditions: Conditions on objects.
    """
    moves = belief.share > MOVING_BELIEF
    previous = _previous_owner(before, cues)
    known, last_key = _with_tracks(before, tracks, previous, cues.area)
    key_of = {o.track: o.key for o in known.values() if o.track}
    own = np.array([0, *(key_of[i] for i in tracks.seen)], dtype=np.int64)[tracks.winner]
    owner = np.where(moves, np.where(own > 0, own, previous), 0)
    owner = _spread_ownership(owner, moves, cues)
    owner, fresh = _candidates(owner, moves, cues, conditions.least, last_key)
    last_key += len(fresh)
    known |= {k: MovingObject(k, 0, 0, now) for k in fresh}
    objects = ForegroundObjects(owner, belief.share, known, last_key)
    # Residual motion within the sampling error supports no object.
    moved = cues.values[:, RESIDUAL] > math.log(0.1 + MIN_PX)
    belief = replace(belief, alone=belief.alone * moved)
    return _with_track_cells(
        _observed(objects, belief, cues.area, now, conditions), tracks, cues.area
    )


def object_share(objects: ForegroundObjects, key: int) -> Floats:
    """(count,) float32: probability that each superpixel is the object's; below a half where it is not."""
    mine = objects.owner == key
    taken = (objects.owner > 0) & ~mine
    rest = np.where(taken, 0, np.minimum(objects.share, 0.49))
    return np.where(mine, objects.share, rest).astype(np.float32)


def object_velocity(
    objects: ForegroundObjects, key: int, flow: Floats, cells: Superpixels, seconds: float
) -> tuple[float, float, float]:
    """Median velocity of an object's cells and its standard error, (vx, vy, sigma), pixels per second.

    Args:
        objects: The objects after the frame.
        key: Which of them.
        flow: (h, w, 2) float32, from the newest image back to the previous one.
        cells: The superpixels.
        seconds: Between the two.
    """
    x, y = cells.centre[objects.owner == key].astype(np.int64).T
    moved = -flow[y, x] / max(seconds, 1e-6)
    middle = np.median(moved, axis=0)
    off = float(np.median(np.abs(moved - middle))) / np.sqrt(max(len(moved), 1))
    return float(middle[0]), float(middle[1]), 1.5 * off + 0.1


def _with_track_cells(
    objects: ForegroundObjects, tracks: TrackCells, area: Floats
) -> ForegroundObjects:
    """The objects, with all cells of a track that covers the whole object.

    A track outlines a rigid object better than single cells do. Of an articulated one it follows a part only:
    then many moving cells lie outside it.
    """
    owner, share = objects.owner.copy(), objects.share.copy()
    key_of = {o.track: o.key for o in objects.known.values() if o.track}
    for place, track in enumerate(tracks.seen, 1):
        key = key_of[track]
        of_object, of_track = owner == key, tracks.winner == place
        moving_area = area[of_object].sum()
        if not moving_area or area[of_object & of_track].sum() < WHOLE_SHARE * moving_area:
            continue
        if area[of_track] @ objects.share[of_track] < TRACK_BELIEF * area[of_track].sum():
            continue
        share[of_track] = np.maximum(share[of_track], tracks.share[of_track])
        owner[of_track & (owner == 0)] = key
    return replace(objects, owner=owner, share=share)


def _previous_owner(before: ForegroundObjects, cues: FrameCues) -> Keys:
    """(count,) the previous object that most of each cell comes from, or 0."""
    keys = np.unique(before.owner[before.owner > 0])
    count = len(cues.area)
    if not len(keys) or not len(cues.here):
        return np.zeros(count, np.int64)
    shares = cues.carried((before.owner[:, None] == keys).astype(np.float32))
    return np.where(shares.max(axis=1) > CARRIED_SHARE, keys[shares.argmax(axis=1)], 0)


def _with_tracks(
    before: ForegroundObjects, tracks: TrackCells, previous: Keys, area: Floats
) -> tuple[dict[int, MovingObject], int]:
    """The objects with new tracks assigned: to a trackless object that owned most of the cells, or new."""
    known = {
        k: o if o.track in tracks.alive else replace(o, track=0) for k, o in before.known.items()
    }
    last_key = before.last_key
    followed = {o.track for o in known.values()}
    for place, track in enumerate(tracks.seen, 1):
        if track in followed:
            continue
        mine = tracks.winner == place
        o = known.get(_main_owner(previous[mine], area[mine]))
        if o is None or o.track:
            last_key += 1
            o = MovingObject(last_key, track, 0, -math.inf)
        known[o.key] = replace(o, id=o.id or track, track=track, had_track=True)
    return known, last_key


def _main_owner(previous: Keys, area: Floats) -> int:
    """The object that owned most of the cells, or 0."""
    if not len(previous):
        return 0
    sums = np.bincount(previous, area)
    most = int(sums[1:].argmax()) + 1 if len(sums) > 1 else 0
    return most if most and sums[most] > OWNED_SHARE * area.sum() else 0


def _spread_ownership(owner: Keys, moves: NDArray[np.bool_], cues: FrameCues) -> Keys:
    """Owners after moving cells without one took that of the nearest connected object."""
    rows = np.repeat(np.arange(len(owner)), np.diff(cues.ends))
    columns = cues.neighbours
    inside = moves[rows] & moves[columns]
    rows, columns, weight = rows[inside], columns[inside], cues.affinity[inside]
    # The strongest link is written last, so that it wins.
    order = np.argsort(weight, kind="stable")
    rows, columns = rows[order], columns[order]
    for _ in range(CONNECTED_STEPS):
        gives = (owner[rows] == 0) & (owner[columns] > 0)
        if not gives.any():
            break
        owner = owner.copy()
        owner[rows[gives]] = owner[columns[gives]]
    return owner


def _candidates(
    owner: Keys,
    moves: NDArray[np.bool_],
    cues: FrameCues,
    least: float,
    last_key: int,
) -> tuple[Keys, list[int]]:
    """Owners, with a new key for each large enough group of unowned moving cells, and those keys."""
    unowned = moves & (owner == 0)
    free = np.flatnonzero(unowned)
    if not len(free):
        return owner, []
    number, groups = connected_groups(cues.ends, cues.neighbours, unowned)
    group = number[free]
    area = np.bincount(group, cues.area[free], groups)
    good = area >= least
    keys = np.where(good, last_key + np.cumsum(good), 0)
    out = owner.copy()
    out[free] = keys[group]
    return out, [int(k) for k in keys[good]]


def _with_belief(o: MovingObject, belief: float, alone: float, now: float) -> MovingObject:
    """An object after a frame in which its cells have these mean beliefs, in all and by their own cues."""
    weight = NEWEST_WEIGHT if o.existence else 1.0
    return replace(
        o,
        last_seen=now,
        existence=o.existence + weight * (belief - o.existence),
        existence_alone=o.existence_alone + weight * (alone - o.existence_alone),
    )


def _observed(
    objects: ForegroundObjects,
    belief: Belief,
    area: Floats,
    now: float,
    conditions: ReportingConditions,
) -> ForegroundObjects:
    """The objects updated from the frame: believed candidates confirmed, missing ones deleted."""
    pixels = np.bincount(objects.owner, area, objects.last_key + 1)
    beliefs, alone = (
        np.bincount(objects.owner, area * share, objects.last_key + 1)
        for share in (belief.share, belief.alone)
    )
    known = {}
    for k, o in objects.known.items():
        if pixels[k] < conditions.least:
            if o.track or now - o.last_seen <= (MISSED_S if o.id else 0):
                known[k] = o
            continue
        o = _with_belief(o, float(beliefs[k] / pixels[k]), float(alone[k] / pixels[k]), now)
        if conditions.alone and not o.id and o.is_reportable:
            stands = conditions.is_standing(objects.owner == k)
            o = o if stands else replace(o, id=conditions.ids.new())
        known[k] = replace(o, was_reported=o.was_reported or bool(o.id and o.is_reportable))
    held = np.zeros(objects.last_key + 1, dtype=bool)
    held[list(known)] = True
    owner = np.where(held[objects.owner], objects.owner, 0)
    return ForegroundObjects(owner, objects.share, MappingProxyType(known), objects.last_key)
