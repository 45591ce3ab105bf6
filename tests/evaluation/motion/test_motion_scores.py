from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.percepts.motion.clips import SIZE, clip, texture
from visup.agent.model.errors import SettingsError, SourceError
from visup.evaluation.motion.mask_scores import (
    MaskOverlaps,
    PixelCounts,
    boundary,
    boundary_measure,
    has_ghost,
    id_switches,
    object_scores,
    overlaps_of,
    region_similarity,
)
from visup.evaluation.motion.mot_scores import (
    box_distance,
    mot_scores,
    read_truth,
    truth_of_images,
)
from visup.evaluation.motion.runner import evaluate_motion, find_sequences

masks = arrays(bool, (14, 17))


def square(x: int, y: int, side: int = 20, size: tuple[int, int] = (60, 80)) -> np.ndarray:
    out = np.zeros(size, bool)
    out[y : y + side, x : x + side] = True
    return out


@given(masks, masks)
@settings(max_examples=60, deadline=None)
def test_j_is_symmetric_bounded_and_one_only_for_equal(a: np.ndarray, b: np.ndarray) -> None:
    all_scored = np.ones_like(a)
    j = region_similarity(a, b, all_scored)
    assert j is not None
    assert j == region_similarity(b, a, all_scored)
    assert 0 <= j <= 1
    assert (j == 1) == np.array_equal(a, b)


def test_j_by_hand_and_unscored_pixels() -> None:
    a, b = square(10, 10), square(20, 10)
    scored = np.ones_like(a)
    assert region_similarity(a, b, scored) == pytest.approx(200 / 600)
    scored[:, 30:] = False
    assert region_similarity(a, b, scored) == pytest.approx(200 / 400)
    assert region_similarity(a, b, np.zeros_like(a)) is None
    none = np.zeros_like(a)
    assert region_similarity(none, none, np.ones_like(a)) == 1
    assert region_similarity(a, none, np.ones_like(a)) == 0


def brute_force_f(predicted: np.ndarray, ground_truth: np.ndarray, tolerance_px: int) -> float:
    """The boundary measure by comparing every pair of boundary pixels."""
    a, b = np.argwhere(boundary(predicted)), np.argwhere(boundary(ground_truth))
    if len(a) == 0 or len(b) == 0:
        return float(len(a) == len(b))
    far = ((a[:, None] - b[None]) ** 2).sum(-1) > tolerance_px**2
    precision, recall = 1 - far.all(1).mean(), 1 - far.all(0).mean()
    return 2 * precision * recall / (precision + recall) if precision + recall else 0.0


@given(masks, masks)
@settings(max_examples=60, deadline=None)
def test_f_agrees_with_brute_force(a: np.ndarray, b: np.ndarray) -> None:
    tolerance_px = int(np.ceil(0.05 * np.hypot(*a.shape)))
    assert boundary_measure(a, b, 0.05) == pytest.approx(brute_force_f(a, b, tolerance_px))


def test_f_tolerates_an_error_of_one_pixel_but_not_of_ten() -> None:
    assert boundary_measure(square(10, 10), square(10, 10)) == 1
    assert boundary_measure(square(10, 10), square(11, 10)) == 1
    assert boundary_measure(square(10, 10), square(20, 20, 30)) < 0.5


@given(st.lists(st.tuples(masks, masks, masks), min_size=1, max_size=4))
def test_the_f_measure_counts_all_scored_pixels_together(
    frames: list[tuple[np.ndarray, np.ndarray, np.ndarray]],
) -> None:
    counts = PixelCounts()
    for predicted, ground_truth, scored in frames:
        counts = counts.with_frame(predicted, ground_truth, scored)
    predicted, ground_truth, scored = (
        np.concatenate([f[k].ravel() for f in frames]) for k in range(3)
    )
    positive, actual = predicted[scored], ground_truth[scored]
    assert (counts.true_positives, counts.false_positives) == (
        np.sum(positive & actual),
        np.sum(positive & ~actual),
    )
    assert counts.false_negatives == np.sum(actual & ~positive)
    union = np.sum(positive | actual)
    j = np.sum(positive & actual) / union if union else 1.0
    assert counts.f_measure == pytest.approx(2 * j / (1 + j))  # as Dice and Jaccard are related
    assert counts == PixelCounts().with_frame(
        predicted, ground_truth, scored
    )  # in whatever frames they came


def test_a_ghost_overlaps_no_object_by_a_tenth() -> None:
    objects = [square(10, 10), square(50, 30)]
    assert not has_ghost([square(12, 12)], objects)
    assert not has_ghost([square(27, 10)], objects)
    assert has_ghost([square(12, 12), square(29, 10)], objects)
    assert has_ghost([square(0, 0)], [])
    assert not has_ghost([], objects)


@pytest.mark.parametrize(
    ("ids", "switches"),
    [
        ([], 0),
        ([1, 1, 1], 0),
        ([1, None, 1], 0),
        ([1, 2, 1], 2),
        ([None, 3, 3, None, 4], 1),
    ],
)
def test_id_switches(ids: list[int | None], switches: int) -> None:
    assert id_switches(ids) == switches


def overlaps(index: int, regions: dict[int, np.ndarray], labels: np.ndarray) -> MaskOverlaps:
    names = {"arm": 2, "satellite": 3}
    return overlaps_of(index, index / 25, labels.astype(np.uint8), names, regions)


def scene(arm_at: int, satellite_at: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    arm, satellite = square(arm_at, 5, 25), square(satellite_at, 32, 25)
    return np.where(arm, 2, np.where(satellite, 3, 0)), arm, satellite


def test_an_object_is_scored_with_its_best_region_from_two_seconds_on() -> None:
    frames = []
    for n in range(100):
        labels, arm, satellite = scene(5, 50)
        # Before two seconds nothing is seen; of the rest the arm is lost for a fifth.
        regions = {} if n < 50 else {2: satellite} if n >= 90 else {1: arm, 2: satellite}
        frames.append(overlaps(n, regions, labels))
    scores = object_scores(frames)
    assert scores["arm"].j == pytest.approx(0.8)
    assert scores["satellite"].j == pytest.approx(1.0)
    assert scores["arm"].switches == scores["satellite"].switches == 0


def test_an_id_switch_is_counted_and_lowers_j() -> None:
    labels, arm, satellite = scene(5, 50)
    frames = [overlaps(n, {(1 if n < 100 else 7): arm, 2: satellite}, labels) for n in range(150)]
    scores = object_scores(frames)
    assert scores["arm"].switches == 1
    assert scores["arm"].j == pytest.approx(0.5)


@pytest.mark.parametrize("joined", [False, True])
def test_coupled_objects_are_scored_by_their_union(joined: bool) -> None:
    labels, arm, satellite = scene(5, 5)
    frames = []
    for n in range(120):
        both = {1: arm | satellite} if joined and n >= 80 else {1: arm, 2: satellite}
        frames.append(overlaps(n, both, labels))
    scores = object_scores(frames, [(80, frozenset({"arm", "satellite"}))])
    assert scores["arm"].j == scores["satellite"].j == pytest.approx(1.0)
    assert scores["arm"].switches == scores["satellite"].switches == 0


def test_box_distances_by_hand() -> None:
    distance = box_distance([(0, 0, 10, 10)], [(0, 0, 10, 10), (0, 0, 10, 5), (20, 0, 10, 10)])
    assert distance[0, 0] == 0
    assert distance[0, 1] == pytest.approx(0.5)
    assert np.isnan(distance[0, 2])


def test_mot_scores_on_toy_tracks() -> None:
    pytest.importorskip("motmetrics", reason="MOT scores need the extra 'eval'")
    true = {n: {1: (n, 0.0, 10.0, 10.0), 2: (n, 50.0, 10.0, 10.0)} for n in range(10)}
    perfect = mot_scores(true, true)
    assert perfect == {"mota": 1.0, "idf1": 1.0, "id_switches": 0}
    swapped = {n: ({7: b[1], 8: b[2]} if n < 5 else {8: b[1], 7: b[2]}) for n, b in true.items()}
    scores = mot_scores(true, swapped)
    assert scores["id_switches"] == 2
    assert scores["idf1"] == pytest.approx(0.5)
    assert mot_scores(true, {n: {} for n in range(10)})["mota"] == 0.0


def test_a_malformed_line_of_ground_truth_is_reported_with_its_line_number(tmp_path: Path) -> None:
    file = tmp_path / "gt.txt"
    file.write_text("1,1,0,0,5,5,1\n2,1,0,zero,5,5,1\n")
    with pytest.raises(SourceError) as caught:
        read_truth(file)
    assert str(caught.value.where).endswith(":2")


def test_a_folder_without_sequences_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SettingsError, match="nothing to score"):
        find_sequences(tmp_path)


def test_sequences_are_found_run_and_scored(tmp_path: Path) -> None:
    folder = tmp_path / "set" / "disc"
    for name in ("frames", "masks"):
        (folder / name).mkdir(parents=True)
    disc = (lambda n: (60 + 2.0 * n, 80.0), 24.0, texture(2, (320, 480), 0, 255))
    for labelled in clip(texture(1, (320, 480)), lambda n: (20, 30), [disc], 25):
        file = f"{labelled.frame.index:05d}.png"
        cv2.imwrite(str(folder / "frames" / file), labelled.frame.image)
        cv2.imwrite(
            str(folder / "masks" / file), np.where(labelled.masks[0], 255, 0).astype(np.uint8)
        )
    messages: list[str] = []
    figures = evaluate_motion(tmp_path, progress=messages.append)
    assert messages == ["set/disc"]
    item = figures["items"]["set/disc"]
    assert set(item) == {"J", "F", "f_measure", "ghost", "ms", "ratio"}
    assert 0.3 < item["J"] <= 1
    assert figures["total"]["J"] == item["J"]
    short = evaluate_motion(folder, limit=3)["items"]["disc"]
    assert short["J"] < item["J"]


def test_a_mission_is_scored_by_object(tmp_path: Path) -> None:
    (tmp_path / "masks").mkdir()
    disc = (lambda n: (60 + 1.0 * n, 80.0), 24.0, texture(2, (320, 480), 60, 255))
    sky = np.full((320, 480), 4, np.uint8)
    video = cv2.VideoWriter(
        str(tmp_path / "video.mp4"), cv2.VideoWriter.fourcc(*"mp4v"), 25, SIZE[::-1]
    )
    for labelled in clip(sky, lambda n: (0, 0), [disc], 70):
        video.write(labelled.frame.image)
        labels = np.where(labelled.masks[0], 3, 0).astype(np.uint8)
        cv2.imwrite(str(tmp_path / "masks" / f"{labelled.frame.index:05d}.png"), labels)
    video.release()
    truth = {"labels": {"satellite": 3, "arm": 2}, "events": []}
    (tmp_path / "truth.json").write_text(json.dumps(truth))
    item = evaluate_motion(tmp_path)["items"][tmp_path.name]
    assert set(item["objects"]) == {"satellite"}
    assert item["J_object"] == item["objects"]["satellite"]["J"] > 0.7
    assert item["id_switches"] == 0


@pytest.mark.parametrize(
    ("images", "truth", "indices"),
    [
        (["000001.jpg", "000002.jpg"], [0, 1], [0, 1]),
        (["000003.jpg", "000007.jpg"], [6, 2], [1, 0]),
        (["a.jpg", "b.jpg"], [1], [1]),
    ],
)
def test_mot_truth_is_matched_to_images_by_number(
    images: list[str], truth: list[int], indices: list[int]
) -> None:
    boxes = {frame: {1: (float(frame), 0.0, 1.0, 1.0)} for frame in truth}
    matched = truth_of_images(boxes, [Path(name) for name in images])
    assert list(matched) == indices
    assert list(matched.values()) == list(boxes.values())


def test_mot_truth_without_its_image_is_refused() -> None:
    with pytest.raises(SourceError, match="there is no image of frame 3"):
        truth_of_images({2: {}}, [Path("000001.jpg"), Path("000002.jpg")])
