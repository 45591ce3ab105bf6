from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import permutations
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from tests.tasks.scripted import belief
from visup.agent import Binding, Coupling, Mind, Presence
from visup.tasks import load_task, parse_task
from visup.tasks.casting.matching import (
    best_matching,
    match,
    match_strength,
    rank_stages,
    rank_tasks,
    unexplained,
)
from visup.tasks.verification.settings import TaskSettings

DOCK = load_task("dock")
shares = st.dictionaries(
    st.sampled_from(["arm", "satellite", "guitar"]), st.floats(0.0, 0.33), max_size=3
)
weights = st.sampled_from((0.0, 0.0, 0.0, 0.2, 0.5, 0.9))


def mind_of(*objects: Mapping[str, float], **others: Mapping[str, tuple[str, ...]]) -> Mind:
    beliefs = {i: belief(i, s) for i, s in enumerate(objects, 1)}
    return Mind(objects=MappingProxyType(beliefs), actors=others.get("actors", {}))


def bound(bindings: tuple[Binding, ...]) -> dict[str, int | None]:
    return {b.actor: b.object_id for b in bindings}


@settings(max_examples=100, deadline=None)
@given(st.lists(shares, max_size=4))
def test_the_matching_is_optimal(objects: list[dict[str, float]]) -> None:
    at = TaskSettings(bind_at=1e-6)
    found = match(DOCK, mind_of(*objects), settings=at)
    total = sum(b.strength for b in found)
    padded: list[Mapping[str, float]] = [*objects, {}, {}]
    best = max(a.get("arm", 0.0) + s.get("satellite", 0.0) for a, s in permutations(padded, 2))
    assert total == pytest.approx(best, abs=1e-5)
    ids = [b.object_id for b in found if b.object_id is not None]
    assert len(ids) == len(set(ids))


@given(st.integers(1, 4).flatmap(lambda n: st.lists(st.lists(weights, min_size=n, max_size=n))))
def test_the_matching_has_the_weight_of_scipys_optimum(table: list[list[float]]) -> None:
    found = best_matching(table)
    assert len(set(found.values())) == len(found)
    assert all(table[i][j] > 0.0 for i, j in found.items())
    best = 0.0
    if table:
        best = np.array(table)[linear_sum_assignment(table, maximize=True)].sum()
    assert sum(table[i][j] for i, j in found.items()) == pytest.approx(best)


def test_models_of_an_actor_come_from_the_user_the_task_or_its_name() -> None:
    task = parse_task("actor satellite is spartan or hubble\n<t> ::= coupled(arm, satellite)")
    mind = mind_of({"arm": 0.9}, {"hubble": 0.3, "spartan": 0.3, "satellite": 0.4})
    arm, satellite = match(task, mind)
    assert (arm.models, satellite.models) == (("arm",), ("spartan", "hubble"))
    assert satellite.strength == pytest.approx(0.6)
    mine = mind_of({"arm": 0.9}, {"mir": 0.8}, actors={"satellite": ("mir",)})
    assert match(task, mine)[1].models == ("mir",)
    assert match(task, mine)[1].object_id == 2


def test_weak_and_unconfirmed_objects_are_not_bound() -> None:
    assert bound(match(DOCK, mind_of({"arm": 0.05}))) == {"arm": None, "satellite": None}
    timid = Mind(objects=MappingProxyType({1: belief(1, {"arm": 1.0}, confirmed=False)}))
    assert bound(match(DOCK, timid)) == {"arm": None, "satellite": None}


def test_a_binding_is_kept_through_small_changes_and_while_hidden() -> None:
    before = match(DOCK, mind_of({"arm": 0.5}, {"arm": 0.4}))
    assert bound(before)["arm"] == 1
    changed = mind_of({"arm": 0.4}, {"arm": 0.5})
    assert bound(match(DOCK, changed, before))["arm"] == 1
    hidden = changed.with_objects(belief(1, {"arm": 0.4}, Presence.HIDDEN))
    assert bound(match(DOCK, hidden, before))["arm"] == 1
    clearly = mind_of({"arm": 0.1}, {"arm": 0.9})
    assert bound(match(DOCK, clearly, before))["arm"] == 2


def test_an_object_that_left_stays_bound_until_another_takes_its_actor() -> None:
    before = match(DOCK, mind_of({"arm": 0.9}))
    after_exit = mind_of().with_objects(belief(1, {"arm": 0.9}, Presence.LEFT))
    assert bound(match(DOCK, after_exit, before))["arm"] == 1
    assert bound(match(DOCK, after_exit))["arm"] is None
    other = after_exit.with_objects(belief(2, {"arm": 0.3}))
    assert bound(match(DOCK, other, before))["arm"] == 2


@pytest.mark.parametrize(
    ("third", "arm_known", "expected"),
    [
        ({"dish": 0.8}, True, (3,)),  # everyone is found: whatever it is, it is one too many
        ({}, True, (3,)),
        ({"dish": 0.8}, False, (3,)),  # it is clearly none of the actors
        ({"dish": 0.2}, False, ()),  # it may be the arm that is not found yet
        ({}, False, ()),
        ({"satellite": 0.5}, False, ()),
    ],
)
def test_objects_without_an_actor_are_unexplained(
    third: dict[str, float], arm_known: bool, expected: tuple[int, ...]
) -> None:
    arm = {"arm": 0.9} if arm_known else {"guitar": 0.2}
    mind = replace(mind_of(arm, {"satellite": 0.9}, third), time=10.0)
    bindings = match(DOCK, mind)
    assert unexplained(mind, bindings) == expected


def test_a_new_identity_is_not_unexplained_while_an_actor_is_missing() -> None:
    """The arm may be told as a dish at first sight; with all actors found there is nothing to wait for."""
    early = replace(mind_of({"guitar": 0.2}, {"satellite": 0.9}, {"dish": 0.8}), time=2.0)
    assert unexplained(early, match(DOCK, early)) == ()
    known = replace(mind_of({"arm": 0.9}, {"satellite": 0.9}, {"dish": 0.8}), time=2.0)
    assert unexplained(known, match(DOCK, known)) == (3,)


@pytest.mark.parametrize(("third", "expected"), [({}, ()), ({"dish": 0.8}, (3,))])
def test_an_unknown_object_holding_an_actor_is_explained(
    third: dict[str, float], expected: tuple[int, ...]
) -> None:
    """Somebody must carry a part, whether the task names him or not; a known thing is another matter."""
    mind = replace(mind_of({"arm": 0.9}, {"satellite": 0.9}, third), time=10.0)
    assert unexplained(mind, match(DOCK, mind)) == (3,)
    holding = replace(mind, couplings=(Coupling((2, 3), 9.0),))
    assert unexplained(holding, match(DOCK, holding)) == expected


def test_hidden_objects_are_not_unexplained() -> None:
    mind = mind_of({"arm": 0.9}, {"satellite": 0.9}).with_objects(
        belief(3, {"dish": 0.8}, Presence.HIDDEN)
    )
    assert unexplained(mind, match(DOCK, mind)) == ()


def test_stages_and_tasks_are_ranked_by_how_well_their_actors_are_matched() -> None:
    two = parse_task("<t> ::= <one> <two>\n<one> ::= coupled(a, b)\n<two> ::= coupled(b, c)")
    mind = mind_of({"b": 0.8}, {"c": 0.6})
    (best, strong), (next_best, weak) = rank_stages(two, match(two, mind))
    assert (best, next_best) == ("two", "one")
    assert strong == pytest.approx(0.7)
    assert weak == pytest.approx(0.4)
    assert [n for n, _ in rank_tasks([DOCK, two], mind)] == ["t", "dock"]
    assert match_strength((), ()) == 0.0
