"""Depth of objects under their best identity, smoothed (paper, section 7.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import exp
from types import MappingProxyType

from visup.agent import Depth, Mind, ObjectBelief, Observation, Outcome
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey
from visup.rules.presence.association import region_owners
from visup.rules.presence.object_tracks import visible_share


@dataclass(frozen=True, slots=True)
class DepthSettings:
    """Settings of the depth estimate.

    Attributes:
        tau_s: Time constant of smoothing, seconds.
        fade_s: Depth not updated for this long becomes unknown, seconds.
        least_visible: Visible share below which an object is not measured, its area being too small.
        clear: Least part of the best identity in the sum of squared vote shares for depth to be estimated.
    """

    tau_s: float = 0.5
    fade_s: float = 1.5
    least_visible: float = 0.8
    clear: float = 0.7


@dataclass(frozen=True, slots=True)
class DepthEstimate:
    """A smoothed depth: model name, value, standard deviation, and time of the last update, seconds."""

    name: str
    depth: float
    sigma: float
    time: float


DEPTHS: MemoryKey[Mapping[int, DepthEstimate]] = MemoryKey("rules.depth", MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class DepthReasoner:
    """Reasoner of the cogitate phase, after the votes: estimates the depth of each object.

    Depths under other identities are ignored, as are those of partly hidden objects. While other identities
    are nearly as likely the depth is unknown, since it depends on the size of the model.
    """

    settings: DepthSettings = field(default_factory=DepthSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Update from one observation; see `Reasoner`."""
        old = mind.recall(DEPTHS)
        owner = region_owners(mind)
        reported = {(owner.get(d.region_id), d.name): d for d in observation.of("depth")}
        retained: dict[int, DepthEstimate] = {}
        beliefs: list[ObjectBelief] = []
        for i, belief in mind.objects.items():
            new = reported.get((i, belief.name))
            before = old.get(i)
            if new is None and before is None and belief.depth is None:
                continue  # fast path, since depth is seldom measured
            if not self._clear(belief):
                new = before = None
            elif new is not None and visible_share(mind, i) < self.settings.least_visible:
                new = None
            now = self._smooth(before, new, belief.name, observation.time)
            if now is not None:
                retained[i] = now
            depth, sigma = (now.depth, now.sigma) if now else (None, None)
            if (depth, sigma) != (belief.depth, belief.depth_sigma):
                beliefs.append(replace(belief, depth=depth, depth_sigma=sigma))
        mind = mind.with_objects(*beliefs) if beliefs else mind
        return Outcome(mind.remember(DEPTHS, MappingProxyType(retained)))

    def _clear(self, belief: ObjectBelief) -> bool:
        weights = [c.share**2 for c in belief.candidates]
        return bool(weights) and weights[0] >= self.settings.clear * sum(weights)

    def _smooth(
        self, old: DepthEstimate | None, new: Depth | None, name: str, now: float
    ) -> DepthEstimate | None:
        if old is not None and (old.name != name or now - old.time > self.settings.fade_s):
            old = None
        if new is None:
            return old
        if old is None:
            return DepthEstimate(name, new.depth, new.sigma, now)
        share = 1.0 - exp(-(now - old.time) / self.settings.tau_s)
        depth = old.depth + share * (new.depth - old.depth)
        sigma = old.sigma + share * (new.sigma - old.sigma)
        return DepthEstimate(name, depth, sigma, now)
