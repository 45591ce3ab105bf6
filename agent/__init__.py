"""The agent: the cogitation-action cycle, the mental model, behaviours, the journal.

Rooms, in the order in which to read them:

1. `model/`: the records that flow through a step, and the mental model.
2. `contract/`: what may be plugged in, and what is promised to it.
3. `cycle/`: the cycle on one screen (`cycle/agent.py`).
4. `execution/`: how behaviours are run and contained.
5. `plugins/`: how behaviours are found and made.
6. `storage/`: journals and checkpoints.
"""

from dataclasses import is_dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

from visup.agent.contract.behaviour import Behaviour, Outcome, Reasoner
from visup.agent.contract.contract import Contract
from visup.agent.contract.limits import Limits
from visup.agent.contract.phases import AgentSnapshot, Phase
from visup.agent.contract.saving import Saveable, Stateless
from visup.agent.model.display import enable_display
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

if TYPE_CHECKING:
    from visup.agent.cycle.agent import Agent, Reasoners
    from visup.agent.plugins.registry import Registry, discover_behaviours

_LAZY = {
    "Agent": "visup.agent.cycle.agent",
    "Reasoners": "visup.agent.cycle.agent",
    "Registry": "visup.agent.plugins.registry",
    "discover_behaviours": "visup.agent.plugins.registry",
}
"""Names that bring NumPy and the behaviours' runners: imported when first asked for."""

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


if not TYPE_CHECKING:  # else every name would be there for checkers

    def __getattr__(name: str) -> Any:
        if name not in _LAZY:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return getattr(import_module(_LAZY[name]), name)


_NOT_SHOWN = {AgentSnapshot, Column, Contract, Limits, MemoryKey, PastFrame}
enable_display(
    *{k for k in list(vars().values()) if isinstance(k, type) and is_dataclass(k)} - _NOT_SHOWN
)
