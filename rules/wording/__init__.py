"""Beliefs in words: sentences about objects, events of relations, conditions of decisions.

Read in this order: `sentences.py` (how objects are called and how sure a verb is), `conditions.py` (what a
decision hangs on, with amounts), `relation_events.py` (which changes of relations are reported).
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
