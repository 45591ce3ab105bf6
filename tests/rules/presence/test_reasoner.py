"""Entry, exit, occlusion, reappearance: scripted boxes that come, go, hide and flicker."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.runs import Thought, events_of, reason
from tests.rules.scenes import box_region, seen
from visup.agent import Observation, Presence, Region, ReportState

TOLD = ("entry", "exit", "occlusion", "reappearance", "lost", "found", "coupled", "decoupled")


def events(thoughts: list[Thought]) -> list[tuple[str, int, float]]:
    return events_of(thoughts, TOLD)


def kinds(thoughts: list[Thought]) -> list[tuple[str, int]]:
    return [(k, o) for k, o, _ in events(thoughts)]


def still(i: int, id_: int = 1) -> Region | None:
    return box_region(id_, (200, 150, 100, 80))


def passing(i: int, id_: int = 2) -> Region | None:
    """A big box that comes in at the left at 1 s and leaves at the right, 6 px a frame."""
    return box_region(id_, (-220 + 6 * (i - 25), 100, 200, 200)) if i >= 25 else None


def behind(i: int, id_: int) -> Region | None:
    """What the passing box leaves of the still one."""
    left = -220 + 6 * (i - 25) if i >= 25 else -1000
    right = left + 200
    if right <= 200 or left >= 300:
        return box_region(id_, (200, 150, 100, 80))
    if left > 200:
        return box_region(id_, (200, 150, left - 200, 80))
    if right < 300:
        return box_region(id_, (right, 150, 300 - right, 80))
    return None


def test_what_is_there_at_the_start_enters_soon_and_once() -> None:
    told = events(reason(seen(i, [still(i)]) for i in range(50)))
    assert [(k, o) for k, o, _ in told] == [("entry", 1)]
    assert told[0][2] < 1.0


@pytest.mark.parametrize(
    ("similarity", "since", "at_once"),
    [(0.9, 0, True), (0.7, 0, True), (0.69, 0, False), (0.9, 1, False), (None, 0, False)],
)
def test_only_what_is_known_well_in_the_first_picture_enters_at_once(
    similarity: float | None, since: int, at_once: bool
) -> None:
    names = {1: [("probe", similarity)]} if similarity is not None else {}
    scene = [still(i) if i >= since else None for i in range(50)]
    ((kind, _, entered),) = events(reason(seen(i, [r], names=names) for i, r in enumerate(scene)))
    assert kind == "entry"
    assert (entered == 0.0) == at_once


def test_what_comes_over_the_border_later_enters_soon_after() -> None:
    comes = 3.0
    told = events(
        reason(
            seen(i, [still(i), box_region(2, (-60 + 2 * (i - 75), 300, 60, 60))])
            for i in range(150)
        )
    )
    assert [(k, o) for k, o, _ in told] == [("entry", 1), ("entry", 2)]
    assert comes < told[1][2] < comes + 1.0


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(60, 120), max_size=12, unique=True), st.integers(1, 4))
def test_flicker_gives_no_event(missing: list[int], ghosts: int) -> None:
    """Frames without the object, and short-lived ghosts, in any pattern that leaves two of three."""
    gaps = {m for m in missing if not {m - 1, m - 2} & set(missing)}
    observations = []
    for i in range(150):
        regions = [] if i in gaps else [still(i)]
        if i in gaps:
            regions += [box_region(100 + i * 5 + g, (400, 60 * g, 40, 40)) for g in range(ghosts)]
        observations.append(seen(i, regions))
    assert kinds(reason(observations)) == [("entry", 1)]


def test_leaving_over_the_border_is_an_exit() -> None:
    """3 px a frame to the left; the last pixel goes at frame 100."""
    told = events(reason(seen(i, [box_region(1, (220 - 3 * i, 200, 80, 60))]) for i in range(150)))
    assert [(k, o) for k, o, _ in told] == [("entry", 1), ("exit", 1)]
    assert told[1][2] == pytest.approx(4.0, abs=0.6)


def test_vanishing_in_the_middle_is_neither_exit_nor_occlusion() -> None:
    thoughts = reason(seen(i, [still(i)] if i < 50 else []) for i in range(150))
    assert kinds(thoughts) == [("entry", 1), ("lost", 1)]
    assert thoughts[-1].mind.objects[1].presence is Presence.HIDDEN


def test_an_object_that_stays_at_the_border_is_not_believed_to_leave() -> None:
    """Like an arm that reaches in from above and draws back a little."""
    told = kinds(reason(seen(i, [box_region(1, (300, 0, 60, 300 - 0.5 * i))]) for i in range(250)))
    assert told == [("entry", 1)]


def test_what_comes_over_the_border_in_pieces_enters_when_it_was_first_seen() -> None:
    """A piece at 1 s, and from 1.2 s on the whole of it, four times as large."""

    def at(i: int) -> Observation:
        height = 0 if i < 25 else 20 if i < 30 else 90
        box = box_region(1, (0, 100, 2 * (i - 20), height)) if height else None
        return seen(i, [still(i, 7), box])

    found = [(k, t) for k, o, t in events(reason(at(i) for i in range(25 * 4))) if o == 1]
    assert [k for k, _ in found] == ["entry"]
    assert found[0][1] < 1.45


def test_what_hardly_drifts_and_reaches_far_into_the_image_has_not_left_when_it_is_missed() -> None:
    """Of a long arm at the upper border, whose drift is noise, a big box leaves the upper quarter."""

    def at(i: int) -> Observation:
        right = min(420, 6 * max(0, i - 30))
        shows = 84 if right > 330 else 300
        arm = box_region(1, (300, -0.04 * i, 30, shows)) if not 110 <= i < 122 else None
        if arm is not None:
            arm = replace(arm, velocity=(0.0, -1.5), velocity_sigma=0.7)
        return seen(i, [arm, box_region(2, (right - 420, 84, 420, 380))])

    thoughts = reason(at(i) for i in range(25 * 6))
    assert "exit" not in [k for k, _ in kinds(thoughts)]


@pytest.mark.parametrize("new_id", [False, True])
def test_hidden_by_a_passing_object_and_seen_again_with_the_same_identity(new_id: bool) -> None:
    def regions(i: int) -> list[Region | None]:
        return [behind(i, 7 if new_id and i > 100 else 1), passing(i)]

    thoughts = reason(
        seen(i, regions(i), names={r.id: [(f"m{r.id % 6}", 0.8)] for r in regions(i) if r})
        for i in range(220)
    )
    assert kinds(thoughts) == [
        ("entry", 1),
        ("entry", 2),
        ("occlusion", 1),
        ("reappearance", 1),
        ("exit", 2),
    ]
    times = {k: t for k, _, t in events(thoughts)}
    assert times["occlusion"] == pytest.approx((25 + 300 / 6) / 25, abs=0.5)
    assert times["reappearance"] == pytest.approx((25 + 470 / 6) / 25, abs=0.5)
    assert thoughts[-1].mind.objects[1].name == "m1"
    assert thoughts[-1].mind.objects[1].region.id == (7 if new_id else 1)


def test_a_new_region_id_at_the_same_place_is_the_same_object() -> None:
    thoughts = reason(seen(i, [still(i, 1 if i < 60 else 9)]) for i in range(120))
    assert kinds(thoughts) == [("entry", 1)]
    assert list(thoughts[-1].mind.objects) == [1]


def test_nothing_is_concluded_while_nobody_looks() -> None:
    """The segmenter fails for four seconds; the object is where it was, and no word is said."""
    thoughts = reason(
        seen(i, [still(i)], state=ReportState.FAILED if 50 <= i < 150 else ReportState.RAN)
        for i in range(200)
    )
    assert kinds(thoughts) == [("entry", 1)]
    blind = thoughts[100].mind
    assert "region" in blind.unknown
    assert blind.objects[1].presence is Presence.SEEN
    assert "region" not in thoughts[-1].mind.unknown


def test_a_behaviour_that_rests_is_not_a_failure() -> None:
    thoughts = reason(seen(i, [], state=ReportState.RESTED) for i in range(5))
    assert not thoughts[-1].mind.unknown


def test_the_number_of_remembered_objects_is_bounded() -> None:
    """A new object every second for 80 s, each gone over the border after a while."""

    def at(i: int) -> Observation:
        newest = i // 25
        boxes = [
            box_region(n + 1, (-50 + 8 * (i - 25 * n), 10 + 60 * (n % 7), 50, 50))
            for n in range(max(0, newest - 4), newest + 1)
        ]
        return seen(i, boxes)

    thoughts = reason(at(i) for i in range(0, 25 * 80, 2))
    assert len(thoughts[-1].mind.objects) <= 64
    assert len(thoughts[-1].mind.memory["rules.objects"]) <= 256
    assert kinds(thoughts).count(("entry", 50)) == 1
    assert len(set(kinds(thoughts))) > 75


@pytest.mark.parametrize(
    ("since", "kind", "words"),
    [
        (0.0, "noticed", "in view from the start"),
        (2.2, "noticed", "in view since 2.2 s"),
        (3.9, "entry", "enters"),
        (None, "entry", "enters"),
    ],
)
def test_what_was_in_view_before_it_moved_does_not_enter(
    since: float | None, kind: str, words: str
) -> None:
    def late(i: int) -> Region | None:
        found = box_region(1, (100 + i, 100, 80, 60)) if i >= 100 else None
        return found and replace(found, visible_since=since)

    told = [e for t in reason(seen(i, [late(i)]) for i in range(150)) for e in t.events]
    assert [e.kind for e in told] == [kind]
    assert words in told[0].text
