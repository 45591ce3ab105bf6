"""What is out of sight is forgotten: what nobody has named in seconds, what is known in minutes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.rules.runs import reason
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

S = ObjectSettings()
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
