"""Beliefs in words: sentences about objects, events of relations, conditions of decisions.

Read in this order: `sentences.py` (names of objects and graded verbs), `conditions.py` (conditions of
decisions, with amounts), `relation_events.py` (reported changes of relations).
"""

from visup.rules.wording.conditions import Condition, DecisionLog
from visup.rules.wording.relation_events import RelationEventReasoner, RelationEventSettings
from visup.rules.wording.sentences import describe, sentence

__all__ = [
    "Condition",
    "DecisionLog",
    "RelationEventReasoner",
    "RelationEventSettings",
    "describe",
    "sentence",
]
