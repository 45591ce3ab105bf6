"""The records that flow through a step, and the mental model that they change.

Read `records.py` (frames, percepts, events, alerts), then `mind.py` (beliefs about objects and tasks) and
`step.py` (all of one step). `relation_table.py` on `relation_columns.py` holds the relations between
objects by columns; `orientation.py` is the convention of view directions; `errors.py` is the tree of
errors. `fast_replace.py` copies records quickly, `display.py` lets them show themselves in notebooks.
"""

from visup.agent.model.errors import VisupError
from visup.agent.model.mind import Mind, ObjectBelief, TaskBelief
from visup.agent.model.records import Event, Frame, Observation, Percept, Region
from visup.agent.model.relation_table import RelationTable
from visup.agent.model.step import Step

__all__ = [
    "Event",
    "Frame",
    "Mind",
    "ObjectBelief",
    "Observation",
    "Percept",
    "Region",
    "RelationTable",
    "Step",
    "TaskBelief",
    "VisupError",
]
