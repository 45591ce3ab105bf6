"""Differences between two minds: objects, identities, relations, tasks and alerts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from visup.agent import Mind, ObjectBelief, Truth
from visup.agent.model.display import enable_display

Key = tuple[str, str]


@dataclass(frozen=True, slots=True)
class MindChange:
    """One difference.

    Attributes:
        about: 'object', 'identity', 'pose', 'measured', 'relation', 'coupling', 'task', 'stage', 'actor',
            'alert', 'question', 'answer', 'camera', 'unknown', 'percept'.
        what: The item, such as 'object 2' or 'touching(1, 2)'.
        before: Its old value; None if it appears.
        after: Its new value; None if it vanishes.
    """

    about: str
    what: str
    before: str | None
    after: str | None

    def __neg__(self) -> MindChange:
        return MindChange(self.about, self.what, self.after, self.before)

    def __str__(self) -> str:
        if self.before is None:
            return f"+ {self.about} {self.what}: {self.after}"
        if self.after is None:
            return f"- {self.about} {self.what}: {self.before}"
        return f"~ {self.about} {self.what}: {self.before} -> {self.after}"


@dataclass(frozen=True, slots=True)
class MindDiff:
    """All differences between two minds; false if there are none.

    Attributes:
        frames: Numbers of their frames.
        times: Seconds.
        changes: The differences in a fixed order of topics.
    """

    frames: tuple[int, int]
    times: tuple[float, float]
    changes: tuple[MindChange, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.changes)

    def __neg__(self) -> MindDiff:
        return MindDiff(self.frames[::-1], self.times[::-1], tuple(-c for c in self.changes))

    def about(self, *kinds: str) -> tuple[MindChange, ...]:
        """The changes of some kinds."""
        return tuple(c for c in self.changes if c.about in kinds)

    def __str__(self) -> str:
        (a, b), (s, t) = self.frames, self.times
        head = f"from frame {a} ({s:.2f} s) to frame {b} ({t:.2f} s)"
        return "\n".join([head, *(f"  {c}" for c in self.changes or ("no differences",))])


def mind_diff(first: Mind, second: Mind) -> MindDiff:
    """The differences between two minds."""
    relations = _true_relations(first) | _true_relations(second)
    before, after = ({**dict(_belief_texts(m)), **_truths(m, relations)} for m in (first, second))
    order = sorted({*before, *after}, key=lambda key: (_ORDER.index(key[0]), key[1]))
    return MindDiff(
        (first.frame_index, second.frame_index),
        (first.time, second.time),
        tuple(
            MindChange(*key, before.get(key), after.get(key))
            for key in order
            if before.get(key) != after.get(key)
        ),
    )


_ORDER = (
    "camera",
    "unknown",
    "object",
    "identity",
    "pose",
    "measured",
    "coupling",
    "relation",
    "task",
    "stage",
    "actor",
    "alert",
    "question",
    "answer",
    "percept",
)


def _belief_texts(mind: Mind) -> Iterator[tuple[Key, str]]:
    """The beliefs of a mind as texts by topic and item."""
    yield ("camera", "health"), mind.health.status.value
    for kind in sorted(mind.unknown):
        yield ("unknown", kind), "could not be observed"
    for belief in mind.objects.values():
        yield from _of_object(belief)
    for coupling in mind.couplings:
        yield ("coupling", _call("", coupling.objects)), f"since {coupling.since:.2f} s"
    yield from _of_tasks(mind)
    for a in mind.alerts:
        yield ("alert", str(a.id)), f"{a.kind} {_call('', a.objects)}, {a.severity.name.lower()}"
    for q in mind.questions:
        yield ("question", f"object {q.object_id}"), " or ".join(q.names)
    for object_id, name in mind.answers.items():
        yield ("answer", f"object {object_id}"), name
    for kind, percepts in mind.percepts.items():
        yield ("percept", kind), _shortened("; ".join(str(p.value) for p in percepts))


def _of_object(b: ObjectBelief) -> Iterator[tuple[Key, str]]:
    item = f"object {b.id}"
    yield ("object", item), b.presence.value if b.confirmed else f"{b.presence.value}, unconfirmed"
    named = ", ".join(f"{c.name} {c.confidence:.2f}" for c in b.candidates)
    yield ("identity", item), named or f"{b.name} {b.unknown:.2f}"
    if b.pose is not None:
        spin = f", {b.pose.spin.rate:.0f} deg/s" if b.pose.spin else ""
        yield ("pose", item), f"{b.pose.name} view {b.pose.view}{spin}"
    x, y, w, h = b.region.bbox
    depth = "" if b.depth is None else f", depth {b.depth:.1f}"
    speed = ", ".join(f"{v:.0f}" for v in b.region.velocity)
    yield ("measured", item), f"box {x},{y} {w}x{h}, ({speed}) px/s{depth}"


def _of_tasks(mind: Mind) -> Iterator[tuple[Key, str]]:
    for task in mind.tasks:
        yield ("task", task.task), f"{task.verdict.value}, at {task.current or 'no stage'}"
        for s in task.stages:
            yield ("stage", f"{task.task}.{s.stage}"), s.status.value
        for b in task.bindings:
            who = "nobody" if b.object_id is None else f"object {b.object_id}"
            yield ("actor", f"{task.task}.{b.actor}"), who


def _true_relations(mind: Mind) -> frozenset[tuple[str, tuple[int, ...]]]:
    """The true relations among the listed ones."""
    return frozenset((r.name, r.objects) for r in mind.relations if r.truth is Truth.TRUE)


def _truths(mind: Mind, relations: frozenset[tuple[str, tuple[int, ...]]]) -> dict[Key, str]:
    """The truth of relations, without those not evaluated."""
    found = {key: mind.relation(key[0], *key[1]) for key in relations}
    return {("relation", _call(*key)): r.truth.value for key, r in found.items() if r is not None}


def _call(name: str, objects: tuple[int, ...]) -> str:
    return f"{name}({', '.join(map(str, objects))})"


def _shortened(text: str, max_length: int = 60) -> str:
    return text if len(text) <= max_length else f"{text[: max_length - 3]}..."


enable_display(MindChange, MindDiff)
