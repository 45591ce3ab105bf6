"""Trends that have just set in: when they count, and that nothing else does."""

from __future__ import annotations

import numpy as np
import pytest

from visup.agent import Mind, Relation, Truth
from visup.rules.relations.kinematics import Kinematics
from visup.rules.relations.reasoner import RELATIONS, RelationMemory
from visup.rules.relations.samples import SampleWindow
from visup.tasks.actions.actions import ACTIONS
from visup.tasks.verification.new_trends import NewTrends, new_trend
from visup.tasks.verification.observe import RelationLookup, observe
from visup.tasks.verification.pauses import NO_PAUSES

TIMES = np.arange(0.0, 1.5, 1 / 15)
NOW = float(TIMES[-1])
SINCE = float(TIMES[-5])


def mind(
    rate: float, speed: float | tuple[float, float] = 0.0, relations: tuple[Relation, ...] = ()
) -> Mind:
    """Two bodies whose distance begins to change at that rate, pixels per second, a moment ago."""
    apart = np.full((len(TIMES), 2, 2), np.nan)
    apart[:, 0, 1] = apart[:, 1, 0] = 40.0 + rate * np.maximum(0.0, TIMES - SINCE)
    tables = np.zeros((5, 2, 2))
    tables[3] = abs(rate)
    tables[1] = rate
    now = Kinematics((1, 2), tables, np.zeros((3, 2, 2)), np.broadcast_to(speed, 2))
    memory = RelationMemory(SampleWindow(ids=(1, 2), times=TIMES, separation=apart), now)
    return Mind(time=NOW, frame_size=(480, 360)).remember(RELATIONS, memory, relations=relations)


@pytest.mark.parametrize(("rate", "trend"), [(90.0, "diverging"), (-90.0, "converging")])
def test_a_trend_is_known_a_quarter_of_a_second_after_its_onset(rate: float, trend: str) -> None:
    found = new_trend(mind(rate), trend, (1, 2))
    assert found is not None
    assert found.since == pytest.approx(SINCE)
    other = "converging" if trend == "diverging" else "diverging"
    assert new_trend(mind(rate), other, (1, 2)) is None


def test_slow_changes_and_the_sway_of_carried_bodies_are_not_trends() -> None:
    assert new_trend(mind(5.0), "diverging", (1, 2)) is None
    assert new_trend(mind(90.0, speed=300.0), "diverging", (1, 2)) is not None
    assert new_trend(mind(90.0, speed=500.0), "diverging", (1, 2)) is None


def test_no_trend_for_unknown_bodies_or_a_single_one() -> None:
    assert new_trend(mind(90.0), "diverging", (1, 7)) is None
    assert new_trend(mind(90.0), "diverging", (1,)) is None
    assert new_trend(Mind(time=NOW), "diverging", (1, 2)) is None


def test_a_trend_ends_when_its_opposite_sets_in() -> None:
    trends = NewTrends(mind(90.0))
    assert trends.has_opposite(Relation("converging", (1, 2), Truth.TRUE, 0.0))
    assert not trends.has_opposite(Relation("diverging", (1, 2), Truth.TRUE, 0.0))
    assert not trends.has_opposite(Relation("touching", (1, 2), Truth.TRUE, 0.0))


def test_a_new_trend_begins_an_action_that_does_not_hold_yet() -> None:
    seen = observe(ACTIONS["diverging"], (1, 2), RelationLookup(mind(90.0)))
    assert seen.entry is seen.new_trend is not None
    assert seen.held_by is seen.helps is None
    stale = (Relation("converging", (1, 2), Truth.TRUE, 0.0),)
    closing = observe(ACTIONS["converging"], (1, 2), RelationLookup(mind(90.0, relations=stale)))
    assert closing.entry is closing.new_trend is None
    assert closing.held_by is not None


@pytest.mark.parametrize(
    ("speeds", "begins"),
    [((0.0, 90.0), False), ((90.0, 0.0), True), ((0.0, 0.0), True), ((np.nan, 90.0), True)],
)
def test_the_first_actor_must_move_for_a_new_trend_to_count(
    speeds: tuple[float, float], begins: bool
) -> None:
    """Of an arm that bends, hardly any speed is seen; so only who rests while the other moves waits."""
    seen = observe(ACTIONS["converging"], (1, 2), RelationLookup(mind(-90.0, speeds)))
    assert (seen.entry is not None) is begins
    lasting = (Relation("converging", (1, 2), Truth.TRUE, 0.0),)
    later = observe(ACTIONS["converging"], (1, 2), RelationLookup(mind(-90.0, speeds, lasting)))
    assert later.entry is not None


def passing(relative_speed: float) -> Mind:
    """Outlines that meet while one is believed to pass the other, at that speed now."""
    met = Relation("touching", (1, 2), Truth.TRUE, 0.2)
    return mind(relative_speed, relations=(met, Relation("passing_by", (1, 2), Truth.TRUE, 0.3)))


def test_a_body_at_rest_no_longer_passes_by() -> None:
    lookup = RelationLookup(passing(100.0))
    assert lookup.find("touching", (1, 2)).truth is Truth.UNKNOWN
    before = lookup.memory(NO_PAUSES, carry=False)
    first = RelationLookup(passing(1.0), before=before)
    assert first.find("touching", (1, 2)).truth is Truth.UNKNOWN  # for a moment only, yet
    later = first.memory(NO_PAUSES, carry=False)
    rests = passing(1.0)
    rests = rests.remember(RELATIONS, rests.recall(RELATIONS), time=NOW + 0.4)
    assert RelationLookup(rests, before=later).find("touching", (1, 2)).truth is Truth.TRUE
