"""Events about changes of relations, used sparingly: when two objects start to converge or diverge."""

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
ReportedRelation = tuple[str, float]
RELATION_EVENTS: MemoryKey[Mapping[tuple[int, ...], ReportedRelation]] = MemoryKey(
    "rules.narrative", MappingProxyType({})
)


@dataclass(frozen=True, slots=True)
class RelationEventSettings:
    """Settings of relation events.

    Attributes:
        lasting_s: How long a relation must hold before it is reported.
        quiet_s: Least time between two sentences about the same pair.
        least_confidence: Relations of lower confidence are not reported.
    """

    lasting_s: float = 0.6
    quiet_s: float = 2.0
    least_confidence: float = 0.6


@dataclass(frozen=True, slots=True)
class RelationEventReasoner:
    """Reasoner of the cogitate phase: 'relation' events for trends that are new and last.

    A steady distance is reported only after the pair converged or diverged; coupled pairs, and parts of
    one machine, are ignored.
    """

    settings: RelationEventSettings = field(default_factory=RelationEventSettings)

    def __call__(self, mind: Mind, observation: Observation) -> Outcome:
        """Reason about one step; see `Reasoner`."""
        reported: dict[tuple[int, ...], ReportedRelation] = dict(self._memory(mind))
        events = []
        for objects, name in mind.holding_objects(*TEMPLATES):
            if not self._new(name, reported.get(objects), mind):
                continue
            relation = mind.relation(name, *objects)
            if relation is None or not self._is_reportable(relation, mind):
                continue
            reported[relation.objects] = (relation.name, mind.time)
            events.append(_event(relation, mind, observation))
        return Outcome(mind.remember(RELATION_EVENTS, MappingProxyType(reported)), tuple(events))

    def _memory(self, mind: Mind) -> Mapping[tuple[int, ...], ReportedRelation]:
        old = mind.recall(RELATION_EVENTS)
        return {pair: t for pair, t in old.items() if all(i in mind.objects for i in pair)}

    def _new(self, name: str, last: ReportedRelation | None, mind: Mind) -> bool:
        """Whether it differs from the last event about these objects, and is not too soon after it."""
        if last is None:
            return name != "keeping_distance"
        return last[0] != name and mind.time - last[1] >= self.settings.quiet_s

    def _is_reportable(self, relation: Relation, mind: Mind) -> bool:
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
