"""The interpretation tree against all paths tried one by one; its bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from math import acos, atan2, degrees, hypot, inf, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from visup.agent import Hypothesis
from visup.agent.model.orientation import views
from visup.rules.pose._interpretation_tree_jit import NONE
from visup.rules.pose.interpretation_tree import (
    InterpretationTree,
    SpinPrior,
    TreeSettings,
    empty_tree,
    extended_tree,
    levels_of,
    rival_gap,
)

WIDE = TreeSettings(most_paths=10_000)
Look = tuple[float, tuple[Hypothesis, ...]]


def view_matrix(h: Hypothesis) -> np.ndarray | None:
    """Model to camera, written out by hand: right, down and away of the picture, turned."""
    if h.direction is None:
        return None
    d = np.array(h.direction)
    right = np.cross([0, 0, 1], d)
    right /= np.linalg.norm(right)
    upright = np.stack([right, -np.cross(d, right), -d])
    return np.asarray(Rotation.from_rotvec([0, 0, h.rotation or 0.0]).as_matrix() @ upright)


def turn_cost(
    a: Hypothesis, b: Hypothesis, dt: float, turning: SpinPrior, s: TreeSettings
) -> float:
    one, other = view_matrix(a), view_matrix(b)
    if one is None or other is None:
        return 0.0 if a.view == b.view else s.other_view
    one = Rotation.from_rotvec(np.array(turning.rate) * dt).as_matrix() @ one
    m = other @ one.T
    swing = acos(min(1.0, max(-1.0, m[2, 2])))
    roll = atan2(m[1, 0] - m[0, 1], m[0, 0] + m[1, 1])
    cost = 0.5 * (swing / hypot(radians(s.swing_deg), turning.sigma * dt)) ** 2
    if a.rotation is not None and b.rotation is not None:
        cost += 0.5 * (roll / hypot(radians(s.roll_deg), turning.sigma * dt)) ** 2
    return min(s.jump, cost)


def path_cost(
    looks: Sequence[Look], chosen: Sequence[int], turning: SpinPrior, s: TreeSettings
) -> float:
    total, last, before = 0.0, None, -inf
    for (time, hypotheses), k in zip(looks, chosen, strict=True):
        weight = min(1.0, (time - before) / s.independent_s)
        before = time
        if k == NONE:
            total += weight * s.wrong
            continue
        h = hypotheses[k]
        best = max(x.similarity for x in hypotheses)
        total += weight * (best - h.similarity) / s.similarity_sigma
        if last is not None:
            total += turn_cost(last[1], h, time - last[0], turning, s)
        last = (time, h)
    return total


def cheapest(looks: Sequence[Look], turning: SpinPrior, s: TreeSettings) -> list[float]:
    every = product(*(range(-1, len(hs)) for _, hs in looks))
    return sorted(path_cost(looks, chosen, turning, s) for chosen in every)


def ranked(hypotheses: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    return tuple(sorted(hypotheses, key=lambda h: (-h.similarity, h.view, h.rotation or 0.0)))


def grow(looks: Sequence[Look], turning: SpinPrior, s: TreeSettings) -> InterpretationTree:
    tree = empty_tree(s)
    for time, hs in looks:
        level = levels_of(hs, time, s)[hs[0].name] if hs else None
        tree = extended_tree(tree, level, time, turning, s)
    return tree


def random_looks(seed: int, count: int, most: int, loose: bool = True) -> list[Look]:
    """Looks at an object that turns a little, right hypotheses among wrong ones."""
    rng = np.random.default_rng(seed)
    looks, time = [], 0.0
    home = Rotation.random(random_state=seed)
    for _ in range(count):
        time += float(rng.choice([0.04, 0.2, 1.0]))
        said = []
        for _ in range(int(rng.integers(0 if loose else 1, most + 1))):
            near = rng.random() < 0.6
            shaken = Rotation.from_rotvec(rng.normal(size=3) * 0.3) * home
            seen = (
                shaken if near else Rotation.random(random_state=int(rng.integers(1 << 30)))
            ).as_matrix()
            x, y, z = (-seen[2]).tolist()
            known, rolled = rng.random() < 0.9 or not loose, rng.random() < 0.9 or not loose
            said.append(
                Hypothesis(
                    1,
                    "m",
                    int(rng.integers(6)),
                    float(rng.uniform(0.5, 0.9)),
                    float(rng.uniform(-3, 3)) if rolled else None,
                    direction=(x, y, z) if known else None,
                )
            )
        looks.append((time, ranked(said)))
    return looks


turnings = st.sampled_from(
    [SpinPrior(), SpinPrior((0.3, -0.2, 0.5), 0.1), SpinPrior((0, 0, 0), 1.0)]
)


@given(st.integers(0, 10_000), st.integers(1, 5), turnings)
@settings(deadline=None, max_examples=60)
def test_the_cheapest_path_is_that_of_trying_all(seed: int, count: int, turning: SpinPrior) -> None:
    looks = random_looks(seed, count, 3)
    costs = cheapest(looks, turning, WIDE)
    tree = grow(looks, turning, WIDE)
    assert tree.total == pytest.approx(costs[0], abs=1e-9)
    path = tree.path[tree.best][-count:].tolist()
    assert path_cost(looks, path, turning, WIDE) == pytest.approx(costs[0], abs=1e-9)


@given(st.integers(0, 10_000), turnings)
@settings(deadline=None, max_examples=20)
def test_what_is_dropped_could_never_have_become_cheapest(seed: int, turning: SpinPrior) -> None:
    """Bounds as shipped: with few hypotheses nothing but hopeless paths is dropped."""
    looks = random_looks(seed, 6, 2)
    s = TreeSettings()
    assert grow(looks, turning, s).total == pytest.approx(cheapest(looks, turning, s)[0], abs=1e-9)


@given(st.integers(0, 1000))
@settings(deadline=None, max_examples=8)
def test_memory_is_bounded_whatever_is_hypothesised(seed: int) -> None:
    s = TreeSettings()
    tree = empty_tree(s)
    for time, hs in random_looks(seed, 300, 12):
        level = levels_of(hs, time, s)[hs[0].name] if hs else None
        assert level is None or len(level.views) <= s.most_hypotheses
        tree = extended_tree(tree, level, time, SpinPrior(), s)
        assert len(tree.cost) <= s.most_paths
        assert tree.path.shape == (len(tree.cost), s.lag)
        assert tree.cost.min() == 0.0
        assert tree.cost.max() <= s.jump


def steady(views: Sequence[int], similarity: float = 0.8, every: float = 0.2) -> list[Look]:
    """An object that stands still; view 0 is right, others lie far off."""
    sides = {0: (1.0, 0.0, 0.0), 1: (0.0, 1.0, 0.0), 2: (-1.0, 0.0, 0.0)}
    return [
        (k * every, (Hypothesis(1, "m", v, similarity, 0.0, direction=sides[v]),))
        for k, v in enumerate(views)
    ]


def test_a_wrong_hypothesis_now_and_then_does_not_change_the_view() -> None:
    s = TreeSettings()
    tree = grow(steady([0, 0, 0, 1, 0, 0, 2, 0, 0]), SpinPrior(), s)
    assert tree.view[tree.best] == 0
    assert tree.path[tree.best].tolist()[-9:] == [0, 0, 0, NONE, 0, 0, NONE, 0, 0]
    assert tree.since[tree.best] == 0.0
    assert tree.total == pytest.approx(2 * s.wrong)


def test_an_object_that_did_turn_is_believed_after_a_while() -> None:
    tree = grow(steady([0, 0, 0, 0, 1, 1, 1, 1, 1, 1]), SpinPrior(), TreeSettings())
    assert tree.view[tree.best] == 1
    assert tree.since[tree.best] == pytest.approx(4 * 0.2)


def test_looks_in_quick_succession_count_no_more_than_slow_ones() -> None:
    s = TreeSettings()
    slow = grow(steady([0, 1, 0, 1, 0], every=0.2), SpinPrior(), s).total
    quick = grow(
        steady([0] * 5 + [1] * 5 + [0] * 5 + [1] * 5 + [0] * 5, every=0.04), SpinPrior(), s
    )
    assert quick.total == pytest.approx(slow, rel=0.25)


def test_a_quick_turn_is_followed_when_the_spin_is_believed() -> None:
    """At 120 degrees a second these looks lie 72 degrees apart: without the spin each is a jump."""
    s = TreeSettings()
    home = Rotation.from_euler("xyz", [0.4, 0.3, -0.8])
    looks = []
    for k in range(12):
        seen = Rotation.from_rotvec([0, radians(72) * k, 0]) * home
        direction, roll = views(seen.as_matrix())
        x, y, z = direction.tolist()
        told = Hypothesis(1, "m", k, 0.8, float(roll), direction=(x, y, z))
        looks.append((0.6 * k, (told,)))
    assert grow(looks, SpinPrior((0.0, radians(120), 0.0), 0.09), s).total < 0.01
    assert grow(looks, SpinPrior(sigma=0.2), s).total > 11 * s.wrong / 2


def test_the_other_side_of_a_symmetric_object_is_kept_as_a_rival() -> None:
    s = TreeSettings()
    twins = [
        (
            0.2 * k,
            (
                Hypothesis(1, "m", 0, 0.80, 0.0, direction=(1.0, 0.0, 0.0)),
                Hypothesis(1, "m", 1, 0.79, 0.0, direction=(-1.0, 0.0, 0.0)),
            ),
        )
        for k in range(4)
    ]
    tree = grow(twins, SpinPrior(), s)
    assert tree.view[tree.best] == 0
    assert 0 < rival_gap(tree, s) < 1
    assert rival_gap(grow(steady([0, 0, 0, 0]), SpinPrior(), s), s) == s.jump


def test_between_two_views_lies_what_both_tell() -> None:
    s = TreeSettings()
    sides = [(1.0, 0.0, 0.0), (np.cos(0.3), np.sin(0.3), 0.0)]
    said = [Hypothesis(1, "m", k, 0.8, 0.0, direction=d) for k, d in enumerate(sides)]
    level = levels_of(said, 0.0, s)["m"]
    told = -level.between[0][2]
    assert degrees(np.arctan2(told[1], told[0])) == pytest.approx(degrees(0.15), abs=0.01)
    better = levels_of([said[0], replace(said[1], similarity=0.6)], 0.0, s)["m"]
    assert np.arctan2(*(-better.between[0][2])[[1, 0]]) < 0.02


@pytest.mark.parametrize("apart_deg", [14.0, 20.0, 27.0, 33.0])
def test_between_views_that_stand_wider_apart_greater_differences_tell_as_much(
    apart_deg: float,
) -> None:
    """Similarity falls with the square of the angle: what lies between is told in the same proportion."""
    s, apart = TreeSettings(), np.radians(apart_deg)
    lower = 0.8 - 0.03 * (apart_deg / 20.0) ** 2
    said = [
        Hypothesis(1, "m", 0, 0.8, 0.0, direction=(1.0, 0.0, 0.0)),
        Hypothesis(1, "m", 1, lower, 0.0, direction=(np.cos(apart), np.sin(apart), 0.0)),
    ]
    told = -levels_of(said, 0.0, s)["m"].between[0][2]
    assert np.arctan2(told[1], told[0]) / apart == pytest.approx(0.378, abs=0.02)
