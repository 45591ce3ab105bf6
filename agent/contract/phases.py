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
    """The reasoning state of an agent: with the observations that followed, it determines all later steps.

    The state of behaviours is not part of it, since replaying recorded observations does not need them.
    `visup.agent.storage.checkpoint` saves that too.

    Attributes:
        mind: The mind.
        directives: Pending requests to behaviours.
        alerts_opened: Number of alerts opened so far, from which new ones are numbered.
        answers: Answers of the operator since the last step.
    """

    mind: Mind
    directives: tuple[Directive, ...] = ()
    alerts_opened: int = 0
    answers: Mapping[int, str] = field(default_factory=lambda: NO_ANSWERS)
