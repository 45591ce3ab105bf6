"""The traffic that a long run is measured on is traffic, and its figures say what they should."""

from __future__ import annotations

from visup.evaluation.runtime.scripted_observations import FPS, SIZE
from visup.evaluation.runtime.traffic import LANES, evaluate_traffic, traffic


def test_each_car_enters_passes_and_leaves_under_its_own_id() -> None:
    observations = list(traffic(int(20 * FPS)))
    tracks: dict[int, list[float]] = {}
    for observation in observations:
        regions = observation.of("region")
        assert len(regions) <= 3 * LANES
        for region in regions:
            x, _, w, h = region.bbox
            assert x >= 0
            assert x + w <= SIZE[0]
            assert region.mask.shape == (h, w)
            tracks.setdefault(region.id, []).append(region.centroid[0])
    complete = [xs for number, xs in tracks.items() if number <= 2 * LANES]
    assert all(xs == sorted(xs) and xs[0] < 30 and xs[-1] > SIZE[0] - 30 for xs in complete)
    assert len(tracks) == LANES * 7  # one each 2.9 s and lane


def test_traffic_is_deterministic() -> None:
    first, second = (
        [(r.id, r.bbox, int(r.area)) for o in traffic(60) for r in o.of("region")] for _ in range(2)
    )
    assert first == second


def test_figures_of_a_short_run() -> None:
    total = evaluate_traffic(0.003)["total"]
    assert 3000 < total["objects_per_hour"] < 4500
    assert 20 < total["journal_mb_per_hour"] < 600
    assert total["grown"] < 0.2
