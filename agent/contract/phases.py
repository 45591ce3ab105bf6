"""The phases of a step, and snapshots of an agent: the basis of stepping and rewinding."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from visup.agent.model.events import Directive
from visup.agent.model.mind import NO_ANSWERS, Mind


class Phase(StrEnum):
    """A phase of the cycle; a step goes through them in this order."""

    PERCEIVE = "perceive"
    UPDATE = "update"
    COGITATE = "cogitate"
    MATCH = "match"
    ATTEND = "attend"
    ACT = "act"


@dataclass(frozen=True, slots=True, eq=False)
class AgentSnapshot:
    """All that an agent has come to believe and ask for: with what was perceived since, its later steps.

    What behaviours hold is not part of it: they are not needed to reason again about what was
    perceived. `visup.agent.storage.checkpoint` keeps them too.

    Attributes:
        mind: The mind.
        directives: What behaviours were asked for.
        alerts_opened: How many alerts were ever opened, from which new ones are numbered.
        answers: What the operator has said since the last step.
    """

    mind: Mind
    directives: tuple[Directive, ...] = ()
    alerts_opened: int = 0
    answers: Mapping[int, str] = field(default_factory=lambda: NO_ANSWERS)
