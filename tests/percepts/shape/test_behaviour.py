"""The behaviours: hypotheses for regions, bounded work, and depth from size."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.shape.shapes import ZOO, Mask, small_database
from visup.agent.contract.behaviour import Behaviour
from visup.agent.model.errors import SettingsError
from visup.agent.model.events import Directive
from visup.agent.model.records import (
    Depth,
    Frame,
    Hypothesis,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
)
from visup.percepts.depth import DepthBehaviour, extents, focal_px
from visup.percepts.shape.behaviour import ShapeBehaviour, ShapeSettings
from visup.percepts.shape.database.model_database import ModelDatabase, Ranking
from visup.percepts.shape.matching.shape_similarity import Shape
from visup.testing import region_of

SIZE = (640, 480)


def region(mask: Mask, number: int = 1, cut: bool = False) -> Region:
    return replace(region_of(mask, number), cut=cut)


def frame(time: float) -> Frame:
    return Frame(round(time * 25), time, np.zeros((SIZE[1], SIZE[0], 3), np.uint8))


def observation(time: float, **seen: Sequence[object]) -> Observation:
    percepts = tuple(Percept(kind, v, time, "test") for kind, vs in seen.items() for v in vs)
    report = Report("test", ReportState.RAN, tuple(seen), percepts)
    return Observation(round(time * 25), time, SIZE, (report,))


class Counting(ModelDatabase):
    """A database that counts its queries."""

    queries = 0

    def query(self, *args: object, **kwargs: object) -> Ranking:
        self.queries += 1
        return super().query(*args, **kwargs)  # type: ignore[arg-type]


@pytest.fixture
def database(tmp_path: Path) -> Counting:
    made = small_database(tmp_path / "zoo.db")
    return Counting(made.path, made.views)


def hypotheses(
    behaviour: ShapeBehaviour,
    time: float,
    regions: Sequence[Region],
    directives: Sequence[Directive] = (),
) -> list[Hypothesis]:
    seen = observation(time, region=regions)
    percepts = list(behaviour.perceive(frame(time), seen, directives))
    assert all(p.kind == "hypothesis" and p.time == time for p in percepts)
    return [p.value for p in percepts]


def test_shape_and_depth_conform_to_the_contract() -> None:
    assert isinstance(ShapeBehaviour(), Behaviour)
    assert isinstance(DepthBehaviour(), Behaviour)
    assert ShapeBehaviour.contract.gives == ("hypothesis",)
    assert DepthBehaviour.contract.needs == ("region", "hypothesis")


def test_without_a_database_nothing_is_reported() -> None:
    assert hypotheses(ShapeBehaviour(), 0.0, [region(ZOO["star"])]) == []


def test_the_best_hypothesis_of_each_region_is_its_model(database: Counting) -> None:
    regions = [region(ZOO["star"], 1), region(ZOO["walker"], 2)]
    found = hypotheses(ShapeBehaviour(database), 0.0, regions)
    for number, name in ((1, "star"), (2, "walker")):
        own = [h for h in found if h.region_id == number]
        assert own[0].name == name
        assert [h.similarity for h in own] == sorted((h.similarity for h in own), reverse=True)
        assert all(h.similarity >= ShapeSettings().threshold for h in own)
        assert own[0].scale == pytest.approx(math.sqrt(regions[number - 1].area))


def test_an_unchanged_region_is_matched_once_and_reported_in_every_frame(
    database: Counting,
) -> None:
    behaviour = ShapeBehaviour(database)
    told = [hypotheses(behaviour, k / 25, [region(ZOO["star"])]) for k in range(20)]
    assert all(t and t == told[0] for t in told)
    assert database.queries == 1


def test_a_changed_region_is_matched_again_but_not_at_once(database: Counting) -> None:
    behaviour = ShapeBehaviour(database)
    hypotheses(behaviour, 0.0, [region(ZOO["star"])])
    soon = hypotheses(behaviour, 0.1, [region(ZOO["walker"])])
    later = hypotheses(behaviour, 0.24, [region(ZOO["walker"])])
    assert (soon[0].name, later[0].name) == ("star", "walker")


def test_matches_per_frame_are_bounded(database: Counting) -> None:
    behaviour = ShapeBehaviour(database)
    regions = [region(ZOO["star"], n) for n in range(1, 6)]
    counts = []
    for k in range(4):
        before = database.queries
        hypotheses(behaviour, k / 25, regions)
        counts.append(database.queries - before)
    assert counts == [2, 2, 1, 0]


def test_regions_of_a_frame_are_matched_in_one_call(
    database: Counting, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[tuple[int, object]] = []
    every = Counting.query_all

    def count(self: Counting, shapes: Sequence[Shape], **wanted: Any) -> tuple[Ranking, ...]:
        calls.append((len(shapes), wanted["budget_ms"]))
        return every(self, shapes, **wanted)

    monkeypatch.setattr(Counting, "query_all", count)
    speck = region(np.ones((3, 3), bool), 3)
    behaviour = ShapeBehaviour(database, ShapeSettings(matches_per_frame=5, budget_ms=40.0))
    found = hypotheses(behaviour, 0.0, [region(ZOO["star"], 1), speck, region(ZOO["pear"], 2)])
    # What is too small to have a shape is no reason to ask.
    assert calls == [(2, 40.0)]
    assert {h.region_id for h in found} == {1, 2}
    hypotheses(behaviour, 0.04, [region(ZOO["star"], 1), speck, region(ZOO["pear"], 2)])
    assert database.queries == 2


def test_an_unchanged_region_is_not_matched_again_before_it_is_time(database: Counting) -> None:
    behaviour = ShapeBehaviour(database)
    moved = [region(np.roll(ZOO["walker"], k, axis=1)) for k in range(40)]
    for k, seen in enumerate(moved):
        hypotheses(behaviour, k / 25, [seen])
    assert database.queries == 1
    hypotheses(behaviour, ShapeSettings().renew_s + 0.1, [moved[0]])
    assert database.queries == 2
    hypotheses(behaviour, ShapeSettings().renew_s + 0.4, [region(np.rot90(ZOO["walker"]))])
    assert database.queries == 3


def test_a_directive_restricts_the_names(database: Counting) -> None:
    only = Directive("restrict", "only these are expected", {"names": ("pear",)})
    settings_ = ShapeSettings(threshold=0.0)
    found = hypotheses(ShapeBehaviour(database, settings_), 0.0, [region(ZOO["star"])], [only])
    assert {h.name for h in found} == {"pear"}


def test_try_first_does_not_change_the_ranking(database: Counting) -> None:
    first = Directive("try_first", "these are expected", {"names": ("pear",)})
    found = hypotheses(ShapeBehaviour(database), 0.0, [region(ZOO["star"])], [first])
    assert found[0].name == "star"


def test_a_cut_region_has_no_scale(database: Counting) -> None:
    behaviour = ShapeBehaviour(database, ShapeSettings(threshold=0.1))
    found = hypotheses(behaviour, 0.0, [region(ZOO["walker"], cut=True)])
    assert found
    assert all(h.scale is None for h in found)


def depths(regions: Sequence[Region], guesses: Sequence[Hypothesis], fov: float) -> list[Depth]:
    seen = observation(0.0, region=regions, hypothesis=guesses)
    return [p.value for p in DepthBehaviour(None, fov).perceive(frame(0.0), seen, ())]


@settings(max_examples=20, deadline=None)
@given(st.floats(0.2, 3.0), st.floats(8.0, 30.0), st.floats(20.0, 60.0))
def test_the_depth_of_a_sphere_is_correct(radius: float, distance: float, fov: float) -> None:
    focal = focal_px(SIZE[1], fov)
    area = math.pi * (focal * radius / distance) ** 2
    seen = Region(
        1, (0, 0, 2, 2), np.ones((2, 2), bool), np.zeros((4, 2), np.float32), (0, 0), area
    )
    scale = math.sqrt(area / (math.pi * radius**2))
    (depth,) = depths([seen], [Hypothesis(1, "ball", 0, 1.0, scale=scale)], fov)
    assert depth.depth == pytest.approx(distance, rel=1e-6)
    assert 0 < depth.sigma < 0.1 * distance


def test_views_that_disagree_on_size_widen_sigma() -> None:
    seen = region(ZOO["star"])
    alike = [Hypothesis(1, "a", k, 0.8, scale=100.0) for k in range(3)]
    apart = [Hypothesis(1, "a", k, 0.8, scale=100.0 + 30 * k) for k in range(3)]
    (sure,), (unsure,) = depths([seen], alike, 40.0), depths([seen], apart, 40.0)
    assert unsure.sigma > 1.5 * sure.sigma


def test_cut_regions_or_models_without_size_have_no_depth() -> None:
    guess = [Hypothesis(1, "a", 0, 0.9)]
    assert depths([region(ZOO["star"])], guess, 40.0) == []
    sized = [Hypothesis(1, "a", 0, 0.9, scale=50.0)]
    assert depths([region(ZOO["star"], cut=True)], sized, 40.0) == []


def test_each_name_has_a_depth_of_its_own() -> None:
    guesses = [Hypothesis(1, "a", 0, 0.9, scale=50.0), Hypothesis(1, "b", 0, 0.8, scale=25.0)]
    found = {d.name: d.depth for d in depths([region(ZOO["star"])], guesses, 40.0)}
    assert found["b"] == pytest.approx(2 * found["a"])


@pytest.mark.parametrize("fov", [0.0, -10.0, 180.0, math.nan])
def test_an_impossible_field_of_view_is_refused(fov: float) -> None:
    with pytest.raises(SettingsError, match="field of view"):
        DepthBehaviour(None, fov)


def test_sizes_come_from_the_database_if_hypotheses_have_none(database: Counting) -> None:
    seen = observation(
        0.0, region=[region(ZOO["star"])], hypothesis=[Hypothesis(1, "star", 0, 0.9)]
    )
    (percept,) = DepthBehaviour(database, 40.0).perceive(frame(0.0), seen, ())
    expected = focal_px(SIZE[1], 40.0) / math.sqrt(float(ZOO["star"].sum()))
    assert percept.value.depth == pytest.approx(expected)


def test_a_measured_size_overrides_that_of_the_database(database: Counting) -> None:
    view = next(v for v in database.views if v.area is not None and not v.cut)
    extent = extents(database, [view.name])[view.name]
    seen = observation(
        0.0,
        region=[region(ZOO[view.name])],
        hypothesis=[Hypothesis(1, view.name, view.number, 0.9)],
    )
    (plain,) = DepthBehaviour(database, 40.0).perceive(frame(0.0), seen, ())
    (twice,) = DepthBehaviour(database, 40.0, {view.name: 2 * extent}).perceive(
        frame(0.0), seen, ()
    )
    (other,) = DepthBehaviour(database, 40.0, {"nobody": 3.0}).perceive(frame(0.0), seen, ())
    assert twice.value.depth == pytest.approx(2 * plain.value.depth)
    assert twice.value.sigma == pytest.approx(2 * plain.value.sigma)
    assert other.value == plain.value


def test_a_resting_region_is_matched_less_often_and_reported_in_every_frame(
    database: Counting,
) -> None:
    shapes = [region(ZOO[name]) for name in list(ZOO)[:2]]

    def looks(*asked: Directive) -> int:
        before, behaviour = database.queries, ShapeBehaviour(database)
        for n in range(25):
            # Two silhouettes in turn, so that a look is due as soon as there may be one.
            seen = observation(n / 10, region=[shapes[n % 2]])
            assert behaviour.perceive(frame(n / 10), seen, asked)
        return database.queries - before

    rest = Directive("rest", "known", {"behaviour": "shape", "region": 1, "every_s": 1.0})
    other = Directive("rest", "known", {"behaviour": "shape", "region": 2, "every_s": 1.0})
    assert looks() == looks(other) == 9  # after 0.2 s, at the next other silhouette
    assert looks(rest) == 3


def test_a_surface_that_cannot_be_tracked_is_retried_no_more_often_than_silhouettes(
    database: Counting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """2 s of one region, 25 frames a second: it is matched in the first frame alone."""
    behaviour, tried = ShapeBehaviour(database, ShapeSettings(renew_s=9.0)), list[float]()
    monkeypatch.setattr(behaviour._refiner, "followed", lambda frame, *_: tried.append(frame.time))
    for index in range(50):
        hypotheses(behaviour, index / 25, [region(ZOO["star"])])
    assert database.queries == 1
    assert tried == pytest.approx(np.arange(0.2, 2.0, 0.2))
