"""What is out of sight is forgotten: what nobody has named in seconds, what is known in minutes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import events_of, reason
from tests.rules.scenes import box_region, seen
from visup.agent import (
    Binding,
    Candidate,
    Mind,
    ObjectBelief,
    Observation,
    Presence,
    TaskBelief,
    Verdict,
)
from visup.rules.presence.objects import ObjectReasoner, ObjectSettings
from visup.rules.presence.settings import PresenceSettings

S = ObjectSettings()
P = PresenceSettings()
THERE = box_region(7, (20, 20, 60, 40))
assert THERE is not None
HIDDEN = ObjectBelief(
    7,
    THERE,
    Presence.HIDDEN,
    first_seen=0.0,
    last_seen=0.0,
    confirmed=True,
)


def remembered(mind: Mind, belief: ObjectBelief, unseen_s: float) -> bool:
    frame = round(25 * unseen_s)
    mind = replace(mind, objects=MappingProxyType({belief.id: belief}))
    return belief.id in ObjectReasoner()(mind, seen(frame, [])).mind.objects


def named(confidence: float) -> ObjectBelief:
    candidates = (Candidate("arm", 5.0, 1.0, confidence),)
    return replace(HIDDEN, candidates=candidates, unknown=1.0 - confidence)


def with_part(object_id: int | None) -> Mind:
    binding = Binding("arm", ("arm",), object_id, 0.2)
    task = TaskBelief("dock", Verdict.UNKNOWN, bindings=(binding,))
    return replace(Mind(), tasks=(task,))


@given(st.floats(0.0, 400.0))
def test_a_hidden_thing_is_forgotten_in_seconds_unless_it_is_known(unseen_s: float) -> None:
    unseen = round(25 * unseen_s) / 25
    assert remembered(Mind(), HIDDEN, unseen_s) == (unseen <= S.forget_nameless_s)
    assert remembered(Mind(), named(0.3), unseen_s) == (unseen <= S.forget_nameless_s)
    for mind, belief in (
        (Mind(), named(0.8)),
        (with_part(7), HIDDEN),
        (replace(Mind(), answers=MappingProxyType({7: "arm"})), HIDDEN),
    ):
        assert remembered(mind, belief, unseen_s) == (unseen <= S.forget_hidden_s)


@pytest.mark.parametrize("object_id", [None, 8])
def test_the_part_of_another_keeps_nobody(object_id: int | None) -> None:
    assert not remembered(with_part(object_id), HIDDEN, S.forget_nameless_s + 1)


def test_what_is_recognised_by_its_looks_is_nobodys_part_and_comes_back_as_itself() -> None:
    """A large arm closes round a small tray; then the tray is lost for a second, and has another region."""

    def looks() -> Iterator[Observation]:
        for i in range(150):
            tray = None if 90 <= i < 115 else box_region(1 if i < 90 else 7, (300, 220, 40, 30))
            arm = box_region(2, (200, 120, 260, 260)) if i >= 30 else None
            names = {1 if i < 90 else 7: [("tray", 0.9)], 2: [("arm", 0.9)]}
            yield seen(i, [tray, arm], names=names)

    mind = reason(looks())[-1].mind
    named = {b.name: b.id for b in mind.objects.values() if b.confirmed}
    assert named == {"tray": 1, "arm": 2}


def entered_at(names: dict[int, list[tuple[str, float]]], speed: float) -> float | None:
    """When region 2 has entered, which comes at 3 s, inside the image, beside a tray at rest."""

    def looks() -> Iterator[Observation]:
        for i in range(150):
            tray = box_region(1, (300, 220, 40, 30))
            now = i / 25 - 3.0
            arm = box_region(2, (60 + speed * now, 60, 80, 50)) if now >= 0 else None
            moving = replace(arm, velocity=(speed, 0.0), velocity_sigma=4.0) if arm else None
            yield seen(i, [tray, moving], names=names)

    told = events_of(reason(looks()), ["entry", "noticed"])
    return next((t for _, who, t in told if who == 2), None)


def test_what_is_recognised_and_moves_enters_at_once() -> None:
    tray, arm = ("tray", 0.9), ("arm", 0.9)
    sightings_s = P.least_sightings / 25
    known = entered_at({1: [tray], 2: [arm]}, 40.0)
    assert known == pytest.approx(3.0 + sightings_s, abs=0.05)
    at_rest = entered_at({1: [tray], 2: [arm]}, 0.0)
    assert at_rest == pytest.approx(3.0 + P.entry_inside_s, abs=0.1)
    unknown = entered_at({1: [tray]}, 40.0)
    assert unknown == pytest.approx(3.0 + P.entry_inside_s, abs=0.1)
    again = entered_at({1: [tray], 2: [tray]}, 40.0)
    assert again is None or again >= 3.0 + P.entry_inside_s - 0.1


def test_what_passed_for_a_recognised_thing_gives_way_when_that_is_seen_again() -> None:
    """A gripper is lost for a second; meanwhile its arm, which moves on from there, is taken for it."""

    def looks() -> Iterator[Observation]:
        for i in range(150):
            lost = 60 <= i < 90
            gripper = None if lost else box_region(1, (200 + i, 220, 60, 50))
            arm = box_region(2, (195 + i, 200, 65, 60)) if i >= 60 else None
            yield seen(i, [gripper, arm], names={1: [("gripper", 0.95)]})

    steps = reason(looks())
    assert steps[80].mind.objects[1].region.id == 2
    objects = steps[-1].mind.objects
    assert objects[1].region.id == 1
    assert [b.id for b in objects.values() if b.name == "gripper"] == [1]
