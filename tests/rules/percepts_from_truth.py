"""Percepts made from the truth of shared missions, for tests."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from tests.paths import SHARED
from visup.agent import Observation
from visup.evaluation.missions.files import read_json
from visup.evaluation.simulation.percepts import PerceptNoise, observations_of
from visup.evaluation.simulation.truth_masks import Mission, load_mission

MISSIONS = SHARED / "missions"


@dataclass(frozen=True)
class Noise:
    """How the percepts differ from the truth, and how many frames are used."""

    seed: int = 0
    every: int = 1
    contour_px: float = 0.7
    missing: float = 0.0
    wrong: float = 0.1


def available(name: str) -> bool:
    return (MISSIONS / name / "truth.json").exists()


def truth_of(name: str) -> dict[str, Any]:
    return read_json(MISSIONS / name / "truth.json")


def actors_of(name: str) -> dict[str, tuple[str, ...]]:
    told = read_json(MISSIONS / name / "mission.json")
    return {actor: (model,) for actor, model in told["actors"].items()}


@lru_cache(maxsize=4)
def _mission(name: str, every: int) -> Mission:
    return load_mission(MISSIONS / name, every=every)


def observations(name: str, noise: Noise = Noise()) -> Iterator[tuple[Observation, dict[int, str]]]:
    """Observations of a mission, each with the truth: region id -> object name."""
    wrong = PerceptNoise(
        seed=noise.seed, contour_px=noise.contour_px, missing=noise.missing, wrong=noise.wrong
    )
    for seen, who in observations_of(_mission(name, noise.every), wrong, every=noise.every):
        yield seen, {region: names[0] for region, names in who.items()}
