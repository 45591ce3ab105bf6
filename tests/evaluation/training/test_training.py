"""Training of the motion model: it learns what is learnable, and depends only on data and seed."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import sparse
from typer.testing import CliRunner

from tests.percepts.motion.clips import clip, texture
from visup.agent.model.errors import OutputError, SettingsError
from visup.cli import app
from visup.evaluation.training.closed_loop import train
from visup.evaluation.training.examples import Example
from visup.evaluation.training.fitting import WEIGHT_DECAY, TrainingRows, _gradient, fit_perceptron
from visup.percepts.motion.foreground.belief import initial_belief, update_belief
from visup.percepts.motion.foreground.cues import NAMES, FrameCues
from visup.percepts.motion.foreground.perceptron import read_model


def xor_rows(seed: int, count: int = 3000) -> TrainingRows:
    """Moving where exactly one of two cues is positive, which no weighted sum of them can tell."""
    cues = np.random.default_rng(seed).normal(size=(count, 2)).astype(np.float32)
    moving = (cues[:, 0] > 0) != (cues[:, 1] > 0)
    return TrainingRows(cues, moving.astype(np.float32), np.ones(count, np.float32))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_perceptron_learns_exclusive_or(seed: int) -> None:
    p, held_out = fit_perceptron(xor_rows(10, 40_000), seed), xor_rows(11)
    correct = (p.log_odds(held_out.cues) > 0) == (held_out.moving > 0.5)
    assert correct.mean() > 0.93


def test_the_same_rows_and_seed_give_the_same_numbers() -> None:
    one, two, other = (fit_perceptron(xor_rows(10, 500), seed) for seed in (3, 3, 4))
    assert np.array_equal(one.hidden, two.hidden)
    assert not np.array_equal(one.hidden, other.hidden)


@given(st.integers(0, 1000))
@settings(max_examples=10, deadline=None)
def test_the_gradient_is_that_of_the_cross_entropy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    z, moving, weight = rng.normal(size=(7, 3)), rng.integers(0, 2, 7), rng.uniform(0.5, 2, 7)
    parameters = [rng.normal(size=s) for s in ((3, 4), (4,), (4,), (1,))]

    def loss(p: list[NDArray[np.float64]]) -> float:
        odds = np.tanh(z @ p[0] + p[1]) @ p[2] + p[3]
        cross = np.log1p(np.exp(odds)) - moving * odds
        decay = (p[0] ** 2).sum() / len(p[0]) + (p[2] ** 2).sum()
        return float((cross * weight).mean() + WEIGHT_DECAY / 2 * decay)

    gradient = _gradient(parameters, z, moving.astype(np.float32), weight)
    for k, part in enumerate(parameters):
        index = tuple(rng.integers(0, n) for n in part.shape)
        up, down = ([p.copy() for p in parameters] for _ in "12")
        up[k][index] += 1e-5
        down[k][index] -= 1e-5
        assert gradient[k][index] == pytest.approx((loss(up) - loss(down)) / 2e-5, abs=1e-6)


def sequence(seed: int, frames: int = 6, count: int = 120) -> list[Example]:
    """Cells in a row, of which some move: two noisy cues indicate it, and positions stay the same."""
    rng = np.random.default_rng(seed)
    truth = np.zeros(count, np.float32)
    truth[30:60] = 1
    ones = np.ones(count - 1, np.float32)
    link = sparse.diags([ones, ones], [-1, 1], format="csr")
    cells = np.arange(count, dtype=np.int32)
    out = []
    for n in range(frames):
        values = rng.normal(size=(count, len(NAMES))).astype(np.float32)
        values[:, :2] += 1.5 * truth[:, None]
        cues = FrameCues(
            values,
            np.full(count, 64, np.float32),
            np.zeros(count, np.int64),
            link.indptr,
            link.indices,
            link.data,
            cells if n else cells[:0],
            cells if n else cells[:0],
            np.ones(count, np.float32),
            np.zeros(count, np.int32),
        )
        out.append(Example(cues, truth if n % 2 == 0 else None, np.ones(count, np.float32)))
    return out


def test_context_improves_on_cues_alone() -> None:
    model = train({f"{'abcdef'[k]}": sequence(k) for k in range(6)}, 0)
    belief, alone, with_context = initial_belief(), 0.0, 0.0
    for example in sequence(99):
        belief = update_belief(belief, example.cues, model)
        if example.truth is not None:
            moving = example.truth > 0.5
            alone += ((model.alone.log_odds(example.cues.values) > 0) == moving).mean() / 3
            with_context += ((belief.share > 0.5) == moving).mean() / 3
    assert with_context > max(alone, 0.9)


def write_footage(folder: Path) -> None:
    for part in ("frames", "masks"):
        (folder / part).mkdir(parents=True)
    disc = (lambda n: (60 + 3.0 * n, 80.0), 24.0, texture(2, (320, 480), 0, 255))
    for labelled in clip(texture(9, (320, 480)), lambda n: (20 + n, 30), [disc], 5):
        file = f"{labelled.frame.index:05d}.png"
        cv2.imwrite(str(folder / "frames" / file), labelled.frame.image)
        labels = np.where(labelled.masks[0], 255, 0).astype(np.uint8)
        cv2.imwrite(str(folder / "masks" / file), labels)


def test_training_again_writes_the_same_bytes(tmp_path: Path) -> None:
    write_footage(tmp_path / "set")
    for name, cache in (("one", "kept"), ("two", "kept"), ("three", "anew")):
        arguments = ["train", "motion", str(tmp_path / "set"), "--out", str(tmp_path / name)]
        result = CliRunner().invoke(app, [*arguments, "--cache", str(tmp_path / cache)])
        assert result.exit_code == 0, result.output
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    assert (tmp_path / "one").read_bytes() == (tmp_path / "three").read_bytes()
    assert len(read_model(tmp_path / "one").alone.mean) == len(NAMES)


def test_no_training_data_and_an_unwritable_file_are_refused(tmp_path: Path) -> None:
    write_footage(tmp_path / "set")
    arguments = ["train", "motion", str(tmp_path / "set"), "--out"]
    result = CliRunner().invoke(app, [*arguments, str(tmp_path / "no" / "file")])
    assert isinstance(result.exception, OutputError)
    cache = ["--cache", str(tmp_path / "kept"), "--limit", "1"]
    result = CliRunner().invoke(app, [*arguments, str(tmp_path / "file"), *cache])
    assert isinstance(result.exception, SettingsError)
