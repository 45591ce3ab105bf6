"""What must not matter does not: where, how large, and how turned a silhouette is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.shape.shapes import FLOWERS, LIMBS, ZOO, flower, limbs, shape
from visup.percepts.shape.matching.graph_matching import match_graphs
from visup.percepts.shape.matching.shape_similarity import compare_shapes
from visup.percepts.shape.silhouette.silhouette import normalise

FEW = settings(max_examples=12, deadline=None)
Lobes = tuple[tuple[int, float], ...]


@FEW
@given(FLOWERS, st.integers(0, 80), st.integers(0, 80))
def test_similarity_is_invariant_to_translation(lobes: Lobes, dx: int, dy: int) -> None:
    mask = flower(lobes, size=40)
    moved = np.pad(mask, ((dy, 3), (dx, 5)))
    here, there = normalise(mask), normalise(moved)
    assert here is not None
    assert there is not None
    np.testing.assert_allclose(here.contour, there.contour, atol=1e-9)
    assert there.origin == pytest.approx((here.origin[0] + dx, here.origin[1] + dy), abs=1e-6)


@FEW
@given(LIMBS, st.floats(0, 2 * np.pi))
def test_rotation_hardly_changes_a_shape(angles: tuple[float, ...], turn: float) -> None:
    terms = compare_shapes(shape(limbs(angles)), shape(limbs(angles, turn=turn)))
    assert terms.outline_similarity > 0.93
    # Where limbs are alike, noise decides which hangs below which; the graph bears it.
    assert terms.graph_similarity > 0.8
    assert terms.similarity > 0.9


@FEW
@given(FLOWERS, st.floats(30, 200))
def test_scale_hardly_changes_a_shape(lobes: Lobes, size: float) -> None:
    terms = compare_shapes(shape(flower(lobes, size=60)), shape(flower(lobes, size=size)))
    assert terms.similarity > 0.8


@FEW
@given(FLOWERS)
def test_a_shape_matches_its_mirror_image(lobes: Lobes) -> None:
    mask = flower(lobes)
    assert compare_shapes(shape(mask), shape(mask[:, ::-1])).similarity > 0.85


@FEW
@given(FLOWERS, LIMBS)
def test_similarity_is_symmetric_and_between_0_and_1(
    lobes: Lobes, angles: tuple[float, ...]
) -> None:
    a, b = shape(flower(lobes)), shape(limbs(angles))
    assert compare_shapes(a, b).similarity == compare_shapes(b, a).similarity
    assert 0.0 <= compare_shapes(a, b).similarity <= 1.0
    assert match_graphs(a.graph, b.graph).similarity == match_graphs(b.graph, a.graph).similarity


@pytest.mark.parametrize("name", sorted(ZOO))
def test_a_shape_has_similarity_1_with_itself_and_less_with_others(name: str) -> None:
    own = shape(ZOO[name])
    assert compare_shapes(own, own).similarity == pytest.approx(1.0, abs=1e-6)
    for other in sorted(set(ZOO) - {name}):
        assert compare_shapes(own, shape(ZOO[other])).similarity < 0.75


def test_growing_damage_lowers_the_similarity() -> None:
    whole = limbs((0.3, 1.2, 2.0, 4.0))
    own = shape(whole)
    found = []
    for share in (0.0, 0.15, 0.3, 0.45):
        damaged = whole.copy()
        rows = np.flatnonzero(whole.any(axis=1))
        damaged[rows[0] : rows[0] + int(share * len(rows))] = False
        found.append(compare_shapes(own, shape(damaged)))
    for similarities in ([f.similarity for f in found], [f.graph_similarity for f in found]):
        assert similarities == sorted(similarities, reverse=True)
        assert similarities[-1] < similarities[0] - 0.1


def test_holes_and_islands_do_not_change_graph_and_outline() -> None:
    mask = ZOO["clover"].copy()
    clean = shape(mask)
    mask[130:136, 130:136] = False
    mask[2:6, 2:6] = True
    seen = compare_shapes(clean, shape(mask))
    assert seen.graph_similarity == pytest.approx(1.0, abs=1e-6)
    assert seen.outline_similarity == pytest.approx(1.0, abs=1e-6)
    # The map of the area shows them, for what they are: a thousandth of it, to the eighth power.
    assert 1 - seen.area_similarity < 0.01


@pytest.mark.parametrize(
    "mask",
    [
        np.zeros((40, 40), bool),
        np.zeros((0, 0), bool),
        np.eye(3, dtype=bool),
        np.pad(np.ones((1, 1), bool), 20),
    ],
    ids=["empty", "no pixels", "three pixels", "one pixel"],
)
def test_an_empty_mask_has_no_shape(mask: np.ndarray) -> None:
    assert normalise(mask) is None


@pytest.mark.parametrize(
    "mask",
    [
        np.ones((50, 50), bool),
        np.ones((1, 400), bool),
        np.ones((400, 2), bool),
        np.indices((64, 64)).sum(axis=0) % 2 == 0,
        np.random.default_rng(0).random((80, 80)) < 0.5,
        np.random.default_rng(1).random((80, 80)) < 0.7,
        np.eye(200, dtype=bool),
    ],
    ids=["full", "row", "column", "checkerboard", "noise", "dense noise", "diagonal"],
)
def test_degenerate_masks_never_raise(mask: np.ndarray) -> None:
    silhouette = normalise(mask)
    if silhouette is not None:
        own = shape(mask)
        assert np.isfinite(own.contour).all()
        assert own.graph.weights.sum() == pytest.approx(1.0, abs=1e-4)
        assert compare_shapes(own, own).similarity == pytest.approx(1.0, abs=1e-6)


@settings(max_examples=15, deadline=None)
@given(st.floats(-3.1, 3.1))
def test_mirror_images_are_distinguished_on_request(turn: float) -> None:
    """A body with limbs to one side only is not its mirror image, however it is turned."""
    angles = (0.3, 1.2, 2.9)
    own, image = shape(limbs(angles)), shape(limbs(angles, turn=turn)[:, ::-1])
    either, strict = compare_shapes(own, image), compare_shapes(own, image, mirror=False)
    assert either.mirrored
    assert not strict.mirrored
    assert either.similarity > 0.9
    assert strict.similarity < either.similarity - 0.1
    again = compare_shapes(own, shape(limbs(angles, turn=turn)), mirror=False)
    assert again.similarity > 0.9


@settings(max_examples=40, deadline=None)
@given(st.one_of(st.integers(1, 600), st.integers(4000, 8192)), st.integers(1, 2), st.booleans())
def test_a_line_has_a_finite_outline_or_none(length: int, width: int, upright: bool) -> None:
    mask = np.zeros((width + 2, length + 2), dtype=bool)
    mask[1:-1, 1:-1] = True
    found = normalise(mask.T if upright else mask)
    if found is not None:
        assert np.isfinite(found.contour).all()
        assert np.ptp(found.contour, axis=0).min() > 0
