"""Folds: nothing that is scored had a say in what it is scored with."""

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
from visup.commands.eval.catalogue import eval_app
from visup.evaluation.cross_validation.runner import FoldPlan, evaluate_folds, tried_changes
from visup.evaluation.families import family_of, mean_and_spread
from visup.evaluation.motion.folds import chosen, dealt, gains
from visup.evaluation.motion.mask_scores import region_similarity
from visup.evaluation.motion.variants import PLAIN, VARIANTS

names = st.sets(st.from_regex(r"[a-f](-[a-c]|[0-9])?", fullmatch=True), min_size=1, max_size=20)
shares = st.floats(0, 1)


@given(names, st.integers(1, 6))
def test_a_family_is_never_divided_and_folds_are_even(found: set[str], folds: int) -> None:
    fold = dealt(found, folds)
    assert set(fold) == found
    assert all(0 <= f < folds for f in fold.values())
    for a in found:
        for b in found:
            assert family_of(a) != family_of(b) or fold[a] == fold[b]
    sizes = [sum(f == k for f in fold.values()) for k in range(folds)]
    largest = max(sum(family_of(a) == family_of(b) for b in found) for a in found)
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


@given(st.dictionaries(st.sampled_from("abcdefghij"), shares, min_size=2))
def test_the_spread_of_unrelated_sequences_is_the_standard_error(scores: dict[str, float]) -> None:
    mean, spread = mean_and_spread(scores)
    values = list(scores.values())
    assert mean == pytest.approx(statistics.fmean(values))
    assert spread == pytest.approx(statistics.stdev(values) / math.sqrt(len(values)), abs=1e-9)


def test_a_family_that_fails_together_counts_as_one() -> None:
    apart = {"a": 1.0, "b": 1.0, "c": 0.0, "d": 0.0}
    together = {"a1": 1.0, "a2": 1.0, "b1": 0.0, "b2": 0.0}
    assert mean_and_spread(together)[1] > mean_and_spread(apart)[1]
    assert mean_and_spread({"a1": 0.3, "a2": 0.5})[1] == math.inf


@given(st.data())
@settings(max_examples=50)
def test_what_is_left_out_has_no_say_in_the_choice(data: st.DataObject) -> None:
    found = data.draw(names)
    fold = dealt(found, 3)
    tried = [data.draw(st.fixed_dictionaries(dict.fromkeys(sorted(found), shares))) for _ in "123"]
    left_out = data.draw(st.sampled_from(sorted(set(fold.values()))))
    other = [
        {n: data.draw(shares) if fold[n] == left_out else v for n, v in scores.items()}
        for scores in tried
    ]
    assert chosen(tried, fold)[left_out] == chosen(other, fold)[left_out]


def test_the_best_of_the_rest_is_chosen_and_the_defaults_among_equals() -> None:
    fold = {"a": 0, "b": 1, "c": 1}
    defaults = {"a": 0.5, "b": 0.5, "c": 0.5}
    tried = {"a": 0.9, "b": 0.4, "c": 0.5}
    assert chosen([defaults, tried], fold) == {0: 0, 1: 1}
    assert chosen([defaults, dict(defaults)], fold) == {0: 0, 1: 0}
    assert gains(tried, {"a": 0.5, "z": 0.1}) == {"a": pytest.approx(0.4)}


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_keeps_a_mask_on_its_picture(name: str) -> None:
    image = np.full((60, 90, 3), 40, np.uint8)
    image[10:40, 15:50] = 220
    labels = (image[..., 0] > 128).astype(np.uint8) * 255
    variant = VARIANTS[name]
    shown, mask = variant.image(image), variant.labels(labels)
    assert shown.shape[:2] == mask.shape
    seen = shown[..., 0] > 128
    assert region_similarity(seen, mask > 0, np.ones_like(seen)) == pytest.approx(1, abs=0.1)


def test_mirrored_twice_is_as_it_was() -> None:
    image = texture(3, (20, 30))[..., None].repeat(3, axis=2)
    mirrored = VARIANTS["mirrored"].image
    assert np.array_equal(mirrored(mirrored(image)), image)
    assert not np.array_equal(mirrored(image), image)


@pytest.mark.parametrize("text", ["speed=3", "evidence=much", "evidence", "lags_s=1"])
def test_settings_that_cannot_be_tried_are_refused(text: str) -> None:
    with pytest.raises(SettingsError) as caught:
        tried_changes(text)
    assert caught.value.where == "--try"


def test_tried_settings_change_only_what_they_name() -> None:
    assert tried_changes("evidence=0.8, cell=6") == {"evidence": 0.8, "cell": 6}


def sequences(folder: Path) -> None:
    for k, name in enumerate(("one", "two1", "two2")):
        for part in ("frames", "masks"):
            (folder / name / part).mkdir(parents=True)
        disc = (lambda n, k=k: (60 + (2.0 + k) * n, 80.0), 24.0, texture(2 + k, (320, 480), 0, 255))
        for shot in clip(texture(9 + k, (320, 480)), lambda n: (20, 30), [disc], 8):
            file = f"{shot.frame.index:05d}.png"
            labels = np.where(shot.masks[0], 255, 0).astype(np.uint8)
            cv2.imwrite(str(folder / name / "frames" / file), shot.frame.image)
            cv2.imwrite(str(folder / name / "masks" / file), labels)


def test_sequences_are_scored_by_folds_and_kept(tmp_path: Path) -> None:
    sequences(tmp_path / "set")
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


def test_a_change_is_compared_with_figures_of_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 1)  # no processes for these few frames
    sequences(tmp_path / "set")
    cache = ["--cache", str(tmp_path / "kept"), "--limit", "6"]
    words = ["motion", str(tmp_path / "set"), "--folds", "2", *cache]
    first = tmp_path / "first.json"
    done = CliRunner().invoke(eval_app(), [*words, "--json", str(first)])
    assert done.exit_code == 0, done.output
    assert "over 3 sequences of 2 families" in done.output
    record = json.loads(first.read_text())
    for item in record["items"].values():
        item["J"] -= 0.1
    first.write_text(json.dumps(record))
    done = CliRunner().invoke(eval_app(), [*words, "--against", str(first)])
    assert "gain +0.100 +- 0.000: more than its spread" in done.output


def test_figures_that_are_none_and_options_without_folds_are_refused(tmp_path: Path) -> None:
    sequences(tmp_path / "set")
    bad = tmp_path / "bad.json"
    bad.write_text("[1, 2]")
    with pytest.raises(SourceError, match="cannot be read"):
        evaluate_folds(tmp_path / "set", FoldPlan(2, tmp_path / "kept", against=bad))
    done = CliRunner().invoke(eval_app(), ["motion", str(tmp_path / "set"), "--stability"])
    assert isinstance(done.exception, SettingsError)
