"""The agent: the cogitation-action cycle, the mental model, behaviours, the journal.

Rooms, in the order in which to read them:

1. `model/`: the records that flow through a step, and the mental model.
2. `contract/`: the interface of plug-ins, and its guarantees.
3. `cycle/`: the cycle on one screen (`cycle/agent.py`).
4. `execution/`: how behaviours are run, and their faults contained.
5. `plugins/`: how behaviours are found and created.
6. `storage/`: journals and checkpoints.

Names are loaded when they are first used, so that importing an error class does not load the rest.
"""

from typing import TYPE_CHECKING

from visup.agent.lazy_names import lazy_names

if TYPE_CHECKING:
    from visup.agent.contract.behaviour import Behaviour, Outcome, Reasoner
    from visup.agent.contract.contract import Contract
    from visup.agent.contract.limits import Limits
    from visup.agent.contract.phases import AgentSnapshot, Phase
    from visup.agent.contract.saving import Saveable, Stateless
    from visup.agent.cycle.agent import Agent, Reasoners
    from visup.agent.model.errors import VisupError
    from visup.agent.model.events import Alert, AlertCondition, Directive, Event, Severity
    from visup.agent.model.memory import MemoryKey
    from visup.agent.model.mind import Mind, Zone
    from visup.agent.model.object_beliefs import (
        Candidate,
        Coupling,
        ObjectBelief,
        Pose,
        Presence,
        Question,
        Spin,
    )
    from visup.agent.model.records import (
        CameraMotion,
        Depth,
        Frame,
        Health,
        HealthStatus,
        Hypothesis,
        Observation,
        PastFrame,
        Percept,
        Region,
        Report,
        ReportState,
        Truth,
    )
    from visup.agent.model.relation_columns import Column, Relation
    from visup.agent.model.relation_table import RelationTable
    from visup.agent.model.step import Step
    from visup.agent.model.task_beliefs import (
        Binding,
        Expectation,
        Prospect,
        StageBelief,
        Status,
        TaskBelief,
        Verdict,
    )
    from visup.agent.plugins.registry import Registry, discover_behaviours

__all__ = [
    "Agent",
    "AgentSnapshot",
    "Alert",
    "AlertCondition",
    "Behaviour",
    "Binding",
    "CameraMotion",
    "Candidate",
    "Column",
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
    "MemoryKey",
    "Mind",
    "ObjectBelief",
    "Observation",
    "Outcome",
    "PastFrame",
    "Percept",
    "Phase",
    "Pose",
    "Presence",
    "Prospect",
    "Question",
    "Reasoner",
    "Reasoners",
    "Region",
    "Registry",
    "Relation",
    "RelationTable",
    "Report",
    "ReportState",
    "Saveable",
    "Severity",
    "Spin",
    "StageBelief",
    "Stateless",
    "Status",
    "Step",
    "TaskBelief",
    "Truth",
    "Verdict",
    "VisupError",
    "Zone",
    "discover_behaviours",
]


# Where each name is found when it is first used; type checkers and editors read the imports above.
__getattr__ = lazy_names(
    __name__,
    {
        "visup.agent.contract.behaviour": (
            "Behaviour",
            "Outcome",
            "Reasoner",
        ),
        "visup.agent.contract.contract": ("Contract",),
        "visup.agent.contract.limits": ("Limits",),
        "visup.agent.contract.phases": (
            "AgentSnapshot",
            "Phase",
        ),
        "visup.agent.contract.saving": (
            "Saveable",
            "Stateless",
        ),
        "visup.agent.cycle.agent": (
            "Agent",
            "Reasoners",
        ),
        "visup.agent.model.errors": ("VisupError",),
        "visup.agent.model.events": (
            "Alert",
            "AlertCondition",
            "Directive",
            "Event",
            "Severity",
        ),
        "visup.agent.model.memory": ("MemoryKey",),
        "visup.agent.model.mind": (
            "Mind",
            "Zone",
        ),
        "visup.agent.model.object_beliefs": (
            "Candidate",
            "Coupling",
            "ObjectBelief",
            "Pose",
            "Presence",
            "Question",
            "Spin",
        ),
        "visup.agent.model.records": (
            "CameraMotion",
            "Depth",
            "Frame",
            "Health",
            "HealthStatus",
            "Hypothesis",
            "Observation",
            "PastFrame",
            "Percept",
            "Region",
            "Report",
            "ReportState",
            "Truth",
        ),
        "visup.agent.model.relation_columns": (
            "Column",
            "Relation",
        ),
        "visup.agent.model.relation_table": ("RelationTable",),
        "visup.agent.model.step": ("Step",),
        "visup.agent.model.task_beliefs": (
            "Binding",
            "Expectation",
            "Prospect",
            "StageBelief",
            "Status",
            "TaskBelief",
            "Verdict",
        ),
        "visup.agent.plugins.registry": (
            "Registry",
            "discover_behaviours",
        ),
    },
)
