"""Compiled loops against the slow way to say the same."""

from collections.abc import Callable
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.compiled import compiled
from visup.percepts.motion.features._motion_constraints_jit import (
    strongest_gradients,
    structure_tensors,
)
from visup.percepts.motion.features._superpixels_jit import bayes_shares
from visup.percepts.motion.layers._affine_jit import (
    log_likelihoods,
    median,
    quantile,
    reweighted_least_squares,
    squared_misfits,
)
from visup.percepts.motion.outlines.region_outline import chosen, label_areas, marked, renumbered
from visup.percepts.motion.static_camera._background_model_jit import has_exposure
from visup.percepts.motion.static_camera._slow_motion_jit import squared_difference
from visup.percepts.motion.static_camera._templates_jit import best_shift
from visup.percepts.motion.static_camera.background_model import (
    EVEN,
    FAR,
    NOISE,
    RARE,
    SETTLE_S,
    SLOWLY,
    BackgroundModel,
    update_background,
)

SHAPE = (13, 17)


def some_information(rng: np.random.Generator, n: int) -> NDArray[np.float32]:
    root = rng.normal(0, 3, (n, 2, 2))
    both = root @ root.transpose(0, 2, 1) + 0.01 * np.eye(2)
    return np.stack([both[:, 0, 0], both[:, 0, 1], both[:, 1, 1]], axis=1).astype(np.float32)


def matrices(information: NDArray[np.float32]) -> NDArray[np.float64]:
    a, b, c = information.T.astype(np.float64)
    return np.stack([a, b, b, c], axis=1).reshape(-1, 2, 2)


@given(st.integers(0, 999), st.floats(0, 2))
@settings(deadline=None, max_examples=20)
def test_misfits_are_distances_under_the_covariance_of_both(seed: int, slack: float) -> None:
    rng = np.random.default_rng(seed)
    xy, moved = rng.random((2, 20, 2)).astype(np.float32) * np.float32(9)
    information = some_information(rng, 20)
    matrix, bend = rng.normal(0, 0.1, (2, 3)), rng.normal(0, 0.1, (2, 3))
    x, y = xy.T.astype(np.float64)
    at = matrix @ [x, y, np.ones(20)] + bend @ [x * x, x * y, y * y] / 1000
    error = at.T - moved
    own = matrices(information)
    both = np.linalg.inv(np.linalg.inv(own) + slack**2 * np.eye(2))
    expected = np.einsum("ni,nij,nj->n", error, both, error)
    found = squared_misfits(xy, moved, information, matrix, bend, slack)
    assert found == pytest.approx(expected, rel=2e-3, abs=1e-3)
    width = np.log(np.trace(both, axis1=1, axis2=2) / np.trace(own, axis1=1, axis2=2))
    told = log_likelihoods(xy, moved, information, matrix, bend, slack)
    assert told == pytest.approx(0.5 * width - 0.5 * expected, rel=2e-3, abs=2e-3)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_one_round_of_a_fit_solves_the_normal_equations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, k = 30, 3
    phi, moved = rng.normal(size=(n, k)), rng.normal(size=(n, 2)).astype(np.float32)
    information, hold = some_information(rng, n), np.array([1.0, 2.0, 0.1])
    weight = rng.random(n)
    start = np.zeros((n, 2), np.float32)
    model, w, _ = reweighted_least_squares(
        phi, moved, information, weight, start, hold, 1e-9, 1e6, 1
    )
    normal, right = np.diag(np.tile(hold, 2)), np.zeros(2 * k)
    for f, d, both, share in zip(phi, moved, matrices(information), weight, strict=True):
        rows = np.kron(np.eye(2), f)
        normal += share * rows.T @ both @ rows
        right += share * rows.T @ both @ d
    assert w == pytest.approx(weight, rel=1e-3)
    assert model.ravel() == pytest.approx(np.linalg.solve(normal, right), rel=1e-3, abs=1e-6)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=20)
def test_the_picture_learns_pixel_by_pixel_as_it_does_image_by_image(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mean, other, image = rng.integers(90, 130, (3, *SHAPE, 3)).astype(np.float32)
    variance, seen, other_s = (rng.random((3, *SHAPE)) * 9).astype(np.float32)
    variance += np.float32(NOISE**2)
    seen[rng.random(SHAPE) < 0.2] = 0
    moving, gone, things = rng.random((3, *SHAPE)) < 0.3
    seconds = float(rng.random()) + 0.01
    known = BackgroundModel(mean, variance, seen, other, other_s)
    expected = slowly_learnt(known, image, (moving, gone, things), seconds)
    update_background(known, image, moving, seconds, gone, things)
    for f in fields(known):
        assert np.allclose(getattr(known, f.name), getattr(expected, f.name), atol=1e-3), f.name


@given(st.integers(0, 999), st.floats(0.9, 1.1))
@settings(deadline=None, max_examples=30)
def test_exposure_that_is_told_to_be_even_has_an_even_median(seed: int, gain: float) -> None:
    rng = np.random.default_rng(seed)
    mean = rng.integers(0, 250, (*SHAPE, 3)).astype(np.float32)
    image = (gain * mean + rng.normal(0, 2, mean.shape)).astype(np.float32)
    ratio = (image[::4, ::4] + 1) / (mean[::4, ::4] + 1)
    off = np.abs(np.median(ratio, axis=(0, 1)) - 1).max()
    if has_exposure(image, mean, 4, EVEN):
        assert off < EVEN
    if abs(gain - 1) > 0.06:
        assert not has_exposure(image, mean, 4, EVEN)


def slowly_learnt(
    known: BackgroundModel,
    image: NDArray[np.float32],
    covered: tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]],
    seconds: float,
) -> BackgroundModel:
    """What `update_background` says, with whole images."""
    moving, gone, things = covered
    off = ((image - known.mean) ** 2).sum(axis=2) / (3 * known.variance)
    told = known.seen_s > 0
    fits = (off < FAR**2) & ~moving & told
    weight = np.maximum(seconds / (known.seen_s + seconds), 1 - np.exp(-seconds / SETTLE_S))
    mean = known.mean + np.where(fits, weight, 0)[..., None] * (image - known.mean)
    stir = np.where(moving, 0, 1 - np.exp(-seconds / 8.0)) * (np.minimum(off, RARE) - 1)
    variance = np.clip(known.variance * (1 + stir), NOISE**2, (8 * NOISE) ** 2)
    seen = np.minimum(known.seen_s + fits * seconds, 60.0)
    alike = ((image - known.other) ** 2).sum(axis=2) < 3 * (FAR * NOISE) ** 2
    away = ~fits & told
    lasted = np.where(things, SLOWLY, 1.0) * seconds
    other_s = np.where(away, np.where(alike, known.other_s + lasted, lasted), known.other_s)
    step = np.where(away, np.where(alike, 0.3, 1.0), 0)
    other = known.other + step[..., None] * (image - known.other)
    other = np.where(gone[..., None], image, other)
    enough = np.where(moving, 3 * known.seen_s, np.minimum(known.seen_s, 20.0)) + 0.2
    swap = (other_s > enough) | (gone & told)
    return BackgroundModel(
        np.where(swap[..., None], other, mean),
        np.where(swap, 2 * NOISE**2, variance),
        np.where(swap, other_s, seen),
        other,
        np.where(swap, 0, other_s),
    )


@given(st.integers(0, 999), st.integers(-4, 15), st.integers(-4, 11), st.integers(1, 2))
@settings(deadline=None, max_examples=20)
def test_a_template_is_found_where_it_costs_least(seed: int, x: int, y: int, step: int) -> None:
    rng = np.random.default_rng(seed)
    image = (rng.random((*SHAPE, 3)) * 255).astype(np.float32)
    free = rng.random(SHAPE).astype(np.float32)
    shape, tone = rng.random((5, 6)) < 0.7, (rng.random((5, 6, 3)) * 255).astype(np.float32)
    costs = {}
    for dy in range(-3, 4):
        for dx in range(-3, 4):
            top, left = max(-y - dy, 0), max(-x - dx, 0)
            each = []
            for j in range(top, 5, step):
                for i in range(left, 6, step):
                    v, u = y + dy + j, x + dx + i
                    if shape[j, i] and v < SHAPE[0] and u < SHAPE[1]:
                        gap = min(float(np.abs(image[v, u] - tone[j, i]).mean()), 60.0)
                        each.append(60 - (60 - gap) * free[v, u])
            if each:
                costs[dx, dy] = np.mean(each) + 0.5 * np.hypot(dx, dy)
    cost, dx, dy = best_shift(image, free, shape, tone, (x, y), 3, step)
    if not costs:
        assert (cost, dx, dy) == (np.inf, 0, 0)
        return
    assert cost == pytest.approx(min(costs.values()), rel=1e-5)
    assert costs[dx, dy] == pytest.approx(cost, rel=1e-5)


@given(st.integers(0, 999))
@settings(deadline=None, max_examples=10)
def test_points_are_the_steepest_of_their_squares(seed: int) -> None:
    gx, gy = np.random.default_rng(seed).normal(size=(2, 24, 33)).astype(np.float32)
    xs, ys, values = strongest_gradients(gx, gy, 8, 3)
    slope = gx * gx + gy * gy
    counts = np.zeros_like(slope)
    counts[3:-3, 3:-3] = slope[3:-3, 3:-3]
    for n, (x, y, value) in enumerate(zip(xs, ys, values, strict=True)):
        top, left = n // 4 * 8, n % 4 * 8
        assert value == counts[top : top + 8, left : left + 8].max()
        assert value == counts[y, x]
    wide = [np.pad(a * b, 5, mode="reflect") for a, b in ((gx, gx), (gx, gy), (gy, gy))]
    expected = [
        [w[y : y + 11, x : x + 11].sum() for w in wide] for x, y in zip(xs, ys, strict=True)
    ]
    assert structure_tensors(gx, gy, xs, ys, 11) == pytest.approx(
        np.array(expected), rel=1e-3, abs=1e-3
    )


def test_where_nothing_can_be_kept_loops_are_compiled_all_the_same() -> None:
    made: dict[str, Callable[[float], float]] = {}
    exec("def twice(value):\n    return 2.0 * value", made)  # no file, so nowhere to keep it
    assert compiled(made["twice"])(4.0) == 8.0


@given(st.integers(0, 999), st.integers(1, 40))
@settings(deadline=None, max_examples=25)
def test_medians_and_quantiles_are_those_of_numpy(seed: int, count: int) -> None:
    values = np.random.default_rng(seed).normal(0, 9, count).astype(np.float32)
    assert median(values) == np.median(values)
    assert quantile(values, 0.7) == pytest.approx(np.quantile(values, 0.7), rel=1e-5, abs=1e-5)


@given(st.integers(0, 999), st.integers(2, 6))
@settings(deadline=None, max_examples=15)
def test_shares_are_priors_times_likelihoods(seed: int, kinds: int) -> None:
    rng = np.random.default_rng(seed)
    number = rng.integers(0, 4, 12).astype(np.float64)
    totals = rng.normal(0, 3, (12, kinds)) * (number > 0)[:, None]
    more = (rng.normal(0, 2, (12, kinds)) * (rng.random(12) < 0.5)[:, None]).astype(np.float32)
    prior = rng.dirichlet(np.ones(kinds), 12).astype(np.float32)
    share, weight = bayes_shares(totals, number, more, prior, 0.03, 5.0)
    logs = totals / np.sqrt(np.maximum(number, 1))[:, None] + more
    logs -= logs.max(axis=1, keepdims=True)
    expected = (prior + 0.03) * np.exp(np.maximum(logs, -10))
    assert share == pytest.approx(expected / expected.sum(axis=1, keepdims=True), abs=1e-5)
    told = (number > 0) | (more != 0).any(axis=1)
    assert weight == pytest.approx(np.minimum(-logs.min(axis=1), 5) / 5 * told, abs=1e-5)


@given(st.integers(0, 999), st.integers(1, 6))
@settings(deadline=None, max_examples=20)
def test_labels_are_counted_chosen_marked_and_renumbered_as_numpy_does_it(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, count, SHAPE).astype(np.int32)
    keep, number = rng.random(count) < 0.5, rng.integers(0, 9, count).astype(np.int32)
    where = rng.random(SHAPE) < 0.1
    number[0] = 0  # by the contract of `renumbered`
    touched = np.isin(np.arange(count), labels[where]) & (np.arange(count) > 0)
    assert np.array_equal(label_areas(labels, count), np.bincount(labels.ravel(), minlength=count))
    assert np.array_equal(chosen(labels, keep), keep[labels])
    assert np.array_equal(marked(labels, where, count), touched)
    assert np.array_equal(renumbered(labels, number), number[labels])


@given(st.integers(0, 999), st.floats(0.5, 2))
@settings(deadline=None, max_examples=20)
def test_differences_are_squared_at_the_same_exposure(seed: int, exposure: float) -> None:
    now, old = np.random.default_rng(seed).integers(0, 256, (2, *SHAPE)).astype(np.uint8)
    gap = now - old.astype(np.float32) * np.float32(exposure)
    assert np.array_equal(squared_difference(now, old, np.float32(exposure)), gap * gap)
