"""The records that flow through a step, and the mental model that they change.

Read `records.py` (frames, percepts, observations) and `events.py` (events, alerts, directives), then
`object_beliefs.py`, `task_beliefs.py` and `mind.py` (all that is believed), `memory.py` (what reasoners
remember) and `step.py` (all of one step). `relation_table.py` on `relation_columns.py` holds the
relations between objects by columns; `orientation.py` is the convention of view directions; `errors.py`
is the tree of errors. `fast_replace.py` copies records quickly, `display.py` lets them show themselves in
notebooks.
"""

from visup.agent.model.errors import VisupError
from visup.agent.model.events import Event
from visup.agent.model.mind import Mind
from visup.agent.model.object_beliefs import ObjectBelief
from visup.agent.model.records import Frame, Observation, Percept, Region
from visup.agent.model.relation_table import RelationTable
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import TaskBelief

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
