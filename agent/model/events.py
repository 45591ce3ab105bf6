"""Events, alerts with their conditions, and directives to behaviours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any

from visup.agent.model.display import enable_display
from visup.agent.model.records import empty


class Severity(IntEnum):
    """How much an event or alert matters."""

    INFO = 0
    WARNING = 1
    CRITICAL = 2


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, reported once.

    Attributes:
        kind: 'entry', 'noticed' (it was in view before it was seen to move), 'exit', 'occlusion',
            'reappearance', 'coupled', 'decoupled', 'relation', 'identified', 'stage_started',
            'stage_progressing', 'stage_failing', 'stage_done', 'verdict', 'health', ...
        time: Seconds.
        frame_index: Frame at which it was reported.
        text: The sentence for the narrative, complete, with full stop.
        objects: Ids of the objects concerned, the subject first.
        confidence: 0 to 1.
        severity: INFO unless a person should look.
        data: Small JSON-like details (relation name, stage, ...).
    """

    kind: str
    time: float
    frame_index: int
    text: str
    objects: tuple[int, ...] = ()
    confidence: float = 1.0
    severity: Severity = Severity.INFO
    data: Mapping[str, Any] = field(default_factory=empty)


@dataclass(frozen=True, slots=True)
class AlertCondition:
    """A reason for an alert that currently holds; the act phase opens and closes alerts accordingly.

    Attributes:
        kind: 'collision_course', 'unexpected_object', 'stage_failing', ...
        objects: Ids of the objects concerned.
        severity: How grave it is.
        cause: The sentence for the narrative, with full stop.
        evidence: Facts that led to it, one sentence each.
        key: Distinguishes conditions of one kind and the same objects (such as a stage).
        needs: Kinds of percept without which it is unknown whether it is over.
    """

    kind: str
    objects: tuple[int, ...]
    severity: Severity
    cause: str
    evidence: tuple[str, ...] = ()
    key: str = ""
    needs: tuple[str, ...] = ("region",)


@dataclass(frozen=True)
class Alert:
    """An event that a person should act on, from opening to closing.

    Attributes:
        id: Number within the run, from 1.
        kind: As of its condition.
        severity: How grave it is.
        opened: Seconds.
        updated: Seconds, when the condition last held.
        closed: Seconds, or None while open.
        objects: Ids of the objects concerned.
        cause: One sentence.
        evidence: Facts, one sentence each.
        key: As of its condition.
        needs: As of its condition.
        unsure: Seconds when it was last unknown whether it is over, since it was updated; or None.
    """

    id: int
    kind: str
    severity: Severity
    opened: float
    updated: float
    objects: tuple[int, ...]
    cause: str
    evidence: tuple[str, ...] = ()
    closed: float | None = None
    key: str = ""
    needs: tuple[str, ...] = ()
    unsure: float | None = None


WAKE = "wake"
"""Kind of the directive that wakes a behaviour."""


@dataclass(frozen=True, slots=True)
class Directive:
    """A request from reasoning to behaviours, with its reason.

    Attributes:
        kind: 'expect_regions' (data: count), 'look_at' (data: bbox), 'ignore' (data: bbox),
            'try_first' (data: names), 'restrict' (data: names), 'wake' (data: behaviour, object, region),
            'ask' (data: question), 'rest' (data: behaviour, region, every_s).
        reason: One sentence.
        data: As the kind says.
    """

    kind: str
    reason: str
    data: Mapping[str, Any] = field(default_factory=empty)


enable_display(Alert, AlertCondition, Directive, Event)
