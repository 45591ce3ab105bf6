"""Events about changes of relations, sparingly: one when two objects begin to converge or diverge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from visup.agent import Event, Mind, Observation, Outcome, Relation
from visup.agent.model.memory import MemoryKey
from visup.rules.wording.sentences import sentence

TEMPLATES = {
    "converging": "{0} and {1} {are} converging.",
    "diverging": "{0} and {1} {are} diverging.",
    "keeping_distance": "{0} and {1} {are} keeping their distance.",
}
Told = tuple[str, float]
RELATION_EVENTS: MemoryKey[Mapping[tuple[int, ...], Told]] = MemoryKey(
    "rules.narrative", MappingProxyType({})
)


@dataclass(frozen=True, slots=True)
class RelationEventSettings:
    """How sparingly relations are reported.

    Attributes:
        lasting_s: How long a relation must hold before it is told.
        quiet_s: Least time between two sentences about the same pair.
        least_confidence: Relations believed less are not told.
    """

    lasting_s: float = 0.6
    quiet_s: float = 2.0
    least_confidence: float = 0.6


@dataclass(frozen=True, slots=True)
class RelationEventReasoner:
    """Reasoner of the cogitate phase: 'relation' events for trends that are new and last.

    A pair that keeps its distance is told of only when it converged or diverged before; coupled
    pairs, and parts of one machine, are left alone.
    """

    settings: RelationEventSettings = field(default_factory=RelationEventSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Judge one step; see `Reasoner`."""
        told: dict[tuple[int, ...], Told] = dict(self._memory(mind))
        events = []
        for objects, name in mind.holding_objects(*TEMPLATES):
            if not self._new(name, told.get(objects), mind):
                continue
            relation = mind.relation(name, *objects)
            if relation is None or not self._worth_telling(relation, mind):
                continue
            told[relation.objects] = (relation.name, mind.time)
            events.append(_event(relation, mind, observation))
        return Outcome(mind.remember(RELATION_EVENTS, MappingProxyType(told)), tuple(events))

    def _memory(self, mind: Mind) -> Mapping[tuple[int, ...], Told]:
        old = mind.recall(RELATION_EVENTS)
        return {pair: t for pair, t in old.items() if all(i in mind.objects for i in pair)}

    def _new(self, name: str, last: Told | None, mind: Mind) -> bool:
        """Whether it differs from the last event about these objects, and does not come too soon after it."""
        if last is None:
            return name != "keeping_distance"
        return last[0] != name and mind.time - last[1] >= self.settings.quiet_s

    def _worth_telling(self, relation: Relation, mind: Mind) -> bool:
        s = self.settings
        if relation.confidence < s.least_confidence or mind.time - relation.since < s.lasting_s:
            return False
        if len(relation.objects) != 2:
            return True
        return not (mind.coupled(*relation.objects) or mind.one_machine(*relation.objects))


def _event(relation: Relation, mind: Mind, observation: Observation) -> Event:
    data = {"relation": relation.name, "value": relation.value, "sigma": relation.sigma}
    return Event(
        "relation",
        observation.time,
        observation.frame_index,
        sentence(mind, TEMPLATES[relation.name], *relation.objects, confidence=relation.confidence),
        relation.objects,
        relation.confidence,
        data=MappingProxyType(data),
    )
