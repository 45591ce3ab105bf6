"""The mental model: beliefs about objects, their identity, motion and presence, and about tasks.

A mind is an immutable value; each step creates a new one. The memory of the reasoners is
part of it (`memory`), so that a snapshot of a mind is a snapshot of all reasoning.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from visup.agent.model.display import enable_display
from visup.agent.model.events import Alert
from visup.agent.model.fast_replace import replace
from visup.agent.model.memory import MemoryKey, Remembered
from visup.agent.model.object_beliefs import Coupling, ObjectBelief, Presence, Question
from visup.agent.model.records import Health, HealthStatus, Percept, Truth, empty
from visup.agent.model.relation_columns import Relation
from visup.agent.model.relation_table import RelationTable
from visup.agent.model.task_beliefs import TaskBelief

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

NO_OBJECTS: Mapping[int, ObjectBelief] = MappingProxyType({})
NO_ANSWERS: Mapping[int, str] = MappingProxyType({})
HEALTHY = Health(HealthStatus.OK)


@dataclass(frozen=True, slots=True)
class Zone:
    """A part of the scene that rules can name, as drawn in the settings.

    Attributes:
        name: Its name in rules and tasks.
        polygon: Corners (x, y), pixels of the image, at least three, in order.
        depth: (nearest, farthest) relative depth, or None for a zone without a range of depth.
        on_floor: Whether it lies on the floor: an object is in it by its foot points, not by its outline.
    """

    name: str
    polygon: tuple[tuple[float, float], ...]
    depth: tuple[float, float] | None = None
    on_floor: bool = False


@dataclass(frozen=True, eq=False)
class Mind:
    """All beliefs at one moment.

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
        questions: Open questions to the operator.
        answers: Object id -> the operator's answer.
        memory: Memory of the reasoners, by the names of their keys (`MemoryKey`); immutable values only.
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

    def recall(self, key: MemoryKey[Remembered]) -> Remembered:
        """The memory of a reasoner, or the default of its key."""
        found: Remembered = self.memory.get(key.name, key.default)
        return found

    def remember(self, key: MemoryKey[Remembered], value: Remembered, **changes: Any) -> Mind:
        """The same mind with one reasoner's memory replaced, and other fields with it.

        Args:
            key: The reasoner's key.
            value: The new memory; must be immutable.
            changes: Field -> value.
        """
        memory = MappingProxyType({**self.memory, key.name: value})
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

    def one_machine(self, a: int, b: int) -> bool:
        """Whether two objects are parts of one machine, as a task declares its parts."""
        return any(a in parts and b in parts for task in self.tasks for parts in task.machines)

    def relation(self, name: str, *objects: int) -> Relation | None:
        """The relation of that name between exactly these objects, or None if it is not evaluated.

        The order of the objects matters only for relations that are not symmetric.
        """
        return self._table.find(name, *objects)

    def truth(self, name: str, a: int, b: int) -> Truth | None:
        """Truth of the relation of that name from a to b, or None if it is not evaluated."""
        return self._table.truth(name, a, b)

    def holding(self, *names: str) -> tuple[Relation, ...]:
        """The true relations with the given names, by their objects."""
        return self._table.holding(*names)

    def holding_objects(self, *names: str) -> list[tuple[tuple[int, ...], str]]:
        """Objects and names of the relations that `holding` returns."""
        return self._table.holding_objects(*names)

    def truth_codes(self, name: str, ids: Sequence[int]) -> NDArray[np.int8]:
        """A relation between all pairs of the given objects: (n, n) codes, 1 true, -1 false, 0 unknown."""
        return self._table.truth_codes(name, ids)

    def truth_tables(self, names: tuple[str, ...], ids: Sequence[int]) -> NDArray[np.int8]:
        """Several relations between all pairs of the given objects: (k, n, n) codes as in `truth_codes`."""
        return self._table.truth_tables(names, ids)

    @property
    def _table(self) -> RelationTable:
        given = self.relations
        return given if isinstance(given, RelationTable) else RelationTable(extra=given)


enable_display(Mind, Zone)
