"""The agent: the cogitation-action cycle, the mental model, behaviours, the journal.

Read in this order: `records.py` (what flows), `mind.py` (what is believed), `behaviour.py` (what
may be plugged in), `agent.py` (the cycle on one screen), `registry.py`, `journal.py`.
"""

from visup.agent.behaviour import Behaviour, Contract, Outcome, Thinker
from visup.agent.errors import VisupError
from visup.agent.mind import (
    Binding,
    Candidate,
    Coupling,
    Expectation,
    Mind,
    ObjectBelief,
    Presence,
    Relation,
    StageBelief,
    Status,
    TaskBelief,
    Verdict,
)
from visup.agent.records import (
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
    Percept,
    Region,
    Report,
    ReportState,
    Severity,
    Truth,
)

__all__ = [
    "Alert",
    "Behaviour",
    "Binding",
    "Candidate",
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
    "Mind",
    "ObjectBelief",
    "Observation",
    "Outcome",
    "Percept",
    "Presence",
    "Region",
    "Relation",
    "Report",
    "ReportState",
    "Severity",
    "StageBelief",
    "Status",
    "TaskBelief",
    "Thinker",
    "Truth",
    "Verdict",
    "VisupError",
]
