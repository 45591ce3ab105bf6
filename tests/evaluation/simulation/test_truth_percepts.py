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
Seen = list[tuple[Observation, dict[int, tuple[str, ...]]]]


def mask_at(x: int, y: int, width: int = 60, height: int = 40) -> TrueMask:
    picture = np.zeros((240, 320), bool)
    picture[y : y + height, x : x + width] = True
    found = true_mask(picture)
    assert found is not None
    return found


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
def seen(noise: PerceptNoise) -> Seen:
    return list(observations_of(mission(), noise))


def first_names(found: Seen) -> Counter[tuple[str, str]]:
    """(true name, name told first) -> how often."""
    told: Counter[tuple[str, str]] = Counter()
    for observation, who in found:
        for region, names in who.items():
            said = [h for h in observation.of("hypothesis") if h.region_id == region]
            if said and len(names) == 1:
                model = str(mission().truth["meshes"][names[0]])
                told[model, max(said, key=lambda h: h.similarity).name] += 1
    return told


def test_without_noise_all_is_as_it_is() -> None:
    found = seen(CLEAN)
    assert len(found) == FRAMES
    assert all(len(who) == 2 for _, who in found)
    assert set(first_names(found)) == {("sat", "sat"), ("rms", "rms")}
    for observation, who in found:
        for region in observation.of("region"):
            assert region.area == pytest.approx(2400, rel=0.02)
            assert len(who[region.id]) == 1


@pytest.mark.parametrize("missing", [0.0, 0.15, 0.5])
def test_gaps_are_as_frequent_and_as_long_as_asked_for(missing: float) -> None:
    gaps = Dropouts(PerceptNoise(missing=missing, in_bursts=1.0), 0.04, np.random.default_rng(1))
    gone = np.array([gaps.missing() for _ in range(40_000)])
    assert gone.mean() == pytest.approx(missing, abs=0.02)
    if missing:
        begins = np.count_nonzero(gone[1:] & ~gone[:-1])
        assert 0.04 * gone.sum() / begins == pytest.approx(0.2, rel=0.1)


def test_as_many_are_missing_and_wrong_as_asked_for() -> None:
    runs = [seen(replace(CLEAN, missing=0.15, wrong=0.3, seed=seed)) for seed in range(6)]
    missing = np.mean([2 - len(who) for found in runs for _, who in found]) / 2
    assert missing == pytest.approx(0.15, abs=0.05)
    told = sum((first_names(found) for found in runs), Counter[tuple[str, str]]())
    right = sum(n for (true, said), n in told.items() if true == said)
    assert 1 - right / told.total() == pytest.approx(0.3, abs=0.06)


def test_several_views_are_told_of_what_has_an_orientation_and_the_best_is_near_it() -> None:
    angles, counts = [], []
    for observation, who in seen(CLEAN):
        (box,) = (r for r, names in who.items() if names == ("box",))
        said = [h for h in observation.of("hypothesis") if h.region_id == box and h.name == "sat"]
        if not said:
            continue
        counts.append(len(said))
        quat = mission().truth["frames"][observation.frame_index]["box"]["quat_xyzw"]
        best = max(said, key=lambda h: h.similarity)
        told = orientations(best.direction or (1, 0, 0), best.rotation or 0.0)
        swing, _ = swing_and_roll(Rotation.from_quat(quat).as_matrix(), told)
        angles.append(np.degrees(swing))
    assert set(counts) == {3}
    # One in twenty is taken for its mirror image.
    assert np.median(angles) < 25.0
    assert np.mean(np.array(angles) > 90.0) < 0.25


def test_outlines_err_as_much_as_asked_for() -> None:
    areas = [r.area for o, _ in seen(replace(CLEAN, contour_px=2.0)) for r in o.of("region")]
    # Two pixels along an outline of 200, alike over some 15: about a tenth of the area at most.
    assert 20 < np.std(areas) < 300


def test_the_same_seed_gives_the_same_and_another_another() -> None:
    noise = replace(CLEAN, missing=0.15, wrong=0.3)
    once, again, other = (
        [sorted(who.values()) for _, who in observations_of(mission(), replace(noise, seed=s))]
        for s in (1, 1, 2)
    )
    assert once == again != other


def test_coupled_objects_are_one_region_when_that_is_asked_for() -> None:
    for observation, who in seen(replace(CLEAN, merge_coupled=True)):
        together = observation.frame_index >= COUPLED
        assert sorted(who.values()) == ([("arm", "box")] if together else [("arm",), ("box",)])
