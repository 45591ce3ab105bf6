"""Many views: sketches and the index against plain loops, deformation, and the measure of scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracles.shape.augment import augmented, deformed
from tests.oracles.shape.scale import evaluate_scale, noisy
from tests.percepts.shape.shapes import FLOWERS, LIMBS, ZOO, flower, limbs, shape, small_database
from visup.agent.model.errors import SettingsError
from visup.percepts.shape.database.model_database import CANDIDATES, ModelDatabase
from visup.percepts.shape.database.time_budget import SEARCH_MS, SHAPE_MS, VIEW_MS
from visup.percepts.shape.index.outline_sketch import POINTS, sketch, sketch_distances, spectra
from visup.percepts.shape.index.view_index import ViewIndex, ViewSummaries
from visup.percepts.shape.matching.shape_similarity import Shape, compare_shapes


def brute_force_distance(a: np.ndarray, b: np.ndarray) -> float:
    """Distance of two sketches by a plain loop."""
    a, b = a / 127.0, b / 127.0
    sides = (b, b[::-1, ::-1])
    squares = [((a - np.roll(s, k, axis=0)) ** 2).mean() for s in sides for k in range(POINTS)]
    varied = a.std(axis=0).mean() + b.std(axis=0).mean()
    return float(np.sqrt(min(squares)) / (0.2 + varied))


@settings(max_examples=10, deadline=None)
@given(FLOWERS, LIMBS)
def test_sketch_distances_agree_with_a_plain_loop(
    lobes: tuple[tuple[int, float], ...], angles: tuple[float, ...]
) -> None:
    a, b = (sketch(shape(m).heights) for m in (flower(lobes), limbs(angles)))
    found = sketch_distances(a, np.stack([a, b]))
    assert found == pytest.approx([0.0, brute_force_distance(a, b)], abs=2e-3)


@settings(max_examples=10, deadline=None)
@given(LIMBS, st.integers(0, POINTS - 1), st.booleans())
def test_a_spectrum_does_not_depend_on_where_a_sketch_starts(
    angles: tuple[float, ...], start: int, mirrored: bool
) -> None:
    one = sketch(shape(limbs(angles)).heights)
    other = np.roll(one[::-1, ::-1] if mirrored else one, start, axis=0)
    a, b = spectra(np.stack([one, other]))
    np.testing.assert_allclose(a, b, atol=1e-5)


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> ModelDatabase:
    folder = tmp_path_factory.mktemp("scale")
    return augmented(small_database(folder / "zoo.db"), folder / "many.db", 800, seed=3)


def test_deformed_views_are_the_same_for_a_seed_and_unlike_their_source() -> None:
    source = shape(ZOO["walker"])
    one, again, other = (deformed(source, 3, k) for k in (7, 7, 8))
    assert compare_shapes(one, again).similarity == 1.0
    assert compare_shapes(one, other).similarity < 0.99
    assert compare_shapes(one, source).similarity < 0.99
    assert one.graph.weights.sum() == pytest.approx(1.0, abs=1e-4)


def test_the_index_keeps_the_best_match_of_exhaustive_search(many: ModelDatabase) -> None:
    queries = [limbs((0.3, 1.2, 2.0, 4.1)), flower(((5, 0.3),)), flower(((3, 0.35), (1, 0.1)))]
    for mask in queries:
        query = shape(mask)
        found, every = (many.query(query, top=1, budget=b) for b in (0.1, 1.0))
        assert every.compared == len(many.views)
        assert found.compared < 0.1 * len(many.views)
        assert found.matches[0].similarity == pytest.approx(every.matches[0].similarity, abs=0.02)


def test_summaries_in_the_file_are_those_of_the_shapes(many: ModelDatabase) -> None:
    shapes = many.shapes[:40]
    rows = many.views.records[:40]
    fresh = ViewSummaries.of(shapes)
    np.testing.assert_array_equal(rows["root"], fresh.roots)
    # Outlines are stored in half precision.
    assert np.abs(rows["sketch"].astype(int) - fresh.sketches).max() <= 2


def test_only_candidates_are_read(many: ModelDatabase) -> None:
    read: set[int] = set()

    class Reads(list[Shape]):
        def __getitem__(self, key: object) -> Shape:  # type: ignore[override]
            read.add(int(key))  # type: ignore[call-overload]
            return many.shapes[int(key)]  # type: ignore[call-overload]

        def __len__(self) -> int:
            return len(many.views)

    rows = many.views.records
    shapes = Reads()
    index = ViewIndex(shapes, summaries=ViewSummaries.read(rows))
    found = index.candidates(shape(ZOO["star"]), None, 20)
    assert read == set(found.numbers.tolist())
    assert len(read) == 20


def test_a_time_budget_is_met_by_comparing_the_likeliest_views_first(
    many: ModelDatabase,
) -> None:
    asked = [shape(ZOO["walker"]), shape(ZOO["star"])]
    eight = SHAPE_MS + SEARCH_MS + 8 * VIEW_MS
    budgets = (0.0, len(asked) * eight + 0.1, 1000.0)
    rankings = [many.query_all(asked, budget_ms=ms, top=3) for ms in budgets]
    assert [r[0].compared for r in rankings] == [4, 8, CANDIDATES]
    for few, more in zip(rankings[0], rankings[-1], strict=True):
        assert few.matches[0].view == more.matches[0].view
    assert rankings[-1] == tuple(many.query(q, top=3) for q in asked)
    assert many.query_all([], budget_ms=5.0) == ()


def test_noise_moves_a_contour_by_about_as_much_as_asked() -> None:
    mask = flower(((3, 0.2),), size=60.0)
    moved = noisy(mask, 2.0, np.random.default_rng(0))
    assert 0.005 < (moved != mask).sum() / mask.sum() < 0.2


def test_growth_is_measured(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh", reason="views of meshes need the extra 'render'")
    trimesh.creation.box(extents=(1, 2, 3)).export(tmp_path / "box.ply")
    figures = evaluate_scale(tmp_path, most=200, jobs=1)
    first, second, largest = figures["items"].values()
    assert first["lost"] == 0.0
    assert 0.0 <= second["lost"] <= 0.5
    assert largest["open_ms"] > 0
    assert largest["compared"] < first["compared"]
    assert figures["total"]["slower"] > 0
    with pytest.raises(SettingsError, match="no meshes"):
        evaluate_scale(tmp_path / "nowhere")
