"""The agent: the cogitation-action cycle, the mental model, behaviours, the journal.

Read in this order: `records.py` (what flows), `mind.py` (what is believed),
`relations.py` (what holds between objects), `behaviour.py` (what
may be plugged in), `agent.py` (the cycle on one screen), `perceive.py`, `slot.py`, `limits.py` (how
behaviours are contained), `registry.py`, `journal.py`.
"""

from visup.agent.contract.behaviour import Behaviour, Contract, Outcome, Reasoner
from visup.agent.contract.limits import Limits
from visup.agent.model.errors import VisupError
from visup.agent.model.mind import (
    Binding,
    Candidate,
    Coupling,
    Expectation,
    Mind,
    ObjectBelief,
    Pose,
    Presence,
    Prospect,
    Question,
    Spin,
    StageBelief,
    Status,
    TaskBelief,
    Verdict,
    Zone,
)
from visup.agent.model.notebook import showing
from visup.agent.model.records import (
    Alert,
    Concern,
    Depth,
    Directive,
    Event,
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Past,
    Percept,
    Region,
    Report,
    ReportState,
    Severity,
    Truth,
)
from visup.agent.model.relation_columns import Column, Relation
from visup.agent.model.relation_table import RelationTable

__all__ = [
    "Alert",
    "Behaviour",
    "Binding",
    "Candidate",
    "Column",
    "Concern",
    "Contract",
    "Coupling",
    "Depth",
    "Directive",
    "Event",
    "Expectation",
    "Frame",
    "Health",
    "HealthStatus",
    "Hypothesis",
    "Limits",
    "Mind",
    "ObjectBelief",
    "Observation",
    "Outcome",
    "Past",
    "Percept",
    "Pose",
    "Presence",
    "Prospect",
    "Question",
    "Reasoner",
    "Region",
    "Relation",
    "RelationTable",
    "Report",
    "ReportState",
    "Severity",
    "Spin",
    "StageBelief",
    "Status",
    "TaskBelief",
    "Truth",
    "Verdict",
    "VisupError",
    "Zone",
]

showing(
    *(Alert, Binding, Candidate, Concern, Coupling, Depth, Directive, Event, Expectation, Frame),
    *(
        Health,
        Hypothesis,
        Mind,
        ObjectBelief,
        Observation,
        Outcome,
        Percept,
        Pose,
        Question,
        Region,
    ),
    *(Prospect, Relation, RelationTable, Report, Spin, StageBelief, TaskBelief, Zone),
)
