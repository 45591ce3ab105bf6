"""What is said of one region of which the truth is known: names, views, depth, with faults.

Names are wrong in runs: what a silhouette is mistaken for, it is mistaken for again a moment later. What
it may be mistaken for are the mission's other models and some that are not there; some of them far more
often than others. Views are those of a database: directions spread over half the sphere, each standing
for the opposite one too. As matching does, a few views of the right model are told at once, less similar the
farther they are from the true direction (`view_noise.py`).
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

ABSENT = ("antenna", "barrel", "chair", "drill", "engine", "funnel", "guitar", "hammer", "iron")
"""Models that no mission of ours shows, for silhouettes to be mistaken for."""

VIEWS = 32
"""Views of a model, as many as `visup models build` makes by default; each is seen from behind too."""

# Names that are wrong, and looks without a name, are chosen here: told views have only their own noise.
_NOISE = ViewNoise(missing=0.0, wrong=0.0)
_DIRECTIONS = half_sphere_directions(VIEWS)
_PERSISTS = 0.7  # how often a wrong name stays the same within a run of wrong names
_TOLD = 4  # names told each time


@dataclass(frozen=True, slots=True)
class NamingNoise:
    """How names and depths differ from the truth.

    Attributes:
        wrong: Share of times at which the first name is wrong.
        run: Mean length of a run of wrong names, times.
        listed: How often the right name is among the others while the first one is wrong.
        depth: Standard deviation of depth, as a share of it.
    """

    wrong: float
    run: float
    listed: float
    depth: float


class HypothesisSource:
    """Hypotheses and depths of one object, time after time.

    Args:
        mission: The mission.
        name: The object.
        noise: How they differ from the truth.
        rng: Source of chance.
    """

    def __init__(
        self, mission: Mission, name: str, noise: NamingNoise, rng: np.random.Generator
    ) -> None:
        self._frames, self._name, self._size = mission.truth["frames"], name, mission.size
        self._fov = np.deg2rad(float(mission.description.get("fov_vertical_deg", 40.0)))
        self.model = str(mission.truth["meshes"].get(name, name))
        others = {*mission.truth["meshes"].values(), *ABSENT} - {self.model}
        self._others = [str(o) for o in rng.permutation(sorted(others))]
        self._odds = 1.0 / np.arange(1, len(self._others) + 1)
        self._odds /= self._odds.sum()
        self._end = 1.0 / noise.run
        self._noise, self._rng = noise, rng
        self._views = NoisyViews(self.model, _DIRECTIONS, _NOISE, rng)
        self._mistaken: str | None = None
        self._off = 0.0

    def says(
        self, region: Region, index: int, *, alone: bool = True
    ) -> Iterator[Hypothesis | Depth]:
        """What is said of the object's region in one frame.

        Args:
            region: Its region.
            index: Number of the frame.
            alone: Whether the region shows this object only; else it looks like nothing known.
        """
        similarity = 0.72 + 0.05 * self._rng.standard_normal()
        names = self._names(self._noise.wrong if alone else min(0.9, 2 * self._noise.wrong))
        true = self._frames[index].get(self._name, {})
        for name in names:
            yield from self._hypotheses(region, name, min(similarity, 0.99), true)
            similarity -= 0.01 + abs(0.05 + 0.03 * self._rng.standard_normal())
        self._off = 0.7 * self._off + 0.7 * self._rng.standard_normal()
        if true.get("range_m") and not region.cut and alone and self.model in names:
            far = float(true["range_m"]) * (1 + self._noise.depth * self._off)
            yield Depth(region.id, self.model, far, self._noise.depth * far)

    def _names(self, wrong: float) -> list[str]:
        rng = self._rng
        begin = self._end * wrong / max(1.0 - wrong, 1e-9)
        if self._mistaken is None and rng.random() < begin:
            self._mistaken = self._other()
        elif self._mistaken is not None and rng.random() < self._end:
            self._mistaken = None
        elif self._mistaken is not None and rng.random() > _PERSISTS:
            self._mistaken = self._other()
        rest = [str(o) for o in rng.choice(self._others, _TOLD, replace=False, p=self._odds)]
        if self._mistaken is None:
            return [self.model, *rest[: _TOLD - 1]]
        rest = [n for n in rest if n != self._mistaken][: _TOLD - 1]
        if rng.random() < self._noise.listed:
            rest[int(rng.integers(len(rest)))] = self.model
        return [self._mistaken, *rest]

    def _other(self) -> str:
        return str(self._rng.choice(self._others, p=self._odds))

    def _hypotheses(
        self, region: Region, name: str, similarity: float, true: Mapping[str, Any]
    ) -> Iterator[Hypothesis]:
        """Views of one model, best first; only the right one has several that are alike."""
        if name != self.model:
            view = int(self._rng.integers(VIEWS))
            d, turn = _DIRECTIONS[view], float(self._rng.uniform(-np.pi, np.pi))
            direction = (float(d[0]), float(d[1]), float(d[2]))
            yield Hypothesis(region.id, name, view, similarity, turn, None, direction)
        elif "quat_xyzw" not in true:
            # Only exemplars of silhouettes are known of it.
            view = int(self._rng.integers(VIEWS))
            yield Hypothesis(region.id, name, view % 8, similarity)
        else:
            said = self._views(self._seen(true), region.id)
            for h in said:
                alike = max(0.0, similarity - said[0].similarity + h.similarity)
                yield replace(h, similarity=alike)

    def _seen(self, true: Mapping[str, Any]) -> NDArray[np.float64]:
        """Orientation (3, 3) in which it is seen: against the line of sight to it, not the optical axis."""
        from scipy.spatial.transform import Rotation

        box: Sequence[int] = true.get("bbox") or (0, 0, *self._size)
        x, y, w, h = box
        width, height = self._size
        focal = height / 2 / np.tan(self._fov / 2)
        ray = np.array([x + w / 2 - width / 2, y + h / 2 - height / 2, focal])
        turned = Rotation.from_quat(true["quat_xyzw"])
        # Turned the shortest way to where the line of sight is the optical axis.
        across = np.cross(ray, [0.0, 0.0, 1.0])
        sine = float(np.linalg.norm(across))
        if sine < 1e-9:
            return np.asarray(turned.as_matrix())
        aside = Rotation.from_rotvec(across / sine * np.arctan2(sine, ray[2]))
        return np.asarray((aside * turned).as_matrix())
