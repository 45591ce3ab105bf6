"""Zones: which objects are inside what the user drew; unknown depth is not a guess."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.rules.scenes import box_region, seen
from visup.agent import Mind, Observation, Truth, Zone
from visup.agent.model.errors import ErrorGroup, SettingsError
from visup.rules.reasoners import default_reasoners
from visup.rules.relations.zones import (
    contains,
    distance_outside,
    inside,
    outside,
    reaching,
    wholly_inside,
)
from visup.runs.inputs.zones import load_zones

DOCK = Zone("dock", ((300.0, 100.0), (500.0, 100.0), (500.0, 400.0), (300.0, 400.0)))
DEEP = replace(DOCK, name="deep", depth=(10.0, 20.0))


def minds(
    at: Callable[[float], float], seconds: float, depth: float | None = None, noise: float = 0.0
) -> Iterator[Mind]:
    """A box of 80 x 60 px whose left edge is a function of time, and what is believed of it."""
    rng, rules = np.random.default_rng(3), default_reasoners()
    mind = Mind(zones=(DOCK, DEEP))
    for i in range(round(seconds * 25)):
        x, y = at(i / 25) + noise * rng.standard_normal(), 200 + noise * rng.standard_normal()
        known = {} if depth is None else {1: ("probe", depth)}
        observation: Observation = seen(
            i, [box_region(1, (x, y, 80, 60))], names={1: [("probe", 0.9)]}, depths=known
        )
        for reasoner in (*rules.update, *rules.cogitate):
            mind = reasoner(mind, observation).mind
        yield mind


def test_a_body_reaches_then_is_inside_then_is_within() -> None:
    run = list(minds(lambda t: 180 + 20 * t, 8.0))
    first = {
        ask.__name__: next(m.time for m in run if ask(m, 1, "dock") is Truth.TRUE)
        for ask in (reaching, inside, wholly_inside)
    }
    assert first["reaching"] == pytest.approx(2.4, abs=0.2)  # its right edge at 300
    assert first["inside"] == pytest.approx(4.4, abs=0.2)
    assert first["wholly_inside"] == pytest.approx(6.4, abs=0.2)
    told = run[-1].relation("wholly_inside dock", 1)
    assert told is not None
    assert told.truth is Truth.TRUE
    assert distance_outside(run[-1], 1, "dock") == pytest.approx(-78.5, abs=1.5)


@pytest.mark.parametrize(
    ("x", "depth", "expected"),
    [
        (360, 15.0, Truth.TRUE),
        (360, 30.0, Truth.FALSE),
        (360, None, Truth.UNKNOWN),
        (100, None, Truth.FALSE),  # The image alone says so.
    ],
)
def test_a_zone_with_depth_asks_for_depth(x: float, depth: float | None, expected: Truth) -> None:
    last = list(minds(lambda t: x, 4.0, depth))[-1]
    assert inside(last, 1, "deep") is expected


def test_a_body_at_rest_on_the_edge_changes_nothing() -> None:
    told = [inside(m, 1, "dock") for m in minds(lambda t: 260.5, 24.0, noise=0.5)][60:]
    assert len(set(told)) == 1
    assert Truth.UNKNOWN not in told


def test_what_is_not_there_is_unknown() -> None:
    last = list(minds(lambda t: 100, 3.0))[-1]
    assert inside(last, 9, "dock") is Truth.UNKNOWN
    assert inside(last, 1, "nowhere") is Truth.UNKNOWN
    assert np.isnan(distance_outside(last, 1, "nowhere"))


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=3, max_size=6),
    st.tuples(st.floats(-3, 15), st.floats(-3, 15)),
)
def test_distance_to_a_polygon_is_that_to_its_densely_sampled_edge(
    corners: list[tuple[int, int]], point: tuple[float, float]
) -> None:
    polygon, at = np.array(corners, dtype=float), np.array([point])
    share = np.linspace(0, 1, 400)[:, None]
    edge = np.concatenate(
        [a + share * (b - a) for a, b in zip(polygon, np.roll(polygon, -1, 0), strict=True)]
    )
    least = np.hypot(*(edge - at).T).min()
    assert abs(outside(at, polygon)[0]) == pytest.approx(least, abs=0.05)
    assert (outside(at, polygon)[0] < 0) == contains(at, polygon)[0] or least == 0.0


GOOD = """
[[zone]]
name = "dock"
polygon = [[300, 100], [500, 100], [500, 400.5]]

[[zone]]
name = "deep"
polygon = [[0, 0], [10, 0], [10, 10]]
depth = [5, 20]
"""


def test_zones_are_read_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "zones.toml"
    path.write_text(GOOD)
    one, two = load_zones(path)
    assert one == Zone("dock", ((300.0, 100.0), (500.0, 100.0), (500.0, 400.5)))
    assert two.depth == (5.0, 20.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "there is no zone in it"),
        ("zone = 3", "there is no zone in it"),
        ("[[zone]\n", "this is not TOML"),
        ("[[area]]\n", "'area' is not known here"),
        ("[[zone]]\npolygon = [[0, 0], [9, 0], [9, 9]]", "the zone has no name"),
        ('[[zone]]\nname = "a b"\npolygon = [[0, 0], [9, 0], [9, 9]]', "the name is 'a b'"),
        ('[[zone]]\nname = "a"\npolygon = [[0, 0], [9, 0]]', "the polygon has 2 corners"),
        ('[[zone]]\nname = "a"\npolygon = [[0, 0], [5, 5], [9, 9]]', "encloses nothing"),
        ('[[zone]]\nname = "a"\npolygon = [[0, 0], [5, "x"], [9, 9]]', "not a list of corners"),
        ('[[zone]]\nname = "a"', "not a list of corners"),
        ('[[zone]]\nname = "a"\npolygon = [[0, 0], [9, 0], [9, nan]]', "not a list of corners"),
        (
            '[[zone]]\nname = "a"\ncolor = 1\npolygon = [[0, 0], [9, 0], [9, 9]]',
            "'color' is not known",
        ),
        ('[[zone]]\nname = "a"\ndepth = [9, 5]\npolygon = [[0, 0], [9, 0], [9, 9]]', "[9, 5]"),
    ],
)
def test_a_bad_file_is_told_in_words(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "zones.toml"
    path.write_text(text)
    with pytest.raises(SettingsError, match=r"zones\.toml") as told:
        load_zones(path)
    assert said in str(told.value)


def test_all_faults_of_a_file_are_told_at_once(tmp_path: Path) -> None:
    path = tmp_path / "zones.toml"
    path.write_text(
        GOOD + '[[zone]]\nname = "dock"\npolygon = [[0,0],[9,0],[9,9]]\n[[zone]]\nname = "x"\n'
    )
    with pytest.raises(ErrorGroup) as told:
        load_zones(path)
    assert "two zones are called 'dock'" in str(told.value)
    with pytest.raises(SettingsError, match="cannot be read"):
        load_zones(tmp_path / "none.toml")
