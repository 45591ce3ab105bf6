"""Cross-validation: settings are never chosen by the sequences that they are scored on."""

from __future__ import annotations

import json
import math
import statistics
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from tests.percepts.motion.clips import clip, texture
from visup.agent.model.errors import SettingsError, SourceError
from visup.commands.eval.catalogue import app as eval_app
from visup.evaluation.cross_validation.runner import FoldPlan, evaluate_folds, parse_changes
from visup.evaluation.families import family_of, mean_and_spread
from visup.evaluation.motion.folds import assign_folds, gains, select_settings
from visup.evaluation.motion.mask_scores import region_similarity
from visup.evaluation.motion.variants import PLAIN, VARIANTS

names = st.sets(st.from_regex(r"[a-f](-[a-c]|[0-9])?", fullmatch=True), min_size=1, max_size=20)
scores_0_to_1 = st.floats(0, 1)


@given(names, st.integers(1, 6))
def test_a_family_is_never_divided_and_folds_are_even(sequence_names: set[str], folds: int) -> None:
    fold_of = assign_folds(sequence_names, folds)
    assert set(fold_of) == sequence_names
    assert all(0 <= f < folds for f in fold_of.values())
    for a in sequence_names:
        for b in sequence_names:
            assert family_of(a) != family_of(b) or fold_of[a] == fold_of[b]
    sizes = [sum(f == k for f in fold_of.values()) for k in range(folds)]
    largest = max(sum(family_of(a) == family_of(b) for b in sequence_names) for a in sequence_names)
    assert max(sizes) - min(sizes) <= largest


@pytest.mark.parametrize(
    ("name", "family"),
    [
        ("moseg/cars4", "cars"),
        ("cars10", "cars"),
        ("davis-more/horsejump-low", "horsejump"),
        ("cdnet_office", "cdnet"),
        ("PETS09-S2L1", "pets"),
        ("0042", "0042"),
    ],
)
def test_families_by_name(name: str, family: str) -> None:
    assert family_of(name) == family


@given(st.dictionaries(st.sampled_from("abcdefghij"), scores_0_to_1, min_size=2))
def test_the_spread_of_unrelated_sequences_is_the_standard_error(scores: dict[str, float]) -> None:
    mean, spread = mean_and_spread(scores)
    values = list(scores.values())
    assert mean == pytest.approx(statistics.fmean(values))
    assert spread == pytest.approx(statistics.stdev(values) / math.sqrt(len(values)), abs=1e-9)


def test_correlated_sequences_of_a_family_widen_the_spread() -> None:
    separate = {"a": 1.0, "b": 1.0, "c": 0.0, "d": 0.0}
    in_families = {"a1": 1.0, "a2": 1.0, "b1": 0.0, "b2": 0.0}
    assert mean_and_spread(in_families)[1] > mean_and_spread(separate)[1]
    assert mean_and_spread({"a1": 0.3, "a2": 0.5})[1] == math.inf


@given(st.data())
@settings(max_examples=50)
def test_settings_do_not_depend_on_the_left_out_fold(data: st.DataObject) -> None:
    sequence_names = data.draw(names)
    fold_of = assign_folds(sequence_names, 3)
    scores_by_settings = [
        data.draw(st.fixed_dictionaries(dict.fromkeys(sorted(sequence_names), scores_0_to_1)))
        for _ in "123"
    ]
    left_out = data.draw(st.sampled_from(sorted(set(fold_of.values()))))
    changed = [
        {n: data.draw(scores_0_to_1) if fold_of[n] == left_out else v for n, v in scores.items()}
        for scores in scores_by_settings
    ]
    assert (
        select_settings(scores_by_settings, fold_of)[left_out]
        == select_settings(changed, fold_of)[left_out]
    )


def test_the_best_settings_on_the_other_folds_are_selected_and_the_defaults_among_equals() -> None:
    fold_of = {"a": 0, "b": 1, "c": 1}
    defaults = {"a": 0.5, "b": 0.5, "c": 0.5}
    candidate = {"a": 0.9, "b": 0.4, "c": 0.5}
    assert select_settings([defaults, candidate], fold_of) == {0: 0, 1: 1}
    assert select_settings([defaults, dict(defaults)], fold_of) == {0: 0, 1: 0}
    assert gains(candidate, {"a": 0.5, "z": 0.1}) == {"a": pytest.approx(0.4)}


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_transforms_image_and_mask_alike(name: str) -> None:
    image = np.full((60, 90, 3), 40, np.uint8)
    image[10:40, 15:50] = 220
    labels = (image[..., 0] > 128).astype(np.uint8) * 255
    variant = VARIANTS[name]
    transformed, mask = variant.image(image), variant.labels(labels)
    assert transformed.shape[:2] == mask.shape
    bright = transformed[..., 0] > 128
    assert region_similarity(bright, mask > 0, np.ones_like(bright)) == pytest.approx(1, abs=0.1)


def test_mirroring_twice_is_the_identity() -> None:
    image = texture(3, (20, 30))[..., None].repeat(3, axis=2)
    mirrored = VARIANTS["mirrored"].image
    assert np.array_equal(mirrored(mirrored(image)), image)
    assert not np.array_equal(mirrored(image), image)


@pytest.mark.parametrize("text", ["speed=3", "evidence=much", "evidence", "lags_s=1"])
def test_unknown_settings_and_values_are_refused(text: str) -> None:
    with pytest.raises(SettingsError) as caught:
        parse_changes(text)
    assert caught.value.where == "--try"


def test_changes_contain_only_the_named_settings() -> None:
    assert parse_changes("evidence=0.8, cell=6") == {"evidence": 0.8, "cell": 6}


def write_sequences(folder: Path) -> None:
    for k, name in enumerate(("one", "two1", "two2")):
        for part in ("frames", "masks"):
            (folder / name / part).mkdir(parents=True)
        disc = (lambda n, k=k: (60 + (2.0 + k) * n, 80.0), 24.0, texture(2 + k, (320, 480), 0, 255))
        for labelled in clip(texture(9 + k, (320, 480)), lambda n: (20, 30), [disc], 8):
            file = f"{labelled.frame.index:05d}.png"
            labels = np.where(labelled.masks[0], 255, 0).astype(np.uint8)
            cv2.imwrite(str(folder / name / "frames" / file), labelled.frame.image)
            cv2.imwrite(str(folder / name / "masks" / file), labels)


def test_sequences_are_scored_by_folds_and_results_are_cached(tmp_path: Path) -> None:
    write_sequences(tmp_path / "set")
    plan = FoldPlan(2, tmp_path / "kept", ["confirm_s=9"], stability=True, workers=1)
    figures = evaluate_folds(tmp_path / "set", plan)
    items, total = figures["items"], figures["total"]
    assert items["two1"]["fold"] == items["two2"]["fold"] != items["one"]["fold"]
    assert (total["sequences"], total["families"]) == (3, 2)
    assert total["J"] == pytest.approx(statistics.fmean(i["J"] for i in items.values()))
    assert set(items["one"]["variants"]) == set(VARIANTS) - {PLAIN}
    assert all(items[n]["moved"] >= 0 for n in items)
    # What was measured is not measured again: the pictures may be gone.
    for file in (tmp_path / "kept").iterdir():
        file.write_text(json.dumps({"J": 0.5, "F": 0.5, "ghost": 0.0}))
    again = evaluate_folds(tmp_path / "set", plan)
    assert again["total"]["J"] == 0.5


def test_changed_settings_are_compared_with_earlier_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 1)  # no processes for these few frames
    write_sequences(tmp_path / "set")
    cache = ["--cache", str(tmp_path / "kept"), "--limit", "6"]
    arguments = ["motion", str(tmp_path / "set"), "--folds", "2", *cache]
    first = tmp_path / "first.json"
    result = CliRunner().invoke(eval_app, [*arguments, "--json", str(first)])
    assert result.exit_code == 0, result.output
    assert "over 3 sequences of 2 families" in result.output
    record = json.loads(first.read_text())
    for item in record["items"].values():
        item["J"] -= 0.1
    first.write_text(json.dumps(record))
    result = CliRunner().invoke(eval_app, [*arguments, "--against", str(first)])
    assert "gain +0.100 +- 0.000: more than its spread" in result.output


def test_malformed_figures_and_fold_options_without_folds_are_refused(tmp_path: Path) -> None:
    write_sequences(tmp_path / "set")
    malformed = tmp_path / "bad.json"
    malformed.write_text("[1, 2]")
    with pytest.raises(SourceError, match="cannot be read"):
        evaluate_folds(tmp_path / "set", FoldPlan(2, tmp_path / "kept", against=malformed))
    result = CliRunner().invoke(eval_app, ["motion", str(tmp_path / "set"), "--stability"])
    assert isinstance(result.exception, SettingsError)
