"""Simulated hypotheses of one region with known truth: names, views, depth, with errors.

Names are wrong in runs: a confusion tends to repeat a moment later. Confusions are with the mission's other
models and some absent ones, with very different frequencies. Views are those of a database: directions spread
over half the sphere, each also representing the opposite one. As in matching, several views of the right
model are reported, with similarity decreasing with the distance from the true direction (`view_noise.py`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visup.agent import Depth, Hypothesis, Region
from visup.evaluation.simulation.truth_masks import Mission
from visup.evaluation.simulation.view_noise import NoisyViews, ViewNoise
from visup.percepts.shape.building.mesh_views import half_sphere_directions

ABSENT_MODELS = (
    "antenna",
    "barrel",
    "chair",
    "drill",
    "engine",
    "funnel",
    "guitar",
    "hammer",
    "iron",
)
"""Models that are in no mission, for confusions."""

VIEWS = 32
"""Views per model, the default of `visup models build`; each also represents the opposite direction."""

# Wrong names and reports without a name are drawn here: views have only their own noise.
_NOISE = ViewNoise(missing=0.0, wrong=0.0)
_DIRECTIONS = half_sphere_directions(VIEWS)
_PERSISTENCE = 0.7  # probability that a wrong name persists within a run of wrong names
_NAMES_PER_REPORT = 4  # names reported each time


@dataclass(frozen=True, slots=True)
class NamingNoise:
    """Errors of names and depths.

    Attributes:
        wrong: Share of reports with a wrong first name.
        run: Mean length of a run of wrong names, reports.
        listed: Probability that the right name is among the others if the first one is wrong.
        depth: Relative standard deviation of depth.
    """

    wrong: float
    run: float
    listed: float
    depth: float


class HypothesisSource:
    """Simulated hypotheses and depths of one object over time.

    Args:
        mission: The mission.
        name: The object.
        noise: The errors.
        rng: Random generator.
    """

    def __init__(
        self, mission: Mission, name: str, noise: NamingNoise, rng: np.random.Generator
    ) -> None:
        self._frames, self._name, self._size = mission.truth["frames"], name, mission.size
        self._fov = np.deg2rad(float(mission.description.get("fov_vertical_deg", 40.0)))
        self.model = str(mission.truth["meshes"].get(name, name))
        others = {*mission.truth["meshes"].values(), *ABSENT_MODELS} - {self.model}
        self._others = [str(o) for o in rng.permutation(sorted(others))]
        self._probabilities = 1.0 / np.arange(1, len(self._others) + 1)
        self._probabilities /= self._probabilities.sum()
        self._end_probability = 1.0 / noise.run
        self._noise, self._rng = noise, rng
        self._views = NoisyViews(self.model, _DIRECTIONS, _NOISE, rng)
        self._wrong_name: str | None = None
        self._depth_error = 0.0

    def report(
        self, region: Region, index: int, *, alone: bool = True
    ) -> Iterator[Hypothesis | Depth]:
        """The hypotheses and depth of the object's region in one frame.

        Args:
            region: Its region.
            index: Number of the frame.
            alone: Whether the region shows only this object; otherwise it resembles no model.
        """
        similarity = 0.72 + 0.05 * self._rng.standard_normal()
        names = self._names(self._noise.wrong if alone else min(0.9, 2 * self._noise.wrong))
        true = self._frames[index].get(self._name, {})
        for name in names:
            yield from self._hypotheses(region, name, min(similarity, 0.99), true)
            similarity -= 0.01 + abs(0.05 + 0.03 * self._rng.standard_normal())
        self._depth_error = 0.7 * self._depth_error + 0.7 * self._rng.standard_normal()
        if true.get("range_m") and not region.cut and alone and self.model in names:
            depth = float(true["range_m"]) * (1 + self._noise.depth * self._depth_error)
            yield Depth(region.id, self.model, depth, self._noise.depth * depth)

    def _names(self, wrong: float) -> list[str]:
        rng = self._rng
        begin_probability = self._end_probability * wrong / max(1.0 - wrong, 1e-9)
        if self._wrong_name is None and rng.random() < begin_probability:
            self._wrong_name = self._random_other()
        elif self._wrong_name is not None and rng.random() < self._end_probability:
            self._wrong_name = None
        elif self._wrong_name is not None and rng.random() > _PERSISTENCE:
            self._wrong_name = self._random_other()
        rest = [
            str(o)
            for o in rng.choice(
                self._others, _NAMES_PER_REPORT, replace=False, p=self._probabilities
            )
        ]
        if self._wrong_name is None:
            return [self.model, *rest[: _NAMES_PER_REPORT - 1]]
        rest = [n for n in rest if n != self._wrong_name][: _NAMES_PER_REPORT - 1]
        if rng.random() < self._noise.listed:
            rest[int(rng.integers(len(rest)))] = self.model
        return [self._wrong_name, *rest]

    def _random_other(self) -> str:
        return str(self._rng.choice(self._others, p=self._probabilities))

    def _hypotheses(
        self, region: Region, name: str, similarity: float, true: Mapping[str, Any]
    ) -> Iterator[Hypothesis]:
        """Views of one model, best first; only the right one has several similar ones."""
        if name != self.model:
            view = int(self._rng.integers(VIEWS))
            d, turn = _DIRECTIONS[view], float(self._rng.uniform(-np.pi, np.pi))
            direction = (float(d[0]), float(d[1]), float(d[2]))
            yield Hypothesis(region.id, name, view, similarity, turn, None, direction)
        elif "quat_xyzw" not in true:
            # Only silhouette exemplars of it are known.
            view = int(self._rng.integers(VIEWS))
            yield Hypothesis(region.id, name, view % 8, similarity)
        else:
            hypotheses = self._views(self._apparent_orientation(true), region.id)
            for h in hypotheses:
                adjusted = max(0.0, similarity - hypotheses[0].similarity + h.similarity)
                yield replace(h, similarity=adjusted)

    def _apparent_orientation(self, true: Mapping[str, Any]) -> NDArray[np.float64]:
        """Apparent orientation (3, 3): relative to the line of sight, not the optical axis."""
        from scipy.spatial.transform import Rotation

        box: Sequence[int] = true.get("bbox") or (0, 0, *self._size)
        x, y, w, h = box
        width, height = self._size
        focal = height / 2 / np.tan(self._fov / 2)
        ray = np.array([x + w / 2 - width / 2, y + h / 2 - height / 2, focal])
        orientation = Rotation.from_quat(true["quat_xyzw"])
        # Smallest rotation that takes the line of sight to the optical axis.
        axis = np.cross(ray, [0.0, 0.0, 1.0])
        sine = float(np.linalg.norm(axis))
        if sine < 1e-9:
            return np.asarray(orientation.as_matrix())
        correction = Rotation.from_rotvec(axis / sine * np.arctan2(sine, ray[2]))
        return np.asarray((correction * orientation).as_matrix())
