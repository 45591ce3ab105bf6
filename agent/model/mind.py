"""The mental model: what is believed about objects, their identity, motion, presence and tasks.

A mind is an immutable value; a step makes a new one. All that reasoners remember from step to step
stands in it too (`memory`), so that a snapshot of a mind is a snapshot of everything that reasons.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from visup.agent.model.fast_replace import replace
from visup.agent.model.records import Alert, Health, HealthStatus, Percept, Region, Truth, empty
from visup.agent.model.relation_columns import Relation
from visup.agent.model.relation_table import RelationTable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NO_OBJECTS: Mapping[int, ObjectBelief] = MappingProxyType({})
NO_ANSWERS: Mapping[int, str] = MappingProxyType({})
HEALTHY = Health(HealthStatus.OK)
UNKNOWN_OBJECT = "unknown object"


class Presence(StrEnum):
    """Where an object is believed to be."""

    SEEN = "seen"
    HIDDEN = "hidden"
    LEFT = "left"


class Status(StrEnum):
    """How a stage of a task stands."""

    PENDING = "pending"
    ACTIVE = "active"
    PROGRESSING = "progressing"
    STALLED = "stalled"
    FAILING = "failing"
    FAILED = "failed"
    DONE = "done"
    UNKNOWN = "unknown"


class Verdict(StrEnum):
    """How a task as a whole stands."""

    IN_PROGRESS = "in_progress"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    INTERRUPTED = "interrupted"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Candidate:
    """An identity that an object may have.

    Attributes:
        name: Model name.
        votes: Time-discounted votes (paper, section 5).
        share: Share of all votes for the object, 0 to 1.
        confidence: How likely it is the right one, 0 to 1; what is left over those of all candidates
            is how likely the object is none of the models known.
    """

    name: str
    votes: float
    share: float
    confidence: float = 0.0


@dataclass(frozen=True, slots=True)
class Spin:
    """How fast an object turns about itself.

    Attributes:
        rate: Degrees per second, not negative.
        sigma: Standard deviation of `rate`.
        axis: Unit vector in the camera's frame (x right, y down, z forward), about which it turns by
            the right-hand rule.
    """

    rate: float
    sigma: float
    axis: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """Which way an object faces under its most likely identity (paper, section 5, figure 5).

    Attributes:
        name: The model.
        view: Number of the view within the model.
        direction: Unit vector from the object to the viewer in the model's frame.
        rotation: In-plane rotation from view to region, radians, or None when it is not known.
        since: Seconds since when this view is believed.
        confidence: 0 to 1.
        spin: How it turns, or None while that is not known.
    """

    name: str
    view: int
    direction: tuple[float, float, float]
    rotation: float | None
    since: float
    confidence: float = 1.0
    spin: Spin | None = None


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the scene that rules can name, as drawn in the settings.

    Attributes:
        name: What rules call it.
        polygon: Corners (x, y), pixels of the image, at least three, in order.
        depth: (nearest, farthest) relative depth, or None when the zone is drawn in the image alone.
    """

    name: str
    polygon: tuple[tuple[float, float], ...]
    depth: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Question:
    """What the operator is asked: which of some candidates an object is.

    Attributes:
        object_id: The object.
        names: The candidates, most likely first.
        asked: Seconds.
        text: The sentence, with question mark.
    """

    object_id: int
    names: tuple[str, ...]
    asked: float
    text: str


@dataclass(frozen=True, eq=False)
class ObjectBelief:
    """What is believed about one object.

    Attributes:
        id: Stable number; an object keeps it through occlusion and reappearance.
        region: The region as last seen.
        presence: Seen, hidden or left.
        first_seen: Seconds.
        last_seen: Seconds.
        confirmed: Seen often enough to have had its entry told.
        candidates: Identities, most likely first; empty while nothing is known.
        depth: Relative depth in the units of the best candidate's model, or None when unknown.
        depth_sigma: Standard deviation of `depth`.
        pose: Which way it faces and how it spins, or None while that is not known.
        unknown: How likely it is none of the models known, 0 to 1.
    """

    id: int
    region: Region
    presence: Presence
    first_seen: float
    last_seen: float
    confirmed: bool = False
    candidates: tuple[Candidate, ...] = ()
    depth: float | None = None
    depth_sigma: float | None = None
    pose: Pose | None = None
    unknown: float = 1.0

    @property
    def name(self) -> str:
        """Most likely identity, or 'unknown object'."""
        return self.candidates[0].name if self.candidates else UNKNOWN_OBJECT

    @property
    def strength(self) -> float:
        """Vote share of the most likely identity, 0 to 1."""
        return self.candidates[0].share if self.candidates else 0.0

    @property
    def confidence(self) -> float:
        """How likely its name is right, 0 to 1; of an unknown object, how likely none is."""
        return self.candidates[0].confidence if self.candidates else self.unknown


@dataclass(frozen=True, slots=True)
class Coupling:
    """Two objects believed to be rigidly connected.

    Attributes:
        objects: Ids, smaller first.
        since: Seconds.
    """

    objects: tuple[int, int]
    since: float


@dataclass(frozen=True, slots=True)
class Binding:
    """An actor of a task matched to an object.

    Attributes:
        actor: Name in the task file.
        models: Model names that the actor may be.
        object_id: The object believed to play it, or None when none does.
        strength: Strength of that belief, 0 to 1.
    """

    actor: str
    models: tuple[str, ...]
    object_id: int | None = None
    strength: float = 0.0


@dataclass(frozen=True, slots=True)
class Expectation:
    """An action that the current stage of a task asks for; rules are suspended by it.

    Attributes:
        relation: Name of the relation, such as 'converging'.
        objects: Ids of the objects that play its actors.
    """

    relation: str
    objects: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Prospect:
    """A stage that may begin next.

    Attributes:
        stage: Its name.
        probability: 0 to 1.
    """

    stage: str
    probability: float


@dataclass(frozen=True, slots=True)
class StageBelief:
    """How one stage of a task stands.

    Attributes:
        stage: Its name.
        status: Pending, active, progressing, ...
        since: Seconds since when it has this status.
        confidence: 0 to 1.
        evidence: One sentence: why.
    """

    stage: str
    status: Status
    since: float
    confidence: float = 1.0
    evidence: str = ""


@dataclass(frozen=True)
class TaskBelief:
    """How a task stands.

    Attributes:
        task: Its name.
        verdict: Overall.
        stages: In the order of the task.
        current: Name of the stage that is under way, or None.
        bindings: Which object plays which actor.
        expected: What the current stage asks for.
        unexplained: Ids of objects that no actor of the task explains.
        confidence: 0 to 1.
        evidence: One sentence: why the verdict is what it is.
        prospects: Stages that may begin next, the likeliest first; what is left of 1 is for the
            end of the task.
        success: Probability that the task still ends well, or None while nothing is followed.
        active: How likely it is that the task is going on at all; 1 when it is the only one given.
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


@dataclass(frozen=True, eq=False)
class Mind:
    """All that is believed at one moment.

    Attributes:
        time: Seconds of the last observation.
        frame_index: Number of the last frame.
        frame_size: (width, height) pixels.
        objects: By id, including those that are hidden or have left (until forgotten).
        relations: All relations evaluated in this step.
        couplings: Pairs believed to be rigidly connected.
        tasks: One for each active task.
        alerts: Open alerts.
        health: State of the camera.
        percepts: Latest percepts of plug-ins' own kinds, by kind.
        unknown: Kinds of percept that could not be observed in this step (a behaviour failed).
        actors: Actor name -> model names, as bound by the user or the task.
        zones: Parts of the scene that rules can name.
        questions: Those that wait for the operator's answer.
        answers: Object id -> what the operator said it is.
        memory: What reasoners remember, by reasoner; immutable values only.
    """

    time: float = 0.0
    frame_index: int = -1
    frame_size: tuple[int, int] = (0, 0)
    objects: Mapping[int, ObjectBelief] = field(default_factory=lambda: NO_OBJECTS)
    relations: RelationTable | tuple[Relation, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    tasks: tuple[TaskBelief, ...] = ()
    alerts: tuple[Alert, ...] = ()
    health: Health = HEALTHY
    percepts: Mapping[str, tuple[Percept, ...]] = field(default_factory=empty)
    unknown: frozenset[str] = frozenset()
    actors: Mapping[str, tuple[str, ...]] = field(default_factory=empty)
    zones: tuple[Zone, ...] = ()
    questions: tuple[Question, ...] = ()
    answers: Mapping[int, str] = field(default_factory=lambda: NO_ANSWERS)
    memory: Mapping[str, Any] = field(default_factory=empty)

    def remember(self, reasoner: str, value: object, **changes: Any) -> Mind:
        """The same mind with one reasoner's memory replaced, and other fields with it.

        Args:
            reasoner: Its name.
            value: What it remembers; must be immutable.
            changes: Field -> value.
        """
        memory = MappingProxyType({**self.memory, reasoner: value})
        return replace(self, memory=memory, **changes)

    def with_objects(self, *beliefs: ObjectBelief) -> Mind:
        """The same mind with beliefs about some objects added or replaced."""
        if all(self.objects.get(b.id) is b for b in beliefs):
            return self
        updated = {**self.objects, **{b.id: b for b in beliefs}}
        return replace(self, objects=MappingProxyType(updated))

    def present(self) -> tuple[ObjectBelief, ...]:
        """Confirmed objects that are seen or hidden, by id."""
        return tuple(
            b
            for _, b in sorted(self.objects.items())
            if b.confirmed and b.presence is not Presence.LEFT
        )

    def coupled(self, a: int, b: int) -> bool:
        """Whether two objects are believed to be rigidly connected."""
        return any(c.objects == (min(a, b), max(a, b)) for c in self.couplings)

    def relation(self, name: str, *objects: int) -> Relation | None:
        """The relation of that name between exactly these objects, or None when it is not judged.

        The order of the objects matters only for relations that are not symmetric.
        """
        return self._table.find(name, *objects)

    def truth(self, name: str, a: int, b: int) -> Truth | None:
        """Whether the relation of that name holds from a to b, or None when it is not judged."""
        return self._table.truth(name, a, b)

    def holding(self, *names: str) -> tuple[Relation, ...]:
        """The relations of some names that are true, by their objects."""
        return self._table.holding(*names)

    def holding_objects(self, *names: str) -> list[tuple[tuple[int, ...], str]]:
        """Objects and names of the relations that `holding` gives."""
        return self._table.holding_objects(*names)

    def truth_codes(self, name: str, ids: Sequence[int]) -> NDArray[np.int8]:
        """A relation between all of some objects: (n, n) codes, 1 true, -1 false, 0 unknown."""
        return self._table.truth_codes(name, ids)

    def truth_tables(self, names: tuple[str, ...], ids: Sequence[int]) -> NDArray[np.int8]:
        """Several relations between all of some objects: (k, n, n) codes as of `truths`."""
        return self._table.truth_tables(names, ids)

    @property
    def _table(self) -> RelationTable:
        given = self.relations
        return given if isinstance(given, RelationTable) else RelationTable(extra=given)
