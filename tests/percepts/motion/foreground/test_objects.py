"""Objects keep their ids, tracks keep apart, what flickers is none."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from visup.percepts.motion.foreground.belief import Belief
from visup.percepts.motion.foreground.cues import BINS, NAMES, FrameCues
from visup.percepts.motion.foreground.objects import (
    REPORT_BELIEF,
    ForegroundObjects,
    ReportingConditions,
    TrackCells,
    initial_objects,
    object_share,
    update_objects,
)
from visup.percepts.motion.tracks.id_allocator import IdAllocator

COUNT = 40  # cells in a row, each linked to the next
STEP = 1 / 25


def row(shift: int = 0, residual: float = 0.0) -> FrameCues:
    """Cells in a row, whose contents came from `shift` cells to the left; all cues are `residual`."""
    ones = np.ones(COUNT - 1, np.float32)
    link = sparse.diags([ones, ones], [-1, 1], format="csr")
    here = np.arange(max(shift, 0), COUNT + min(shift, 0), dtype=np.int32)
    return FrameCues(
        np.full((COUNT, len(NAMES)), residual, np.float32),
        np.full(COUNT, 64, np.float32),
        np.zeros(COUNT, np.int64),
        link.indptr,
        link.indices,
        link.data,
        here,
        (here - shift).astype(np.int32),
        np.ones(COUNT, np.float32),
        np.zeros(COUNT, np.int32),
    )


def share(*parts: slice) -> NDArray[np.float32]:
    out = np.full(COUNT, 0.1, np.float32)
    for part in parts:
        out[part] = 0.95
    return out


def tracks(**cells: slice) -> TrackCells:
    """Tracks with public ids 7, 8, ... as t7, t8, ..., and the cells where they prevail."""
    winner = np.zeros(COUNT, np.int64)
    for place, part in enumerate(cells.values(), 1):
        winner[part] = place
    ids = [int(k[1:]) for k in cells]
    return TrackCells(ids, ids, winner, np.where(winner > 0, 0.9, 0).astype(np.float32))


class Row:
    """Frame after frame."""

    def __init__(self) -> None:
        self.objects: ForegroundObjects = initial_objects()
        self.ids = IdAllocator()
        self.frame = 0
        self.ids.reserve(100)
        self.stands = False
        self.alone = True

    def step(
        self,
        believed: NDArray[np.float32],
        seen: TrackCells | None = None,
        shift: int = 0,
        alone: NDArray[np.float32] | None = None,
        residual: float = 0.0,
    ) -> dict[int, list[int]]:
        """Public id -> cells."""
        self.frame += 1
        now = self.frame * STEP
        cues = row(shift, residual)
        none = np.zeros(BINS**3)
        belief = Belief(believed, believed if alone is None else alone, none, none)
        admission = ReportingConditions(64.0 * 3, self.ids, lambda cells: self.stands, self.alone)
        self.objects = update_objects(self.objects, cues, belief, seen or tracks(), now, admission)
        return {
            o.id: np.flatnonzero(self.objects.owner == o.key).tolist()
            for o in self.objects.reported(now)
        }


def test_what_is_believed_is_an_object_at_once_and_keeps_its_id_as_it_moves() -> None:
    world = Row()
    found = [world.step(share(slice(5 + n, 12 + n)), shift=1) for n in range(8)]
    assert all(found)
    ids = {i for f in found for i in f}
    assert len(ids) == 1
    assert found[-1] == {ids.pop(): list(range(12, 19))}


def at_most(belief: float, believed: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.minimum(believed, np.float32(belief))


def test_what_is_doubtful_or_small_is_none() -> None:
    world = Row()
    for n in range(10):
        part = slice(5, 12) if n % 2 else slice(25, 32)
        assert world.step(at_most(REPORT_BELIEF - 0.01, share(part))) == {}
    assert all(world.step(share(slice(20, 22))) == {} for _ in range(10))


def test_an_object_is_believed_by_the_mean_of_its_past() -> None:
    world = Row()
    sure, doubtful = share(slice(5, 15)), at_most(0.6, share(slice(5, 15)))
    for _ in range(20):
        world.step(doubtful)
    assert world.step(sure) == {}, "one sure frame does not outweigh many doubtful ones"
    for _ in range(20):
        found = world.step(sure)
    assert world.step(doubtful) == found, "nor one doubtful frame many sure ones"
    assert {} in [world.step(doubtful) for _ in range(10)]


def test_what_only_its_past_and_its_looks_speak_for_is_none() -> None:
    world = Row()
    assert all(world.step(share(slice(5, 15)), alone=share()) == {} for _ in range(20))
    for _ in range(20):
        found = world.step(share(slice(5, 15)))
    assert found
    assert world.step(share(slice(5, 15)), tracks(t7=slice(5, 15)), alone=share()) == found


def test_what_goes_nowhere_begins_no_object() -> None:
    world = Row()
    assert all(world.step(share(slice(5, 15)), residual=-2.0) == {} for _ in range(20))


def test_the_id_of_a_track_is_that_of_its_object() -> None:
    world = Row()
    for _ in range(3):
        found = world.step(share(slice(5, 15)))
    world.step(share(slice(5, 15)), tracks(t7=slice(5, 15)))
    assert world.objects.id_of_track(7) == next(iter(found))
    assert world.objects.id_of_track(9) == 9


def test_a_track_gives_its_id_at_once_and_its_whole_body_belongs_to_it() -> None:
    world = Row()
    found = world.step(share(slice(5, 15)), tracks(t7=slice(8, 11)))
    assert found == {7: list(range(5, 15))}


def test_an_object_that_a_track_comes_to_follow_keeps_its_id() -> None:
    world = Row()
    for _ in range(4):
        before = world.step(share(slice(5, 15)))
    after = world.step(share(slice(5, 15)), tracks(t7=slice(6, 12)))
    assert after == before


def test_two_tracks_side_by_side_stay_apart() -> None:
    world = Row()
    for _ in range(5):
        found = world.step(share(slice(5, 21)), tracks(t7=slice(5, 13), t8=slice(13, 21)))
    assert found == {7: list(range(5, 13)), 8: list(range(13, 21))}


def test_what_is_not_believed_to_move_is_not_reported_whoever_tracks_it() -> None:
    world = Row()
    assert world.step(share(), tracks(t7=slice(5, 15))) == {}


def test_a_track_that_was_not_seen_for_a_moment_comes_back_as_the_same() -> None:
    world = Row()
    for _ in range(13):
        first = world.step(share(slice(5, 15)))
    world.step(share(slice(5, 15)), tracks(t7=slice(5, 15)))
    hidden = TrackCells([], [7], np.zeros(COUNT, np.int64), np.zeros(COUNT, np.float32))
    for _ in range(60):
        assert world.step(share(), hidden) == {}
    assert world.step(share(slice(5, 15)), tracks(t7=slice(5, 15))) == first


def test_what_stands_there_is_told_only_where_a_track_is_sure_of_it() -> None:
    world = Row()
    world.stands = True
    assert all(world.step(share(slice(5, 15))) == {} for _ in range(20))
    assert world.step(share(slice(5, 15)), tracks(t7=slice(5, 15))) == {7: list(range(5, 15))}


def test_what_no_track_follows_takes_no_id_where_it_may_not_be_told() -> None:
    world = Row()
    world.alone = False
    assert all(world.step(share(slice(5, 15))) == {} for _ in range(20))
    world.alone = True
    assert list(world.step(share(slice(5, 15)))) == [world.ids.new() - 1]


def test_a_track_that_is_the_whole_gives_its_outline_and_a_part_does_not() -> None:
    for believed, outline in (((5, 12), range(5, 15)), ((2, 15), range(2, 15))):
        world = Row()
        found = world.step(share(slice(*believed)), tracks(t7=slice(5, 15)))
        assert found == {7: list(outline)}


def test_what_was_told_does_not_flicker() -> None:
    world = Row()
    sure, less = share(slice(5, 15)), share()
    less[5:15] = 0.72
    assert world.step(less, tracks(t7=slice(5, 15))) == {}
    for _ in range(5):
        world.step(sure, tracks(t7=slice(5, 15)))
    assert all(world.step(less, tracks(t7=slice(5, 15))) for _ in range(20))


def test_the_share_of_an_object_is_at_most_a_half_elsewhere() -> None:
    world = Row()
    believed = share(slice(5, 21))
    world.step(believed, tracks(t7=slice(5, 13), t8=slice(13, 21)))
    for key in world.objects.known:
        mine = object_share(world.objects, key)
        assert ((mine > 0.5) == (world.objects.owner == key)).all()
