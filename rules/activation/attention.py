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
        settled: Likelihood of the identity from which an object may rest.
        settled_s: How long it must have had it, seconds.
        turning: Rate of rotation above which it is matched, degrees per second.
        every_s: Interval of matches at rest, seconds.
    """

    settled: float = 0.95
    settled_s: float = 2.0
    turning: float = 3.0
    every_s: float = 1.0


@dataclass(frozen=True, slots=True)
class AttentionReasoner:
    """Reasoner of the attend phase: requests that regions not be matched now."""

    settings: AttentionSettings = field(default_factory=AttentionSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        old = mind.recall(ATTENTION)
        since = {b.id: self._since(b, old, mind.time) for b in mind.objects.values()}
        wanted = {i for t in mind.tasks for e in t.expected for i in e.objects}
        resting = [
            b for b in mind.present() if b.id not in wanted and self._known(b, since, mind.time)
        ]
        mind = mind.remember(ATTENTION, MappingProxyType(since))
        return Outcome(mind, directives=tuple(self._asked(resting)))

    def _since(
        self, b: ObjectBelief, old: Mapping[int, tuple[str, float]], now: float
    ) -> tuple[str, float]:
        """The settled name, or an empty one, and since when."""
        name = b.name if b.confidence >= self.settings.settled and b.candidates else ""
        before = old.get(b.id)
        return before if before is not None and before[0] == name else (name, now)

    def _known(self, b: ObjectBelief, since: Mapping[int, tuple[str, float]], now: float) -> bool:
        s, (name, begun) = self.settings, since[b.id]
        turns = b.pose is not None and b.pose.spin is not None and b.pose.spin.rate > s.turning
        return bool(name) and now - begun >= s.settled_s - 1e-6 and not turns

    def _asked(self, resting: list[ObjectBelief]) -> Iterator[Directive]:
        for b in resting:
            data = {"behaviour": "shape", "region": b.region.id, "every_s": self.settings.every_s}
            reason = (
                f"Object {b.id} is known to be the {b.name}, and no further observation is needed."
            )
            yield Directive("rest", reason, MappingProxyType(data))
