"""Numbers of boxes: each thing keeps its own, whatever the order in which boxes come."""

from __future__ import annotations

import itertools
import json
import random
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.percepts.detections.box_tracker import MAX_MISSED_FRAMES, MIN_OVERLAP, MultiBoxTracker
from visup.percepts.detections.boxes import Box, Detection, intersection_over_union

BOXES = st.tuples(st.floats(0, 80), st.floats(0, 80), st.floats(5, 40), st.floats(5, 40))
NAMES = st.sampled_from([None, "cup", "hand"])
FRAMES = st.lists(st.lists(st.tuples(BOXES, NAMES), max_size=4), max_size=6)


def found(boxes: list[tuple[Box, str | None]]) -> list[Detection]:
    return [Detection(0, box, 1.0, name) for box, name in boxes]


@given(FRAMES)
def test_no_two_boxes_of_a_frame_share_a_number_and_a_number_keeps_its_name(
    frames: list[list[tuple[Box, str | None]]],
) -> None:
    numbering = MultiBoxTracker()
    names: dict[int, str | None] = {}
    for index, boxes in enumerate(frames):
        given_ = found(boxes)
        numbered = numbering.number(index, given_)
        assert [(d.box, d.name) for d in numbered] == boxes
        tracks = [d.track for d in numbered]
        assert len(set(tracks)) == len(tracks)
        assert all(t >= 1 for t in tracks)
        assert all(names.setdefault(d.track, d.name) == d.name for d in numbered)


@given(FRAMES, st.randoms(use_true_random=False))
def test_a_state_that_was_saved_goes_on_as_the_one_that_was_not(
    frames: list[list[tuple[Box, str | None]]], chance: random.Random
) -> None:
    one, other = MultiBoxTracker(), MultiBoxTracker()
    for index, boxes in enumerate(frames):
        if chance.random() < 0.5:
            state = json.loads(json.dumps(other.save()))
            other = MultiBoxTracker()
            other.load(state)
        assert one.number(index, found(boxes)) == other.number(index, found(boxes))


@given(st.lists(BOXES, min_size=1, max_size=4), st.lists(BOXES, min_size=1, max_size=4))
def test_numbers_go_on_so_that_boxes_overlap_the_most_in_all(
    before: list[Box], now: list[Box]
) -> None:
    numbering = MultiBoxTracker()
    numbering.number(0, found([(b, None) for b in before]))
    kept = numbering.number(1, found([(b, None) for b in now]))

    def shared(i: int, j: int) -> float:
        both = intersection_over_union(before[i], now[j])
        return both if both >= MIN_OVERLAP else 0.0

    best = max(
        sum(shared(i, j) for i, j in enumerate(order) if j is not None)
        for order in itertools.permutations([*range(len(now)), *[None] * len(before)], len(before))
    )
    pairs = [(d.track - 1, j) for j, d in enumerate(kept) if 1 <= d.track <= len(before)]
    assert sum(shared(i, j) for i, j in pairs) == pytest.approx(best)


def walker(frames: int, scores: Sequence[float]) -> list[list[Detection]]:
    """Boxes of one thing that goes on at a pixel a frame, with scores in turn; none where one is 0."""
    return [
        [Detection(0, (20.0 + k, 10.0, 10.0, 24.0), s)] if (s := scores[k % len(scores)]) else []
        for k in range(frames)
    ]


@pytest.mark.parametrize(
    ("scores", "told"),
    [
        ([0.9], True),
        ([0.6], True),  # believed when it comes again
        ([0.6, 0.3, 0.3], True),  # what was believed goes on as unsure boxes
        ([0.6, 0.0, 0.0, 0.0], False),  # and is given up while nothing comes again
        ([0.3], False),  # begins nothing
    ],
)
def test_what_is_told_of_a_thing_follows_from_scores_and_from_its_coming_again(
    scores: list[float], told: bool
) -> None:
    numbering = MultiBoxTracker()
    numbered = [numbering.number(k, boxes) for k, boxes in enumerate(walker(6, scores))]
    assert {d.track for boxes in numbered for d in boxes} == ({1} if told else set())


def test_what_was_told_goes_before_what_was_not() -> None:
    numbering = MultiBoxTracker()
    first = Detection(0, (20.0, 10.0, 10.0, 24.0), 0.9)
    assert [d.track for d in numbering.number(0, [first])] == [1]
    unsure = Detection(0, (24.0, 10.0, 10.0, 24.0), 0.4)  # begins a thing that is not believed yet
    assert [d.track for d in numbering.number(1, [first, unsure])] == [1]
    nearer_the_second = Detection(0, (23.0, 10.0, 10.0, 24.0), 0.9)
    assert [d.track for d in numbering.number(2, [nearer_the_second])] == [1]


def test_a_sure_box_goes_before_a_nearer_one_that_is_unsure() -> None:
    numbering = MultiBoxTracker()
    numbering.number(0, [Detection(0, (20.0, 10.0, 10.0, 24.0), 0.9)])
    near = Detection(0, (20.0, 10.0, 10.0, 24.0), 0.2)
    sure = Detection(0, (23.0, 10.0, 10.0, 24.0), 0.8)
    assert numbering.number(1, [near, sure]) == (replace(sure, track=1),)


def test_who_passes_behind_another_keeps_its_number_by_how_it_moves() -> None:
    numbering = MultiBoxTracker()
    for k in range(30):
        boxes: list[tuple[Box, str | None]] = [((50.0, 20.0, 10.0, 20.0), None)]
        if not 13 <= k <= 17:  # hidden for a moment
            boxes.append(((4.0 * k - 10, 22.0, 12.0, 20.0), None))
        numbered = numbering.number(k, found(boxes))
        assert [d.track for d in numbered] == [1, 2][: len(boxes)]


def test_who_was_away_for_long_is_somebody_new() -> None:
    numbering = MultiBoxTracker()
    box: list[tuple[Box, str | None]] = [((5.0, 5.0, 10.0, 10.0), "cup")]
    assert numbering.number(0, found(box))[0].track == 1
    assert numbering.number(MAX_MISSED_FRAMES + 1, found(box))[0].track == 1
    assert numbering.number(2 * MAX_MISSED_FRAMES + 3, found(box))[0].track == 2


def test_numbers_of_a_tracker_are_kept() -> None:
    boxes = [Detection(7, (0.0, 0.0, 9.0, 9.0)), Detection(3, (1.0, 0.0, 9.0, 9.0))]
    assert list(MultiBoxTracker().number(0, boxes)) == boxes
