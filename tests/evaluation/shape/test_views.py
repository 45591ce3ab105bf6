"""The evaluation of view recognition: its queries, symmetries and figures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from visup.evaluation.shape.symmetry import angle_to, silhouette_symmetries
from visup.evaluation.shape.view_queries import (
    CONDITIONS,
    CUT_SHARE,
    SIZES,
    cut_by_border,
    draw_queries,
    rotated_and_scaled,
    with_contour_noise,
)

trimesh = pytest.importorskip("trimesh", reason="the extra visup[render] is not installed")
pytest.importorskip("embreex", reason="the extra visup[render] is not installed")

X, Y, Z = np.eye(3)


def wedge() -> Any:
    """A solid without any symmetry."""
    corners = [[0, 0, 0], [3, 0, 0], [0, 2, 0], [0.3, 0.4, 1.0]]
    return trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def test_a_solid_without_symmetry_has_none() -> None:
    assert len(silhouette_symmetries(wedge())) == 1


def test_a_cylinder_looks_the_same_from_all_sides() -> None:
    symmetries = silhouette_symmetries(trimesh.creation.cylinder(0.5, 3.0))
    for degrees in (10.0, 75.0, 160.0):
        direction = Rotation.from_rotvec(Z * np.radians(degrees)).apply(X)
        assert angle_to(direction, X, symmetries) < 3
    assert angle_to(Z, X, symmetries) == pytest.approx(90, abs=1)


def test_a_plane_of_symmetry_shows_the_same_from_the_other_side() -> None:
    """A wedge doubled at the plane x = 0: from -Sd it looks as from d."""
    half = wedge()
    other = half.copy()
    other.apply_transform(np.diag([-1.0, 1.0, 1.0, 1.0]))
    both = trimesh.util.concatenate([half, other])
    direction = np.array([0.3, 0.5, 0.81])
    direction /= np.linalg.norm(direction)
    seen_from = -direction * (-1, 1, 1)
    symmetries = silhouette_symmetries(both)
    assert angle_to(seen_from, direction, symmetries) < 1
    assert angle_to(direction * (-1, 1, 1), direction, symmetries) > 20


def test_a_box_turned_by_half_is_the_same() -> None:
    symmetries = silhouette_symmetries(trimesh.creation.box((1.0, 2.0, 3.0)))
    direction = np.array([0.6, 0.0, 0.8])
    for flip in ((-1, -1, 1), (1, -1, -1), (-1, 1, -1)):
        assert angle_to(direction * flip, direction, symmetries) < 1


def test_queries_have_the_requested_size_and_cut() -> None:
    queries = draw_queries("wedge", wedge(), 12, seed=3)
    for query in queries:
        assert set(query.masks) == set(CONDITIONS)
        assert np.linalg.norm(query.direction) == pytest.approx(1)
        clean, cut = query.masks["clean"], query.masks["cut"]
        rows, columns = np.nonzero(clean)
        longer = max(np.ptp(rows), np.ptp(columns)) + 1
        assert SIZES[0] - 3 <= longer <= SIZES[1] + 3
        assert cut.sum() / clean.sum() == pytest.approx(1 - CUT_SHARE, abs=0.04)
        assert any(side.any() for side in (cut[0], cut[-1], cut[:, 0], cut[:, -1]))
        assert not any(side.any() for side in (clean[0], clean[-1], clean[:, 0], clean[:, -1]))
    again = draw_queries("wedge", wedge(), 12, seed=3)
    assert all(
        np.array_equal(a.masks["both"], b.masks["both"])
        for a, b in zip(queries, again, strict=True)
    )
    other = draw_queries("wedge", wedge(), 12, seed=4)
    assert not np.allclose(queries[0].direction, other[0].direction)


def test_noise_displaces_a_straight_outline_by_its_sigma() -> None:
    """So does the height of a long edge, where displacements change slowly along it."""
    mask = np.zeros((200, 1200), dtype=bool)
    mask[100:] = True
    noisy = with_contour_noise(mask, 3.0, 12.0, np.random.default_rng(5))
    heights = noisy[:, 60:-60].sum(axis=0)
    assert float(heights.std()) == pytest.approx(3.0, rel=0.25)


def test_a_mask_that_noise_would_erase_is_kept() -> None:
    speck = np.zeros((20, 20), dtype=bool)
    speck[10, 10] = True
    assert with_contour_noise(speck, 8.0, 2.0, np.random.default_rng(0)).any()


@pytest.mark.parametrize("side", range(4))
def test_a_border_cuts_off_its_share(side: int) -> None:
    y, x = np.mgrid[-50:51, -50:51]
    disc = np.hypot(x, y) < 45
    cut = cut_by_border(disc, 0.3, side)
    assert cut.sum() / disc.sum() == pytest.approx(0.7, abs=0.02)


def test_rotation_is_clockwise() -> None:
    arrow = np.zeros((60, 60), dtype=bool)
    arrow[28:32, 5:55] = arrow[20:40, 45:55] = True
    rotated = rotated_and_scaled(arrow, np.pi / 2, 100.0)
    rows = np.flatnonzero(rotated.any(axis=1))
    thickness = rotated.sum(axis=1)
    assert thickness[rows[-8:]].mean() > 2 * thickness[rows[:8]].mean()


def test_plain_solids_are_recognised_with_all_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A ball, a rod and a plate are told apart; each figure is where the data's README says."""
    pytest.importorskip("mahotas", reason="the extra visup[eval] is not installed")
    from visup.evaluation.shape.view_recognition import evaluate_views

    for name, solid in {
        "ball": trimesh.creation.icosphere(3),
        "rod": trimesh.creation.cylinder(0.1, 3.0),
        "cross": trimesh.util.concatenate(
            [trimesh.creation.box((3, 0.3, 0.3)), trimesh.creation.box((0.3, 3, 0.5))]
        ),
    }.items():
        solid.export(tmp_path / f"{name}.ply")
    monkeypatch.setattr(
        "os.cpu_count", lambda: 1
    )  # processes take longer to start than these views
    figures = evaluate_views(tmp_path, views=8, queries=3, seed=1)
    total = figures["total"]
    assert set(figures["items"]) == {"ball", "rod", "cross"}
    assert total["clean"]["top1"] >= 8 / 9
    assert total["clean"]["top5"] == 1.0
    assert set(total["baseline"]) == {"zernike", "fourier"}
    assert total["ms_query"] > 0
    assert total["clean"]["known_told"] > total["clean"]["stranger_told"]
    assert 0 < total["compared"] <= 1.0
    assert total["build_views_per_s"] > 0
    assert figures["items"]["ball"]["clean"]["angle_deg"] < 90
