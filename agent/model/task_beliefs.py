"""Beliefs about a task: its stages, the objects that play its actors, its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from visup.agent.model.display import enable_display


class Status(StrEnum):
    """Status of a stage."""

    PENDING = "pending"
    ACTIVE = "active"
    PROGRESSING = "progressing"
    PAUSED = "paused"
    STALLED = "stalled"
    FAILING = "failing"
    FAILED = "failed"
    DONE = "done"
    UNKNOWN = "unknown"


class Verdict(StrEnum):
    """Verdict on a task as a whole."""

    IN_PROGRESS = "in_progress"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    INTERRUPTED = "interrupted"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Binding:
    """An actor of a task matched to an object.

    Attributes:
        actor: Name in the task file.
        models: Model names that the actor may be.
        object_id: The object believed to play it, or None when none does.
        strength: Strength of that belief, 0 to 1.
        guessed: Whether the only evidence is that no other object is left for the actor.
    """

    actor: str
    models: tuple[str, ...]
    object_id: int | None = None
    strength: float = 0.0
    guessed: bool = False


@dataclass(frozen=True, slots=True)
class Expectation:
    """An action that the current stage of a task requires; it suspends rules.

    Attributes:
        relation: Name of the relation, such as 'converging'.
        objects: Ids of the objects that play its actors.
    """

    relation: str
    objects: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Prospect:
    """What may come next in a task.

    Attributes:
        stage: Name of the stage that begins; empty for the end of the task.
        probability: 0 to 1.
    """

    stage: str
    probability: float


@dataclass(frozen=True, slots=True)
class StageBelief:
    """The belief about one stage of a task.

    Attributes:
        stage: Its name.
        status: Pending, active, progressing, ...
        since: Seconds since when it has this status.
        confidence: 0 to 1.
        evidence: One sentence: why.
        begun: Whether it has been observed since it was last pending; the first stage begins with the task.
    """

    stage: str
    status: Status
    since: float
    confidence: float = 1.0
    evidence: str = ""
    begun: bool = False


@dataclass(frozen=True)
class TaskBelief:
    """The belief about one task.

    Attributes:
        task: Its name.
        verdict: Overall.
        stages: In the order of the task.
        current: Name of the stage that is under way, or None.
        bindings: Which object plays which actor.
        expected: Relations that the current stage requires.
        unexplained: Ids of objects that no actor of the task explains.
        bystanders: Ids of objects that the task ignores.
        machines: For each machine of which parts are found, the ids of these parts.
        confidence: 0 to 1.
        evidence: One sentence: why the verdict is what it is.
        prospects: Stages that may come next, or the end, likeliest first; their probabilities and that of
            a failure before sum to 1.
        success: Probability that the task will succeed, or None while it is not followed.
        active: Probability that the task is in progress at all; 1 if it is the only one given.
    """

    task: str
    verdict: Verdict
    stages: tuple[StageBelief, ...] = ()
    current: str | None = None
    bindings: tuple[Binding, ...] = ()
    expected: tuple[Expectation, ...] = ()
    unexplained: tuple[int, ...] = ()
    confidence: float = 1.0
    evidence: str = ""
    prospects: tuple[Prospect, ...] = ()
    success: float | None = None
    active: float = 1.0
    bystanders: tuple[int, ...] = ()
    machines: tuple[tuple[int, ...], ...] = ()


enable_display(Binding, Expectation, Prospect, StageBelief, TaskBelief)
