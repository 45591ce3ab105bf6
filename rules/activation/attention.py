"""Attention: objects whose identity is certain are observed less closely, with the reason.

Coarse to fine: motion and health process every frame; silhouettes are matched repeatedly only where that may
change anything: for objects of unsettled identity, that rotate, or that a task stage currently refers to. All
others *rest*: they are matched now and then, and keep their last result meanwhile.

Off by default: between two matches a pose is not updated, so slow rotation is noticed later.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import Directive, Mind, ObjectBelief, Observation, Outcome
from visup.agent.model.memory import MemoryKey

ATTENTION: MemoryKey[Mapping[int, tuple[str, float]]] = MemoryKey(
    "rules.attention", MappingProxyType({})
)


@dataclass(frozen=True, slots=True)
class AttentionSettings:
    """Settings of attention.

    Attributes:
        likelihood: Likelihood of the identity from which an object may rest.
        identified_s: How long it must have had it, seconds.
        rotation_deg_s: Rate of rotation above which it is matched, degrees per second.
        every_s: Interval of matches at rest, seconds.
    """

    likelihood: float = 0.95
    identified_s: float = 2.0
    rotation_deg_s: float = 3.0
    every_s: float = 1.0


@dataclass(frozen=True, slots=True)
class AttentionReasoner:
    """Reasoner of the attend phase: requests that regions not be matched now."""

    settings: AttentionSettings = field(default_factory=AttentionSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        before = mind.recall(ATTENTION)
        identified_since = {
            b.id: self._identified_since(b, before, mind.time) for b in mind.objects.values()
        }
        expected = {i for t in mind.tasks for e in t.expected for i in e.objects}
        resting = [
            b
            for b in mind.present()
            if b.id not in expected and self._may_rest(b, identified_since, mind.time)
        ]
        mind = mind.remember(ATTENTION, MappingProxyType(identified_since))
        return Outcome(mind, directives=tuple(self._rest_directives(resting)))

    def _identified_since(
        self, b: ObjectBelief, old: Mapping[int, tuple[str, float]], now: float
    ) -> tuple[str, float]:
        """The settled name, or an empty one, and since when."""
        name = b.name if b.confidence >= self.settings.likelihood and b.candidates else ""
        before = old.get(b.id)
        return before if before is not None and before[0] == name else (name, now)

    def _may_rest(
        self, b: ObjectBelief, since: Mapping[int, tuple[str, float]], now: float
    ) -> bool:
        s, (name, begun) = self.settings, since[b.id]
        turns = (
            b.pose is not None and b.pose.spin is not None and b.pose.spin.rate > s.rotation_deg_s
        )
        return bool(name) and now - begun >= s.identified_s - 1e-6 and not turns

    def _rest_directives(self, resting: list[ObjectBelief]) -> Iterator[Directive]:
        for b in resting:
            data = {"behaviour": "shape", "region": b.region.id, "every_s": self.settings.every_s}
            reason = (
                f"Object {b.id} is known to be the {b.name}, and no further observation is needed."
            )
            yield Directive("rest", reason, MappingProxyType(data))
