"""Of several objects that look the same, the one to which more happens is meant, and stays so."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.tasks.casting.test_exclusion import mind_of
from tests.tasks.scripted import belief
from visup.agent import Binding, Mind, Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.rules.presence.object_tracks import TRACKS, PresenceMemory, new_track
from visup.tasks import parse_task
from visup.tasks.casting.equals import Encounter, among_equals, encounter
from visup.tasks.casting.matching import scenery
from visup.tasks.verification.settings import DEFAULT_SETTINGS

TASK = parse_task("<t> ::= <reach>\n<reach> ::= converging(gripper, part)")
SAID = parse_task(
    "actor part is the leftmost part\n<t> ::= <reach>\n<reach> ::= converging(gripper, part)"
)
GRIPPER, ONE, OTHER = 1, 2, 3
BINDINGS = (
    Binding("gripper", ("gripper",), GRIPPER, 0.9),
    Binding("part", ("part",), ONE, 0.9),
)
Holds = Sequence[tuple[str, int, int]]


def scene(holds: Holds, moving: Sequence[int] = (GRIPPER,), like: float = 0.9) -> Mind:
    """A gripper and two parts, and what holds between them."""
    objects = [
        belief(GRIPPER, {"gripper": 0.9}),
        belief(ONE, {"part": 0.9}),
        belief(OTHER, {"part": like}),
    ]
    mind = mind_of(dict.fromkeys(moving, 80.0), *objects)
    relations = (Relation(n, (min(a, b), max(a, b)), Truth.TRUE, 0.0) for n, a, b in holds)
    return replace(mind, relations=tuple(relations))


def part_of(mind: Mind, settled: frozenset[tuple[str, int]] = frozenset()) -> int | None:
    """The object that plays the part."""
    bindings, _ = among_equals(BINDINGS, settled, TASK, mind, DEFAULT_SETTINGS)
    return bindings[1].object_id


@pytest.mark.parametrize(
    ("holds", "part"),
    [
        ([], ONE),
        ([("converging", GRIPPER, ONE), ("converging", GRIPPER, OTHER)], ONE),
        ([("converging", GRIPPER, OTHER)], OTHER),
        ([("diverging", GRIPPER, ONE), ("converging", GRIPPER, OTHER)], OTHER),
        ([("diverging", GRIPPER, ONE)], ONE),
        ([("converging", GRIPPER, ONE), ("in_contact", GRIPPER, OTHER)], OTHER),
        ([("in_contact", GRIPPER, ONE), ("coupled", GRIPPER, OTHER)], ONE),
        ([("converging", GRIPPER, ONE), ("coupled", GRIPPER, OTHER)], OTHER),
    ],
)
def test_the_one_to_which_more_happens_plays_the_part(holds: Holds, part: int) -> None:
    assert part_of(scene(holds)) == part


def test_what_only_rests_beside_another_decides_nothing() -> None:
    assert part_of(scene([("in_contact", GRIPPER, OTHER)], moving=())) == ONE


def test_it_may_move_by_itself() -> None:
    assert part_of(scene([("converging", GRIPPER, OTHER)], moving=(OTHER,))) == OTHER


def test_what_has_been_met_stays() -> None:
    bindings, settled = among_equals(
        BINDINGS, frozenset(), TASK, scene([("in_contact", GRIPPER, ONE)]), DEFAULT_SETTINGS
    )
    assert settled == {("gripper", GRIPPER), ("part", ONE)}
    assert bindings == BINDINGS
    later = scene([("diverging", GRIPPER, ONE), ("coupled", GRIPPER, OTHER)])
    assert part_of(later, settled) == ONE


def test_what_was_met_stays_though_an_equal_object_comes_later() -> None:
    alone = scene([("coupled", GRIPPER, ONE)], like=0.0)
    _, settled = among_equals(BINDINGS, frozenset(), TASK, alone, DEFAULT_SETTINGS)
    assert part_of(scene([("converging", GRIPPER, OTHER)]), settled) == ONE


def test_an_actor_with_another_object_is_no_longer_settled() -> None:
    gone = frozenset({("part", 7)})
    _, settled = among_equals(BINDINGS, gone, TASK, scene([]), DEFAULT_SETTINGS)
    assert not settled


def test_what_looks_less_like_it_is_not_equal() -> None:
    assert part_of(scene([("coupled", GRIPPER, OTHER)], like=0.5)) == ONE


def test_what_the_user_said_of_an_actor_decides() -> None:
    mind = scene([("coupled", GRIPPER, OTHER)])
    found, _ = among_equals(BINDINGS, frozenset(), SAID, mind, DEFAULT_SETTINGS)
    assert found == BINDINGS


def test_the_weightiest_encounter_counts_and_leaving_only_by_itself() -> None:
    mind = scene([("diverging", GRIPPER, ONE), ("coupled", ONE, OTHER)])
    assert encounter(ONE, [GRIPPER], mind) is Encounter.LEFT_BEHIND
    assert encounter(ONE, [GRIPPER, OTHER], mind) is Encounter.HELD
    assert encounter(GRIPPER, [], mind) is Encounter.NOTHING


@pytest.mark.parametrize(
    ("moving", "box", "first_seen", "expected"),
    [
        ((), (100, 100, 20, 20), 5.0, True),  # it is found late, where it lies
        ((), (100, 100, 20, 20), 0.5, True),
        ((OTHER,), (100, 100, 20, 20), 5.0, False),  # somebody brings it
        ((), (0, 100, 20, 20), 5.0, False),  # it has come in
    ],
)
def test_an_equal_object_that_lies_there_is_part_of_the_scene(
    moving: Sequence[int], box: tuple[int, int, int, int], first_seen: float, expected: bool
) -> None:
    mind = scene([], moving)
    other = replace(mind.objects[OTHER], first_seen=first_seen)
    track = replace(new_track(other.region, first_seen), first_box=box)
    mind = mind.with_objects(other).remember(TRACKS, PresenceMemory(0.0, {OTHER: track}))
    assert (OTHER in scenery(mind, BINDINGS)) is expected
