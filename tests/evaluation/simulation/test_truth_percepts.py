"""Percepts made from truth err as they are asked to, and no more."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from visup.agent import Observation
from visup.agent.model.orientation import orientations, swing_and_roll
from visup.evaluation.simulation.percepts import Dropouts, PerceptNoise, observations_of
from visup.evaluation.simulation.truth_masks import Mission, TrueMask, true_mask

CLEAN = PerceptNoise(contour_px=0.0, missing=0.0, wrong=0.0, velocity=0.0, depth=0.0)
FRAMES, COUPLED = 250, 150
SimulatedRun = list[tuple[Observation, dict[int, tuple[str, ...]]]]


def mask_at(x: int, y: int, width: int = 60, height: int = 40) -> TrueMask:
    image = np.zeros((240, 320), bool)
    image[y : y + height, x : x + width] = True
    mask = true_mask(image)
    assert mask is not None
    return mask


@cache
def mission() -> Mission:
    """A box of known orientation that turns, and an arm of none that meets it."""
    turns = Rotation.from_rotvec(np.radians(2.0) * np.arange(FRAMES)[:, None] / 25 * [[0, 1, 0]])
    rows, masks = [], []
    for k, quat in enumerate(turns.as_quat().tolist()):
        left = 100 - max(0, COUPLED - k) // 5
        box = {"visible_px": 2400, "bbox": [161, 100, 60, 40], "range_m": 20.0, "quat_xyzw": quat}
        arm = {"visible_px": 2400, "bbox": [left, 100, 60, 40]}
        rows.append({"index": k, "box": box, "arm": arm})
        masks.append({"box": mask_at(161, 100), "arm": mask_at(left, 100)})
    truth = {
        "size": [320, 240],
        "fps": 25,
        "labels": {"box": 1, "arm": 2},
        "meshes": {"box": "sat", "arm": "rms"},
        "events": [{"kind": "coupled", "objects": ["arm", "box"], "frame": COUPLED}],
        "frames": rows,
    }
    return Mission("made", {"fov_vertical_deg": 40.0}, truth, tuple(masks))


@cache
def simulated_run(noise: PerceptNoise) -> SimulatedRun:
    return list(observations_of(mission(), noise))


def first_names(run: SimulatedRun) -> Counter[tuple[str, str]]:
    """(true name, name told first) -> how often."""
    counts: Counter[tuple[str, str]] = Counter()
    for observation, true_names in run:
        for region, names in true_names.items():
            hypotheses = [h for h in observation.of("hypothesis") if h.region_id == region]
            if hypotheses and len(names) == 1:
                model = str(mission().truth["meshes"][names[0]])
                counts[model, max(hypotheses, key=lambda h: h.similarity).name] += 1
    return counts


def test_without_noise_percepts_equal_the_truth() -> None:
    run = simulated_run(CLEAN)
    assert len(run) == FRAMES
    assert all(len(true_names) == 2 for _, true_names in run)
    assert set(first_names(run)) == {("sat", "sat"), ("rms", "rms")}
    for observation, true_names in run:
        for region in observation.of("region"):
            assert region.area == pytest.approx(2400, rel=0.02)
            assert len(true_names[region.id]) == 1


@pytest.mark.parametrize("missing", [0.0, 0.15, 0.5])
def test_dropouts_have_the_requested_rate_and_length(missing: float) -> None:
    dropouts = Dropouts(
        PerceptNoise(missing=missing, in_bursts=1.0), 0.04, np.random.default_rng(1)
    )
    missing_frames = np.array([dropouts.missing() for _ in range(40_000)])
    assert missing_frames.mean() == pytest.approx(missing, abs=0.02)
    if missing:
        begins = np.count_nonzero(missing_frames[1:] & ~missing_frames[:-1])
        assert 0.04 * missing_frames.sum() / begins == pytest.approx(0.2, rel=0.1)


def test_missing_and_wrong_reports_have_the_requested_rates() -> None:
    runs = [simulated_run(replace(CLEAN, missing=0.15, wrong=0.3, seed=seed)) for seed in range(6)]
    missing = np.mean([2 - len(true_names) for run in runs for _, true_names in run]) / 2
    assert missing == pytest.approx(0.15, abs=0.05)
    counts = sum((first_names(run) for run in runs), Counter[tuple[str, str]]())
    correct = sum(n for (true, first_name), n in counts.items() if true == first_name)
    assert 1 - correct / counts.total() == pytest.approx(0.3, abs=0.06)


def test_several_views_are_reported_of_an_oriented_object_the_best_near_its_orientation() -> None:
    angles, counts = [], []
    for observation, true_names in simulated_run(CLEAN):
        (box,) = (r for r, names in true_names.items() if names == ("box",))
        hypotheses = [
            h for h in observation.of("hypothesis") if h.region_id == box and h.name == "sat"
        ]
        if not hypotheses:
            continue
        counts.append(len(hypotheses))
        quat = mission().truth["frames"][observation.frame_index]["box"]["quat_xyzw"]
        best = max(hypotheses, key=lambda h: h.similarity)
        orientation = orientations(best.direction or (1, 0, 0), best.rotation or 0.0)
        swing, _ = swing_and_roll(Rotation.from_quat(quat).as_matrix(), orientation)
        angles.append(np.degrees(swing))
    assert set(counts) == {3}
    # One in twenty is taken for its mirror image.
    assert np.median(angles) < 25.0
    assert np.mean(np.array(angles) > 90.0) < 0.25


def test_outline_errors_have_the_requested_size() -> None:
    areas = [
        r.area for o, _ in simulated_run(replace(CLEAN, contour_px=2.0)) for r in o.of("region")
    ]
    # Two pixels along an outline of 200, alike over some 15: about a tenth of the area at most.
    assert 20 < np.std(areas) < 300


def test_percepts_depend_on_the_seed() -> None:
    noise = replace(CLEAN, missing=0.15, wrong=0.3)
    first, again, other = (
        [
            sorted(true_names.values())
            for _, true_names in observations_of(mission(), replace(noise, seed=s))
        ]
        for s in (1, 1, 2)
    )
    assert first == again != other


def test_regions_of_coupled_objects_merge_on_request() -> None:
    for observation, true_names in simulated_run(replace(CLEAN, merge_coupled=True)):
        coupled = observation.frame_index >= COUPLED
        assert sorted(true_names.values()) == (
            [("arm", "box")] if coupled else [("arm",), ("box",)]
        )
