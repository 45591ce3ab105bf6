"""Tables of the contents of a mind for the terminal, readable at 80 columns."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from visup.agent import (
    Alert,
    Mind,
    ObjectBelief,
    Observation,
    Question,
    Relation,
    RelationTable,
    Report,
    TaskBelief,
)
from visup.tasks.supervision.sentences import prospects_text
from visup.wording import prose


def table(*headings: str, title: str | None = None) -> Table:
    """A table in the common style."""
    return Table(*headings, title=title, title_justify="left", pad_edge=False)


def regions_table(observation: Observation | None) -> RenderableType:
    """The regions of a frame."""
    if observation is None:
        return Text("no step has been taken yet")
    rows = table("region", "box", "area", "velocity px/s", "cut", "confidence")
    for r in observation.of("region"):
        box = ",".join(map(str, r.bbox))
        velocity = f"{r.velocity[0]:.1f}, {r.velocity[1]:.1f} ± {r.velocity_sigma:.1f}"
        cut = "yes" if r.cut else "no"
        rows.add_row(str(r.id), box, f"{r.area:.0f}", velocity, cut, f"{r.confidence:.2f}")
    return rows


def objects_table(beliefs: Iterable[ObjectBelief]) -> Table:
    """The objects believed to be there."""
    rows = table("id", "identity", "share", "presence", "box", "px/s", "depth")
    for b in sorted(beliefs, key=lambda b: b.id):
        speed = sum(v * v for v in b.region.velocity) ** 0.5
        depth = f"{b.depth:.1f}" if b.depth is not None else "unknown"
        box = ",".join(map(str, b.region.bbox))
        rows.add_row(
            str(b.id), b.name, f"{b.strength:.2f}", b.presence.value, box, f"{speed:.1f}", depth
        )
    return rows


def candidates_table(belief: ObjectBelief) -> Table:
    """The identities that an object may have."""
    rows = table("identity", "votes", "share", "likelihood", title=f"object {belief.id}")
    for c in belief.candidates:
        rows.add_row(c.name, f"{c.votes:.2f}", f"{c.share:.2f}", f"{c.confidence:.2f}")
    rows.add_row("none of the models", "", "", f"{belief.unknown:.2f}")
    return rows


def relations_table(relations: Iterable[Relation], object_id: int | None = None) -> Table:
    """Relations between objects; those of a single object include the less common ones."""
    rows = table("relation", "objects", "truth", "since", "value", "confidence")
    shown = relations
    if object_id is not None and isinstance(relations, RelationTable):
        shown = relations.all()
    for r in shown:
        if object_id is None or object_id in r.objects:
            value = "" if r.value is None else f"{r.value:.1f}"
            objects = " ".join(map(str, r.objects))
            since = f"{r.since:.1f} s"
            rows.add_row(r.name, objects, r.truth.value, since, value, f"{r.confidence:.2f}")
    return rows


def tasks_tree(mind: Mind) -> RenderableType:
    """The state of each task."""
    if not mind.tasks:
        return Text("no task was given")
    return Group(*map(task_tree, mind.tasks))


def task_tree(task: TaskBelief) -> Tree:
    """The state of one task."""
    tree = Tree(Text(prose(f"{task.task}: {task.verdict.value}  {task.evidence}".rstrip())))
    for s in task.stages:
        marker = "> " if s.stage == task.current else "  "
        line = f"{marker}{s.stage}: {s.status.value} since {s.since:.1f} s  {s.evidence}"
        tree.add(Text(prose(line.rstrip())))
    for b in task.bindings:
        object_text = (
            f"object {b.object_id} ({b.strength:.2f})" if b.object_id is not None else "no object"
        )
        tree.add(Text(f"  {b.actor} is bound to {object_text}"))
    tree.add(Text(prose(f"  {prospects_text(task)}")))
    if task.active < 1.0:
        tree.add(Text(f"  active with probability {task.active:.2f}"))
    return tree


def alerts_list(alerts: Iterable[Alert]) -> RenderableType:
    """The open alerts."""
    return Text("\n".join(map(alert_line, alerts)) or "no open alerts")


def alert_line(a: Alert) -> str:
    """One alert."""
    closed = "" if a.closed is None else f", closed at {a.closed:.1f} s"
    return f"{a.id}  {a.severity.name.lower()}  since {a.opened:.1f} s{closed}  {prose(a.cause)}"


def questions_list(questions: Iterable[Question]) -> RenderableType:
    """The questions that await an answer."""
    return Text("\n".join(q.text for q in questions) or "no open questions")


def behaviours_table(reports: Iterable[Report]) -> RenderableType:
    """The reports of behaviours."""
    rows = table("behaviour", "state", "percepts", "ms", "error")
    for r in reports:
        count, took = str(len(r.percepts)), f"{r.elapsed_ms:.1f}"
        rows.add_row(r.behaviour, r.state.value, count, took, r.error)
    return rows
