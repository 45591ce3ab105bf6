"""Attention: objects whose identity is certain are observed less closely, with the reason.

Coarse to fine: motion and health see every frame, always; what a silhouette looks like is matched
again and again only where that may still change anything: for objects whose identity is not settled,
that turn, or that a task asks something of now. All others *rest*: they are matched again now and
then, and what they looked like last is told meanwhile.

Off by default: between two looks a pose is not renewed, and what turns slowly is seen turning later.
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
    """When an object may rest.

    Attributes:
        settled: Likelihood of its identity.
        settled_s: How long it must have had it, seconds.
        turning: Above this rate it is looked at, degrees per second.
        every_s: How often it is looked at all the same, seconds.
    """

    settled: float = 0.95
    settled_s: float = 2.0
    turning: float = 3.0
    every_s: float = 1.0


@dataclass(frozen=True, slots=True)
class AttentionReasoner:
    """Reasoner of the attend phase: says which regions need not be matched now."""

    settings: AttentionSettings = field(default_factory=AttentionSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Reasoner`."""
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
        """The name that is settled, or none, and since when."""
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
