"""View hypotheses simulated from true orientations, with the errors of matching.

A model has views from directions spread over half the sphere, each also representing the opposite one
(`half_sphere_directions`). Each report lists the views nearest to the true direction with decreasing
similarity; at random a neighbouring view comes first, or a completely different one, or there is none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from visup.agent import Hypothesis
from visup.agent.model.orientation import orientations, swing_and_roll

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ViewNoise:
    """The errors of hypotheses.

    Attributes:
        missing: Share of reports without hypotheses.
        wrong: Share of reports whose first hypothesis is wrong: another model, or another view.
        wrong_run: Mean number of reports for which a wrong hypothesis persists.
        twin: Share of reports with the mirror image mistaken for the view: the opposite direction.
        roll_deg: Standard deviation of the in-plane rotation.
        similarity: Similarity of a view seen from its own direction.
        fall: Loss of similarity at 20 degrees from it; it grows with the square of the angle.
        similarity_sigma: Standard deviation of each similarity.
        top: Hypotheses of the right model in a report.
    """

    missing: float = 0.15
    wrong: float = 0.3
    wrong_run: float = 2.0
    twin: float = 0.05
    roll_deg: float = 5.0
    similarity: float = 0.85
    fall: float = 0.15
    similarity_sigma: float = 0.03
    top: int = 3


class NoisyViews:
    """Simulated hypotheses of one object, report by report.

    Args:
        name: The object's model.
        directions: (V, 3) unit vectors of the model's views, model frame; opposite ones are views too.
        noise: The errors.
        rng: Random generator.
        others: Models for confusions; if empty, other views of its own.
    """

    def __init__(
        self,
        name: str,
        directions: Floats,
        noise: ViewNoise,
        rng: np.random.Generator,
        others: tuple[str, ...] = (),
    ) -> None:
        self.name, self.noise, self.rng, self.others = name, noise, rng, others
        self._count = len(directions)
        self._upright = orientations(np.concatenate([directions, -directions]), 0.0)
        self._persistent_error: Hypothesis | None = None

    def __call__(self, orientation: Floats, region_id: int) -> tuple[Hypothesis, ...]:
        """Hypotheses of one report, best first.

        Args:
            orientation: (3, 3) true orientation, model to camera.
            region_id: The object's region.
        """
        noise, rng = self.noise, self.rng
        if rng.random() < noise.missing:
            return ()
        swing, _ = swing_and_roll(self._upright, orientation)
        fall = noise.fall * (np.degrees(swing) / 20.0) ** 2
        similarity = noise.similarity - fall + noise.similarity_sigma * rng.normal(size=len(swing))
        best = np.argsort(-similarity, kind="stable")[: noise.top]
        hypotheses = [
            self._view_hypothesis(int(k), float(similarity[k]), orientation, region_id)
            for k in best
        ]
        if rng.random() < noise.twin:
            hypotheses[0] = _twin(hypotheses[0])
        first = self._wrong_hypothesis(hypotheses[0], orientation)
        return (first, *hypotheses) if first is not None else tuple(hypotheses)

    def _view_hypothesis(
        self, view: int, similarity: float, true: Floats, region_id: int
    ) -> Hypothesis:
        _, roll = swing_and_roll(self._upright[view], true)
        rotation = float(roll) + np.radians(self.noise.roll_deg) * self.rng.normal()
        x, y, z = (-self._upright[view][2]).tolist()
        clipped = float(np.clip(similarity, 0.0, 1.0))
        return Hypothesis(
            region_id, self.name, view % self._count, clipped, rotation, direction=(x, y, z)
        )

    def _wrong_hypothesis(self, right: Hypothesis, true: Floats) -> Hypothesis | None:
        """A wrong hypothesis that is more similar than the right one, persistent over runs."""
        noise, rng = self.noise, self.rng
        persists = self._persistent_error is not None and rng.random() < 1.0 - 1.0 / noise.wrong_run
        # Keeps the share of wrong reports independent of the length of runs.
        begin = noise.wrong / (noise.wrong_run * (1.0 - noise.wrong))
        if not persists:
            self._persistent_error = None
        if self._persistent_error is None and not persists and rng.random() < min(1.0, begin):
            self._persistent_error = self._random_hypothesis(right.region_id)
        if self._persistent_error is None:
            return None
        similarity = min(1.0, right.similarity + 0.05 * rng.random())
        wrong = self._persistent_error
        return Hypothesis(
            wrong.region_id,
            wrong.name,
            wrong.view,
            similarity,
            wrong.rotation,
            direction=wrong.direction,
        )

    def _random_hypothesis(self, region_id: int) -> Hypothesis:
        rng = self.rng
        view = int(rng.integers(len(self._upright)))
        names = (self.name, *self.others)
        name = names[int(rng.integers(len(names)))]
        x, y, z = (-self._upright[view][2]).tolist()
        roll = float(rng.uniform(-np.pi, np.pi))
        return Hypothesis(region_id, name, view % self._count, 0.0, roll, direction=(x, y, z))


def _twin(h: Hypothesis) -> Hypothesis:
    """The mirror-image hypothesis: the view from behind."""
    if h.direction is None:
        return h
    x, y, z = h.direction
    return Hypothesis(h.region_id, h.name, h.view, h.similarity, h.rotation, h.scale, (-x, -y, -z))
