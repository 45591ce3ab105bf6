"""How far objects are: the depth under the best identity, smoothed (paper, section 7.4)."""

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
    """How depth is believed.

    Attributes:
        tau_s: Time constant of smoothing.
        fade_s: Depth not renewed for this long is unknown.
        least_visible: An object of which less shows is not measured, its area being too small.
        clear: Weight of the best identity among all, each by its votes squared, from which it tells
            a depth.
    """

    tau_s: float = 0.5
    fade_s: float = 1.5
    least_visible: float = 0.8
    clear: float = 0.7


@dataclass(frozen=True, slots=True)
class DepthEstimate:
    """A smoothed depth: model name, value, deviation, and seconds when it was last renewed."""

    name: str
    depth: float
    sigma: float
    time: float


DEPTHS: MemoryKey[Mapping[int, DepthEstimate]] = MemoryKey("rules.depth", MappingProxyType({}))


@dataclass(frozen=True, slots=True)
class DepthReasoner:
    """Reasoner of the cogitate phase, after the votes: the depth of each object.

    Depths under another identity are left out, as are those of objects hidden in part. While other
    identities are nearly as likely the depth is unknown: it hangs on the size of the model.
    """

    settings: DepthSettings = field(default_factory=DepthSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Take in one observation; see `Reasoner`."""
        old = mind.recall(DEPTHS)
        owner = region_owners(mind)
        told = {(owner.get(d.region_id), d.name): d for d in observation.of("depth")}
        kept: dict[int, DepthEstimate] = {}
        beliefs: list[ObjectBelief] = []
        for i, belief in mind.objects.items():
            new = told.get((i, belief.name))
            before = old.get(i)
            if new is None and before is None and belief.depth is None:
                continue  # as nearly always where nobody measures depth
            if not self._clear(belief):
                new = before = None
            elif new is not None and visible_share(mind, i) < self.settings.least_visible:
                new = None
            now = self._smooth(before, new, belief.name, observation.time)
            if now is not None:
                kept[i] = now
            depth, sigma = (now.depth, now.sigma) if now else (None, None)
            if (depth, sigma) != (belief.depth, belief.depth_sigma):
                beliefs.append(replace(belief, depth=depth, depth_sigma=sigma))
        mind = mind.with_objects(*beliefs) if beliefs else mind
        return Outcome(mind.remember(DEPTHS, MappingProxyType(kept)))

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
