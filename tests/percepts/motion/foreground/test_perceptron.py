from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from visup.agent.model.errors import SourceError
from visup.percepts.motion.foreground.belief import CUES_IN_CONTEXT
from visup.percepts.motion.foreground.cues import NAMES
from visup.percepts.motion.foreground.perceptron import (
    ForegroundModel,
    Perceptron,
    read_model,
    shipped_model,
    write_model,
)


def perceptron(seed: int, width: int, units: int = 3) -> Perceptron:
    rng = np.random.default_rng(seed)
    mean, out, offset = (rng.normal(size=n).astype(np.float32) for n in (width, units, units))
    wide = rng.uniform(0.5, 2, width).astype(np.float32)
    hidden = rng.normal(size=(width, units)).astype(np.float32)
    return Perceptron(mean, wide, hidden, offset, out, 0.25)


def test_log_odds_are_those_of_the_formula() -> None:
    p = perceptron(0, 4)
    cues = np.random.default_rng(1).normal(size=(5, 4)).astype(np.float32)
    for row, found in zip(cues, p.log_odds(cues), strict=True):
        z = (row - p.mean) / p.deviation
        units = [np.tanh(sum(z * p.hidden[:, k]) + p.offset[k]) for k in range(3)]
        told = sum(u * w for u, w in zip(units, p.out, strict=True)) + 0.25
        assert found == pytest.approx(told, rel=1e-4, abs=1e-5)


def test_a_cue_far_beyond_all_that_was_learnt_from_tells_no_more() -> None:
    p = perceptron(0, 4)
    far = p.mean + 100 * p.deviation
    assert p.log_odds(far[None])[0] == pytest.approx(p.log_odds(10 * far[None])[0])


def test_a_model_is_read_as_it_was_written(tmp_path: Path) -> None:
    model = ForegroundModel(perceptron(1, 4), perceptron(2, 6))
    for name in ("one", "two"):
        write_model(model, tmp_path / name, {"seed": 1})
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    again = read_model(tmp_path / "one")
    cues = np.random.default_rng(3).normal(size=(9, 6)).astype(np.float32)
    assert np.allclose(again.context.log_odds(cues), model.context.log_odds(cues), atol=1e-3)


@pytest.mark.parametrize("text", ["", "{}", "[]", '{"format": 7}', '{"format": 1, "alone": {}}'])
def test_what_is_no_model_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "model.json"
    file.write_text(text)
    with pytest.raises(SourceError, match="not a model"):
        read_model(file)


def test_parts_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "model.json"
    write_model(ForegroundModel(perceptron(1, 4), perceptron(2, 6)), file, {})
    record = json.loads(file.read_text())
    record["alone"]["offset"].append(0.0)
    file.write_text(json.dumps(record))
    with pytest.raises(SourceError, match="not a model"):
        read_model(file)


def test_the_shipped_model_takes_the_cues_that_there_are() -> None:
    model = shipped_model()
    assert len(model.alone.mean) == len(NAMES)
    assert len(model.context.mean) == CUES_IN_CONTEXT
