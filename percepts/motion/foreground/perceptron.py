"""A trained function from cues to log odds: a perceptron with one hidden layer."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent.model.errors import SourceError
from visup.percepts.motion.features._products_jit import affine_product
from visup.percepts.motion.features.work_image import Floats

FORMAT = 2
FAR = 4.0  # standard deviations at which a cue is clipped


@dataclass(frozen=True, slots=True, eq=False)
class Perceptron:
    """Log odds from cues: w . tanh(W z + b) + c, with z the cues in standard deviations from their mean.

    Attributes:
        mean: (D,) float32 mean of each cue.
        deviation: (D,) float32 standard deviation of each cue, above 0.
        hidden: (D, H) float32.
        offset: (H,) float32.
        out: (H,) float32.
        bias: Log odds when all hidden units are 0.
    """

    mean: Floats
    deviation: Floats
    hidden: Floats
    offset: Floats
    out: Floats
    bias: float

    def log_odds(self, cues: Floats) -> Floats:
        """Of (N, D) cues, (N,) float32."""
        z = np.clip((cues - self.mean) / self.deviation, -FAR, FAR)
        units = np.tanh(affine_product(z, self.hidden, self.offset))
        return np.asarray((units * self.out).sum(axis=1) + np.float32(self.bias), dtype=np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class ForegroundModel:
    """The trained classifiers.

    Attributes:
        alone: Classifies by the cues of a superpixel alone.
        context: Classifies by those and the cues of neighbours, past and appearance.
    """

    alone: Perceptron
    context: Perceptron


def blank_model(alone: int, context: int) -> ForegroundModel:
    """An untrained model for these numbers of cues: even odds for everything."""
    return ForegroundModel(_blank(alone), _blank(context))


def write_model(model: ForegroundModel, path: Path, made: Mapping[str, Any]) -> None:
    """Write a model and its provenance; the same model gives the same bytes."""
    record = {
        "format": FORMAT,
        "made": made,
        "alone": _to_json(model.alone),
        "context": _to_json(model.context),
    }
    path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def read_model(path: Path) -> ForegroundModel:
    """Read a model.

    Raises:
        SourceError: The file cannot be read or is not a model.
    """
    try:
        return _model(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, KeyError, TypeError) as fault:
        raise SourceError(
            "this is not a model of moving foreground",
            where=str(path),
            expected="a file that 'visup train motion' wrote",
        ) from fault


@cache
def shipped_model() -> ForegroundModel:
    """The model that ships."""
    file = resources.files("visup.percepts.motion.foreground") / "foreground.json"
    return _model(file.read_text(encoding="utf-8"))


def _blank(cues: int) -> Perceptron:
    none = np.zeros(1, np.float32)
    zeros, ones = np.zeros(cues, np.float32), np.ones(cues, np.float32)
    return Perceptron(zeros, ones, np.zeros((cues, 1), np.float32), none, none, 0.0)


def _model(text: str) -> ForegroundModel:
    record = json.loads(text)
    if record["format"] != FORMAT:
        raise ValueError(record["format"])
    return ForegroundModel(_perceptron(record["alone"]), _perceptron(record["context"]))


def _to_json(p: Perceptron) -> dict[str, Any]:
    """As JSON; five digits exceed the accuracy of training."""

    def digits(values: NDArray[Any]) -> Any:
        return np.vectorize(lambda v: float(f"{v:.5g}"))(np.asarray(values, dtype=float)).tolist()

    return {
        "mean": digits(p.mean),
        "deviation": digits(p.deviation),
        "hidden": digits(p.hidden),
        "offset": digits(p.offset),
        "out": digits(p.out),
        "bias": float(f"{p.bias:.5g}"),
    }


def _perceptron(data: Mapping[str, Any]) -> Perceptron:
    names = ("mean", "deviation", "hidden", "offset", "out")
    mean, deviation, hidden, offset, out = (np.asarray(data[n], dtype=np.float32) for n in names)
    if (
        hidden.shape != (len(mean), len(out))
        or len(offset) != len(out)
        or not (deviation > 0).all()
    ):
        raise ValueError("shapes do not fit")
    return Perceptron(mean, deviation, hidden, offset, out, float(data["bias"]))
