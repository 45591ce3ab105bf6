"""Flow charts of a task for Mermaid and Graphviz."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from visup.tasks.grammar.nodes import (
    Action,
    Actors,
    Already,
    AnyOrder,
    Choice,
    Comparison,
    Conditioned,
    Counted,
    Course,
    Reference,
    Repeated,
    Sequence,
    Stage,
    Task,
    Timed,
    Together,
)

BEGIN, END = "start", "finish"  # `end` is a keyword of Mermaid


@dataclass(frozen=True, slots=True)
class Node:
    """A box: its lines, and its stage (empty for none)."""

    lines: tuple[str, ...]
    stage: str = ""


@dataclass
class Flow:
    """A flow chart.

    Attributes:
        nodes: Number -> box, in the order of the text.
        edges: (from, to) -> label of the arrow.
    """

    nodes: dict[str, Node] = field(default_factory=dict)
    edges: dict[tuple[str, str], str] = field(default_factory=dict)

    def add(self, node: Node) -> str:
        """Add a box; returns its number."""
        number = f"n{len(self.nodes)}"
        self.nodes[number] = node
        return number

    def link(self, before: Iterable[str], after: Iterable[str], label: str = "") -> None:
        """Add arrows from each box of `before` to each of `after`."""
        others = tuple(after)
        for a in before:
            for b in others:
                self.edges.setdefault((a, b), label)


@dataclass(frozen=True, slots=True)
class _Fragment:
    """A part of the chart: its first and last boxes, and whether it is optional."""

    first: tuple[str, ...]
    last: tuple[str, ...]
    empty: bool = False


def flow_of(task: Task) -> Flow:
    """The flow of a task; a stage is drawn at its first reference, later only named."""
    flow = Flow()
    root = task.stage(task.name)
    if root is not None:
        whole = _Drawer(task, flow).stage(root)
        flow.link([BEGIN], whole.first)
        flow.link(whole.last, [END])
        if whole.empty:
            flow.link([BEGIN], [END])
    return flow


def mermaid(flow: Flow) -> str:
    """A flow as a Mermaid flowchart."""
    lines = ["flowchart TD", f"    {BEGIN}(( ))", f"    {END}((( )))"]
    lines += [f'    {k}["{_mermaid_text(n.lines)}"]' for k, n in flow.nodes.items()]
    for (a, b), label in flow.edges.items():
        said = f"|{_mermaid_text((label,))}|" if label else ""
        lines.append(f"    {a} -->{said} {b}")
    return "\n".join(lines)


def dot(flow: Flow) -> str:
    """A flow as Graphviz source."""
    lines = ["digraph task {", "    node [shape=box, style=rounded];"]
    lines += [f"    {BEGIN} [shape=point];", f'    {END} [shape=doublecircle, label=""];']
    lines += [f'    {k} [label="{_dot_text(n.lines)}"];' for k, n in flow.nodes.items()]
    for (a, b), label in flow.edges.items():
        said = f' [label="{_dot_text((label,))}"]' if label else ""
        lines.append(f"    {a} -> {b}{said};")
    return "\n".join([*lines, "}"])


def _mermaid_text(lines: tuple[str, ...]) -> str:
    text = "<br>".join(
        x.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") for x in lines
    )
    return text.replace('"', "&quot;").replace("|", "&#124;")


def _dot_text(lines: tuple[str, ...]) -> str:
    return "\\n".join(x.replace("\\", "\\\\").replace('"', '\\"') for x in lines)


@dataclass
class _Drawer:
    task: Task
    flow: Flow
    drawn: set[str] = field(default_factory=set)

    def stage(self, stage: Stage) -> _Fragment:
        self.drawn.add(stage.name)
        if isinstance(stage.body, Actors):
            return self.box(str(Action(stage.name, stage.body.names)), stage=stage.name)
        return self.course(stage.body, stage.name, ())

    def box(self, *lines: str, stage: str = "") -> _Fragment:
        number = self.flow.add(Node(lines, stage))
        return _Fragment((number,), (number,))

    def course(self, course: Course, stage: str, said: tuple[str, ...]) -> _Fragment:
        """A part of the chart; `said` are the surrounding clauses, written into its boxes."""
        match course:
            case Action() | Comparison():
                return self.box(f"<{stage}>", str(course), *said, stage=stage)
            case Reference(stage=name):
                return self.reference(name, stage, said)
            case Timed(item=item, clauses=clauses):
                return self.course(item, stage, (*map(str, clauses), *said))
            case Conditioned(item=item, conditions=signs):
                return self.course(item, stage, (*map(str, signs), *said))
            case Choice(options=options):
                parts = [self.course(o, stage, said) for o in options]
                return _Fragment(
                    tuple(x for p in parts for x in p.first),
                    tuple(x for p in parts for x in p.last),
                    any(p.empty for p in parts),
                )
            case Sequence(items=items):
                return self.sequence([self.course(i, stage, said) for i in items])
            case Together(parts=items):
                return self.fork("at the same time", items, stage, said)
            case AnyOrder(items=(first, *_), new=str(new)) if new:
                part = self.course(first, stage, said)
                self.flow.link(part.last, part.first, f"another {new}")
                return _Fragment(part.first, part.last, part.empty or course.least == 0)
            case AnyOrder(items=items):
                return self.fork("each, in any order", items, stage, said)
            case Already(item=item):
                return self.course(item, stage, ("already", *said))
            case Repeated(item=item, mark=mark):
                part = self.course(item, stage, said)
                if mark != "?":
                    self.flow.link(part.last, part.first, "again")
                return _Fragment(part.first, part.last, part.empty or mark != "+")
            case Counted(item=item, least=least, times=times):
                part = self.course(item, stage, said)
                self.flow.link(part.last, part.first, times)
                return _Fragment(part.first, part.last, part.empty or least == 0)

    def reference(self, name: str, stage: str, said: tuple[str, ...]) -> _Fragment:
        target = self.task.stage(name)
        if target is None:
            return self.box(f"<{name}>", *said, stage=name)
        if isinstance(target.body, Actors):
            action = Action(name, target.body.names)
            return self.course(action, stage, said)
        if name in self.drawn:
            return self.box(f"<{name}>", "as above", *said, stage=name)
        self.drawn.add(name)
        return self.course(target.body, name, said)

    def sequence(self, parts: list[_Fragment]) -> _Fragment:
        first: list[str] = []
        last: list[str] = []
        empty = True
        for part in parts:
            self.flow.link(last, part.first)
            if empty:
                first += part.first
            last = [*part.last, *(last if part.empty else ())]
            empty = empty and part.empty
        return _Fragment(tuple(first), tuple(last), empty)

    def fork(
        self, title: str, items: tuple[Course, ...], stage: str, said: tuple[str, ...]
    ) -> _Fragment:
        opening = self.box(title)
        parts = [self.course(i, stage, said) for i in items]
        closing = self.box("all of them")
        for part in parts:
            self.flow.link(opening.last, part.first)
            self.flow.link(part.last, closing.first)
        return _Fragment(opening.first, closing.last, all(p.empty for p in parts))
