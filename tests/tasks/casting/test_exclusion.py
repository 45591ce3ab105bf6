"""A guess needs all others at rest and one mover that nobody knows; it gives way to whoever is recognised."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
import pytest

from tests.tasks.scripted import belief
from visup.agent import Binding, Mind, ObjectBelief
from visup.agent.model.fast_replace import replace
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.reasoner import RELATIONS, RelationMemory
from visup.tasks import parse_task
from visup.tasks.casting.matching import match, unexplained

TASK = parse_task("<t> ::= <reach>\n<reach> ::= converging(gripper, part)")
PART = {"part": 0.9}


def sized(number: int, shares: Mapping[str, float], area: float) -> ObjectBelief:
    it = belief(number, shares)
    return replace(it, region=replace(it.region, area=area))


def mind_of(speeds: Mapping[int, float], *objects: ObjectBelief) -> Mind:
    """Objects with their speeds, pixels per second."""
    ids = tuple(sorted(o.id for o in objects))
    m, speed = len(ids), np.array([speeds.get(i, 0.0) for i in ids])
    now = Kinematics(
        ids, np.full((5, m, m), np.nan), np.zeros((3, m, 2)), speed, speed, np.full(m, 0.5)
    )
    mind = Mind(objects=MappingProxyType({o.id: o for o in objects}), frame_size=(640, 480))
    return mind.remember(RELATIONS, RelationMemory(measured=now))


def cast(bindings: tuple[Binding, ...]) -> dict[str, tuple[int | None, bool]]:
    return {b.actor: (b.object_id, b.guessed) for b in bindings}


STRANGER, SHADOW = sized(2, {}, 5000.0), sized(3, {}, 1000.0)
KNOWN_PART = sized(1, PART, 900.0)


@pytest.mark.parametrize(
    ("speeds", "objects", "gripper"),
    [
        ({2: 80.0}, (KNOWN_PART, STRANGER), (2, True)),
        ({2: 80.0, 3: 80.0}, (KNOWN_PART, STRANGER, SHADOW), (2, True)),
        ({}, (KNOWN_PART, STRANGER), (None, False)),  # nothing moves
        ({1: 80.0, 2: 80.0}, (KNOWN_PART, STRANGER), (None, False)),  # the part moves: by whom?
        ({2: 80.0, 3: 80.0}, (KNOWN_PART, STRANGER, sized(3, {}, 4000.0)), (None, False)),  # which?
        ({2: 80.0}, (STRANGER, SHADOW), (None, False)),  # nobody is known
        ({2: 80.0}, (KNOWN_PART, sized(2, {"cup": 0.8}, 5000.0)), (None, False)),  # it is a cup
        ({2: 80.0}, (KNOWN_PART, STRANGER, sized(3, {"gripper": 0.5}, 10.0)), (3, False)),
    ],
)
def test_unidentified_actors_are_guessed(
    speeds: Mapping[int, float], objects: tuple[ObjectBelief, ...], gripper: tuple[int | None, bool]
) -> None:
    bindings = cast(match(TASK, mind_of(speeds, *objects)))
    assert bindings["gripper"] == gripper


def test_a_guess_is_kept_at_rest_and_replaced_by_an_identification() -> None:
    first = match(TASK, mind_of({2: 80.0}, KNOWN_PART, STRANGER))
    second = match(TASK, mind_of({}, KNOWN_PART, STRANGER), first)
    assert cast(second)["gripper"] == (2, True)
    real = sized(3, {"gripper": 0.6}, 300.0)
    assert cast(match(TASK, mind_of({}, KNOWN_PART, STRANGER, real), second))["gripper"] == (
        3,
        False,
    )


def test_a_guess_leaves_no_object_unexplained() -> None:
    mind = mind_of({2: 80.0, 3: 80.0}, KNOWN_PART, STRANGER, SHADOW)
    assert unexplained(mind, match(TASK, mind)) == ()


def test_an_optional_actor_is_not_guessed() -> None:
    text = "<t> ::= <reach>\n<reach> ::= converging(gripper, part)"
    task = parse_task(f"optional actor gripper is gripper\n{text}")
    assert cast(match(task, mind_of({2: 80.0}, KNOWN_PART, STRANGER)))["gripper"] == (None, False)
