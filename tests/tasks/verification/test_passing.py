"""Carried bodies touch where they slow down or are let go of; others where they slow down."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from tests.rules.runs import reason
from tests.rules.scenes import box_region, seen
from visup.agent import Coupling, Mind, ObjectBelief, Observation, Presence, Region, Relation, Truth
from visup.agent.model.fast_replace import replace
from visup.rules.coupling.contact import OutlineContact
from visup.rules.coupling.evidence import COUPLING, CouplingEvidence
from visup.rules.presence.lifecycle import occlude
from visup.rules.presence.object_tracks import ObjectTrack, came_to
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.verification.observation import ActionObservation
from visup.tasks.verification.observe import RelationLookup, observe
from visup.tasks.verification.passing import (
    goes_past,
    moves_on,
    put_down,
    stopped_at,
    vanished_into,
    went_past,
    went_round,
)

GRIPPER, PART, TARGET = 1, 2, 3


def scene(held: bool, gap: float, contact: OutlineContact, passing_by: Truth) -> Any:
    """A mind in which the outlines of part and target meet, with a gap between gripper and part."""
    measured = SimpleNamespace(pair=lambda quantity, a, b: gap)
    return SimpleNamespace(
        couplings=(Coupling((GRIPPER, PART), 0.0),) if held else (),
        frame_size=(640, 480),
        objects={i: SimpleNamespace(region=SimpleNamespace(area=1600.0)) for i in (PART, TARGET)},
        truth=lambda name, *objects: passing_by,
        recall=lambda key: (
            {(PART, TARGET): SimpleNamespace(contact=contact)}
            if key is COUPLING
            else SimpleNamespace(measured=measured)
        ),
    )


ON = OutlineContact(0.0, passing=True, motion_known=True)
FAR = OutlineContact(0.0, passing=True, motion_known=True, path=50.0)
SLOW = OutlineContact(0.0, passing=False, motion_known=True)
UNKNOWN = OutlineContact(0.0)
BEFORE = OutlineContact(0.0, passing=False, motion_known=True, in_front=True)


@pytest.mark.parametrize(
    ("held", "gap", "contact", "passing_by", "past"),
    [
        (True, 0.0, ON, Truth.FALSE, True),  # carried on
        (True, 0.0, UNKNOWN, Truth.FALSE, True),  # just met
        (True, 0.0, SLOW, Truth.FALSE, False),  # slowed down
        (True, 20.0, ON, Truth.TRUE, False),  # let go of, and falling onto it
        (True, 20.0, FAR, Truth.TRUE, True),  # let go of, and falling past it
        (True, float("nan"), ON, Truth.FALSE, True),  # a gap that is not known is none
        (False, 0.0, ON, Truth.FALSE, False),  # nobody holds it: by how far it has passed alone
        (False, 0.0, ON, Truth.TRUE, True),
        (True, 0.0, BEFORE, Truth.FALSE, True),  # set down in front of it
        (False, 0.0, BEFORE, Truth.FALSE, True),  # and let go of
    ],
)
def test_outlines_that_meet_while_passing(
    held: bool, gap: float, contact: OutlineContact, passing_by: Truth, past: bool
) -> None:
    mind = scene(held, gap, contact, passing_by)
    assert goes_past(mind, (PART, TARGET), lambda _: False) is past
    assert goes_past(mind, (TARGET, PART), lambda _: False) is past


def mind_after(place: Callable[[float], tuple[float, float]], until: float) -> Mind:
    """The mind after a small body has moved beside a large one at rest."""
    large = box_region(TARGET, (300, 200, 120, 90))
    return reason(
        seen(i, [large, box_region(PART, (*place(i / 25), 40, 40))])
        for i in range(round(25 * until))
    )[-1].mind


@pytest.mark.parametrize(
    ("since", "past"),
    [(2.5, True), (0.5, False)],  # while it passed, and long before the path that is remembered
)
def test_a_body_that_went_past_recedes_from_then_on(since: float, past: bool) -> None:
    mind = mind_after(lambda t: (80 + 110 * t, 120), 3.2)
    assert went_past(mind, Relation("diverging", (PART, TARGET), Truth.TRUE, since)) is past


def test_a_body_without_known_path_has_not_gone_past() -> None:
    mind = Mind(frame_size=(640, 480))
    assert not went_past(mind, Relation("diverging", (PART, TARGET), Truth.TRUE, 0.0))


@pytest.mark.parametrize(
    ("place", "round_it"),
    [
        (lambda t: (240 - 4 * min(t, 3), 120 + 50 * min(t, 3)), True),  # along it, and stops
        (lambda t: (255 - 50 * min(t, 3), 220 + 4 * min(t, 3)), False),  # away from it
        (lambda t: (255, 220), False),  # it has gone nowhere: nothing is known
    ],
)
def test_going_round_still_counts_after_the_body_has_stopped(
    place: Callable[[float], tuple[float, float]], round_it: bool
) -> None:
    mind = mind_after(place, 3.2)
    for objects in ((PART, TARGET), (TARGET, PART)):
        trend = Relation("diverging", objects, Truth.TRUE, 2.0)
        assert went_round(mind, trend) is round_it


@pytest.mark.parametrize(("falls", "put"), [(False, True), (True, False)])
def test_a_resting_part_was_put_down_and_a_falling_one_was_not(falls: bool, put: bool) -> None:
    def at(i: int) -> Observation:
        t = i / 25
        carried = 100 + 60 * min(t, 2.0)
        leaves = 150 * max(0.0, t - 4.0)
        falling = 200 * min(max(0.0, t - 4.0), 0.5) if falls else 0.0
        part = box_region(PART, (carried, 240 + falling, 60, 50))
        return seen(i, [box_region(GRIPPER, (carried, 180 - leaves, 60, 60)), part])

    thoughts = reason(at(i) for i in range(125))
    assert any(t.mind.couplings for t in thoughts)
    assert any(put_down(t.mind, (PART, TARGET)) for t in thoughts) is put
    # It still is when the two have been decoupled.
    parted = [t.mind for t in thoughts if t.mind.time > 4.0 and not t.mind.couplings]
    assert any(put_down(mind, (PART, TARGET)) for mind in parted) is put


@pytest.mark.parametrize(("coupled", "against"), [(True, False), (False, True)])
def test_coupled_bodies_move_together_though_their_outlines_drift(
    coupled: bool, against: bool
) -> None:
    """A cart is hauled, and its outline creeps nearer to that of the tug."""
    pair = (GRIPPER, PART)
    facts = [("converging", Truth.TRUE), ("coupled", Truth.TRUE if coupled else Truth.FALSE)]
    told = tuple(Relation(name, pair, truth, 1.0) for name, truth in facts)
    seen = observe(ACTIONS["moving_together"], pair, RelationLookup(Mind(time=2.0, relations=told)))
    assert (seen.contrary is not None) is against


@pytest.mark.parametrize(
    ("decoupled_at", "true", "left"),
    [
        (1.5, "", True),
        (None, "", False),  # it was never held
        (1.5, "touching", False),  # it has been put down where the gripper still is
        (1.5, "coupled", False),  # it is held again
        (1.5, "moving_together", False),
    ],
)
def test_separated_bodies_are_not_carried(
    decoupled_at: float | None, true: str, left: bool
) -> None:
    pair = (GRIPPER, PART)
    names = ("touching", "coupled", "moving_together", "diverging")
    told = tuple(Relation(n, pair, Truth.TRUE if n == true else Truth.FALSE, 1.0) for n in names)
    mind = Mind(time=2.0, relations=told)
    mind = mind.remember(COUPLING, {pair: CouplingEvidence(decoupled_at=decoupled_at)})
    contrary = observe(ACTIONS["moving_together"], pair, RelationLookup(mind)).contrary
    assert (contrary.since if contrary else None) == (decoupled_at if left else None)
    assert observe(ACTIONS["converging"], pair, RelationLookup(mind)).contrary is None


def test_a_resting_body_does_not_go_past() -> None:
    assert not goes_past(scene(False, 0.0, ON, Truth.TRUE), (PART, TARGET), lambda _: True)


@pytest.mark.parametrize(
    ("contact", "on"),
    [
        (OutlineContact(0.0, passing=True, motion_known=True), True),
        (OutlineContact(0.0), True),
        (OutlineContact(0.0, motion_known=True), True),  # it has slowed down this moment
        (OutlineContact(0.0, confirmed_since=1.0, motion_known=True), False),
    ],
)
def test_a_contact_stage_begins_when_a_body_has_slowed_down(
    contact: OutlineContact, on: bool
) -> None:
    assert moves_on(scene(False, 0.0, contact, Truth.FALSE), (PART, TARGET)) is on
    assert not moves_on(scene(True, 0.0, contact, Truth.FALSE), (PART, TARGET))


@pytest.mark.parametrize(
    ("contact", "since"),
    [
        (OutlineContact(1.0, changed_at=2.5, motion_known=True), 2.5),
        (OutlineContact(1.0, changed_at=2.5, passing=True, motion_known=True), -math.inf),
    ],
)
def test_a_contact_counts_from_the_end_of_passing(contact: OutlineContact, since: float) -> None:
    assert stopped_at(scene(False, 0.0, contact, Truth.FALSE), (PART, TARGET)) == since
    assert stopped_at(scene(False, 0.0, contact, Truth.FALSE), (GRIPPER, TARGET)) == -math.inf


def test_nobody_moves_on_if_the_contact_is_unknown() -> None:
    mind = scene(False, 0.0, ON, Truth.FALSE)
    assert not moves_on(mind, (GRIPPER, TARGET))


def test_a_passing_contact_neither_holds_nor_begins_a_stage() -> None:
    contact = Relation("touching", (PART, TARGET), Truth.TRUE, 1.0)
    seen = ActionObservation(
        holds=Truth.TRUE, held_by=contact, helps=contact, entry=contact, observed=True
    )
    assert seen.settled is seen
    passing = replace(seen, moves_on=True).settled
    assert passing.holds is Truth.UNKNOWN
    assert (passing.held_by, passing.helps, passing.entry) == (None, None, None)
    assert passing.observed


def falling(index: int, *, down: float) -> list[Region | None]:
    """A small body that falls behind the upper edge of a large one; or rests, and is covered from above."""
    covered = 0.0 if down else 4.0 * min(max(index - 40, 0), 10)
    top = 60.0 + down * min(index, 50) if down else 155.0 + covered
    shown = min(40.0, 200.0 - top) if down else 40.0 - covered
    return [
        box_region(TARGET, (280, 200, 160, 120)),
        box_region(PART, (340, top, 40, shown)) if shown > 3 else None,
    ]


@pytest.mark.parametrize(("down", "into"), [(2.9, True), (0.0, False)])
def test_a_body_hidden_by_its_goal_has_vanished_into_it(down: float, into: bool) -> None:
    thoughts = reason(seen(i, falling(i, down=down)) for i in range(100))
    mind = thoughts[-1].mind
    assert mind.objects[PART].presence is Presence.HIDDEN
    for pair in ((PART, TARGET), (TARGET, PART)):
        assert (vanished_into(mind, pair) is not None) is into
        # An invariant does not take it for a contact.
        assert RelationLookup(mind).find("touching", pair).truth is not Truth.TRUE
    assert vanished_into(mind, (PART,)) is None
    back = reason(seen(i, falling(min(i, 110 - i), down=down)) for i in range(110))[-1].mind
    assert back.objects[PART].presence is Presence.SEEN
    assert vanished_into(back, (PART, TARGET)) is None


@pytest.mark.parametrize(
    ("path", "came"),
    [
        ([(0.0, 300.0, 100.0), (0.5, 330.0, 150.0), (1.0, 360.0, 180.0)], True),
        ([(0.0, 360.0, 180.0), (0.5, 360.0, 180.5), (1.0, 360.0, 181.0)], False),  # it rests
        ([(0.0, 360.0, 180.0), (0.5, 330.0, 150.0), (1.0, 300.0, 100.0)], False),  # it goes away
        ([(0.0, 300.0, 100.0), (1.0, 360.0, 180.0)], False),  # seen too shortly
    ],
)
def test_only_an_approaching_body_vanishes_into_another(
    path: list[tuple[float, float, float]], came: bool
) -> None:
    body, other = (
        ObjectBelief(i, region, Presence.SEEN, 0.0, 1.0, confirmed=True)
        for i, region in ((PART, box_region(PART, (340, 160, 40, 40))), (TARGET, LARGE))
        if region is not None
    )
    track = ObjectTrack(body.region, 1.0, 0.0, centroids=tuple(path), reference_area=1600.0)
    assert came_to(track, other.region) is came
    told: dict[str, Any] = {}
    context = SimpleNamespace(
        tracks={PART: track},
        mind=SimpleNamespace(objects={PART: body}),
        store=lambda belief, **fields: told.update(fields),
        report=lambda *words: None,
    )
    occlude(context, body, other)  # type: ignore[arg-type]
    assert told["vanished_into"] == (TARGET if came else None)


LARGE = box_region(TARGET, (280, 200, 160, 120))
