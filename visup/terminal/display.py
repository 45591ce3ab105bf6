"""The display of public records on the terminal and in notebooks.

`shown(record)` returns a rich renderable, `html(record)` the same for Jupyter. The records of `visup.agent`
do not depend on this module: it is used when they are printed with rich or are the result of a notebook cell,
if it can be imported (see `visup/agent/model/display.py`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import singledispatch
from io import StringIO
from typing import Any

from rich.console import Console, Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from visup.agent import (
    Alert,
    Directive,
    Event,
    Frame,
    Mind,
    ObjectBelief,
    Observation,
    Percept,
    Region,
    Relation,
    RelationTable,
    Report,
    StageBelief,
    TaskBelief,
)
from visup.agent.model.step import Step
from visup.report.pictures import html_picture, text_picture
from visup.stepping.cursor import PausedStep, StepResult
from visup.stepping.diff import MindChange, MindDiff
from visup.stepping.explanations.evidence import Why, percept_text
from visup.terminal.narrator import event_row
from visup.terminal.tables import (
    alert_line,
    alerts_list,
    behaviours_table,
    candidates_table,
    objects_table,
    questions_list,
    regions_table,
    relations_table,
    task_tree,
)
from visup.wording import worded_once

WIDTH = 80
_MARKS = {"+": "green", "-": "red", "~": "yellow"}


@singledispatch
def shown(record: Any) -> RenderableType:
    """A record as a rich renderable for 80 columns.

    Args:
        record: Any public record; unknown types are shown by their fields.
    """
    if not is_dataclass(record) or isinstance(record, type):
        return Text(str(record))
    rows = Table.grid(padding=(0, 1))
    for field in fields(record):
        if not field.name.startswith("_"):
            rows.add_row(
                Text(field.name, style="dim"), Text(_short_text(getattr(record, field.name)))
            )
    return Panel(rows, title=type(record).__name__, title_align="left", expand=False)


def html(record: Any) -> str:
    """A record as self-contained HTML for a notebook cell, with its picture if it has one."""
    picture = record.draw() if isinstance(record, Step) and record.frame else None
    return ("" if picture is None else html_picture(picture)) + html_of(_renderable(record))


def html_of(text: RenderableType) -> str:
    """A rich renderable as self-contained HTML."""
    console = Console(record=True, width=WIDTH + 20, file=StringIO(), force_jupyter=False)
    console.print(text)
    style = "font-family:Menlo,'DejaVu Sans Mono',monospace;line-height:1.2;white-space:pre"
    page = console.export_html(
        inline_styles=True, code_format=f'<pre style="{style}">{{code}}</pre>'
    )
    # Table borders are drawn in characters that do not join in notebook fonts.
    return _VERTICAL_RULE.sub(" ", _HORIZONTAL_RULE.sub("", page))


_HORIZONTAL_RULE = re.compile("(?m)^[┏┓┗┛┡┩┳┻╇━┌┐└┘├┤┬┴┼─]+\n")
_VERTICAL_RULE = re.compile("[┃│]")


def _short_text(value: object, max_length: int = 60) -> str:
    """A value in brief: arrays by their shape, long texts truncated."""
    shape = getattr(value, "shape", None)
    if shape is not None and shape != ():
        return f"{getattr(value, 'dtype', '')} array of {'x'.join(map(str, shape))}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, Mapping):
        value = dict(value)
    if is_dataclass(value) and not isinstance(value, type):
        return type(value).__name__
    text = str(value)
    return text if len(text) <= max_length else f"{text[: max_length - 3]}..."


@shown.register
def _(record: Step) -> RenderableType:
    text = _renderable(record)
    return Group(text_picture(record.draw()), text) if record.frame else text


def _renderable(record: Any) -> RenderableType:
    return _step_summary(record) if isinstance(record, Step) else shown(record)


def _step_summary(record: Step) -> RenderableType:
    head = Text(f"step of frame {record.frame_index}, {record.time:.2f} s", style="bold")
    events: list[RenderableType] = [event_row(e) for e in worded_once(record.events)]
    events = events or [Text("no events", style="dim")]
    directives = [shown(d) for d in record.directives]
    return Group(head, *events, objects_table(record.mind.objects.values()), *directives)


@shown.register
def _(record: Mind) -> RenderableType:
    head = f"mind at frame {record.frame_index}, {record.time:.2f} s, camera {record.health.status.value}"
    parts: list[RenderableType] = [Text(head, style="bold")]
    parts.append(objects_table(record.objects.values()))
    parts += [Text(f"{len(record.relations)} relations, {len(record.couplings)} couplings")]
    parts += [task_tree(t) for t in record.tasks]
    parts += [alerts_list(record.alerts)] if record.alerts else []
    parts += [questions_list(record.questions)] if record.questions else []
    if record.unknown:
        parts.append(
            Text(f"currently unknown: {', '.join(sorted(record.unknown))}", style="yellow")
        )
    return Group(*parts)


@shown.register
def _(record: Observation) -> RenderableType:
    width, height = record.frame_size
    head = f"frame {record.frame_index}, {record.time:.2f} s, {width}x{height} pixels"
    tree = Tree(Text(head, style="bold"))
    for report in record.reports:
        branch = tree.add(Text(_report(report)))
        for percept in report.percepts[:12]:
            branch.add(Text(percept_text(percept.value).removeprefix("that ")))
        if more := len(report.percepts) - 12:
            branch.add(Text(f"and {more} more", style="dim")) if more > 0 else None
    return tree


def _report(r: Report) -> str:
    error = f": {r.error}" if r.error else ""
    count = "1 percept" if len(r.percepts) == 1 else f"{len(r.percepts)} percepts"
    return f"{r.behaviour} {r.state.value}, {count}{error}"


@shown.register
def _(record: Report) -> RenderableType:
    return Group(
        behaviours_table((record,)), *(Text(percept_text(p.value)) for p in record.percepts)
    )


@shown.register
def _(record: Frame) -> RenderableType:
    width, height = record.size
    return Text(f"frame {record.index}, {record.time:.2f} s, {width}x{height} pixels")


@shown.register
def _(record: Region) -> RenderableType:
    seen = Observation(0, 0.0, (0, 0), (_report_of(record),))
    return Group(regions_table(seen), Text(_silhouette(record)))


def _report_of(region: Region) -> Report:
    from visup.agent import ReportState

    return Report("", ReportState.RAN, ("region",), (Percept("region", region, 0.0, ""),))


def _silhouette(region: Region, columns: int = 40) -> str:
    """The mask in characters, with twice as many pixels per row as per column, like letters."""
    _, width = region.mask.shape
    step = max(1, -(-width // columns))
    rows = region.mask[:: 2 * step, ::step]
    return "\n".join("".join("#" if inside else "." for inside in row) for row in rows)


@shown.register
def _(record: Percept) -> RenderableType:
    head = f"{record.kind} by {record.source} at {record.time:.2f} s, confidence {record.confidence:.2f}"
    return Group(Text(head, style="bold"), Text(percept_text(record.value)))


@shown.register
def _(record: Event) -> RenderableType:
    return event_row(record)


@shown.register
def _(record: Alert) -> RenderableType:
    tree = Tree(Text(alert_line(record)))
    for fact in record.evidence:
        tree.add(Text(fact))
    return tree


@shown.register
def _(record: Directive) -> RenderableType:
    data = ", ".join(f"{k} {_short_text(v, 40)}" for k, v in record.data.items())
    return Text(f"asks: {record.kind} ({data}). {record.reason}", style="dim")


@shown.register
def _(record: ObjectBelief) -> RenderableType:
    return Group(objects_table((record,)), candidates_table(record))


@shown.register
def _(record: Relation) -> RenderableType:
    return relations_table((record,))


@shown.register
def _(record: RelationTable) -> RenderableType:
    return relations_table(record)


@shown.register
def _(record: TaskBelief) -> RenderableType:
    return task_tree(record)


@shown.register
def _(record: StageBelief) -> RenderableType:
    told = f"{record.stage}: {record.status.value} since {record.since:.1f} s  {record.evidence}"
    return Text(told.rstrip())


@shown.register
def _(record: Why) -> RenderableType:
    tree = Tree(Text(record.line()))
    _add_parts(tree, record)
    return tree


def _add_parts(tree: Tree, why: Why) -> None:
    for part in why.parts:
        style = "cyan" if part.percept is not None else ""
        _add_parts(tree.add(Text(part.line(), style=style)), part)


@shown.register
def _(record: MindDiff) -> RenderableType:
    (a, b), (s, t) = record.frames, record.times
    head = Text(f"from frame {a} ({s:.2f} s) to frame {b} ({t:.2f} s)", style="bold")
    changes = [shown(c) for c in record.changes] or [Text("no differences")]
    return Group(head, *changes)


@shown.register
def _(record: MindChange) -> RenderableType:
    text = str(record)
    return Text(text, style=_MARKS[text[0]])


@shown.register
def _(record: PausedStep) -> RenderableType:
    head = f"inside frame {record.observation.frame_index}, after {record.phase.value}"
    told = record.outcome.events if record.outcome else ()
    return Group(Text(head, style="bold"), *(event_row(e) for e in told))


@shown.register
def _(record: StepResult) -> RenderableType:
    told = [event_row(e) for step in record.steps for e in worded_once(step.events)]
    why = [Text(f"stopped: {reason}", style="bold") for reason in record.reasons]
    end = [Text("the source has ended", style="yellow")] if record.ended else []
    return Group(*told, *why, *end, Text(f"{record.taken} steps", style="dim"))
