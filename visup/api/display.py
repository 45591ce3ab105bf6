"""How runs and tables look on a terminal and in a notebook."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from itertools import islice
from typing import Any

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from visup.agent.model.events import Event
from visup.agent.model.step import Step
from visup.agent.model.task_beliefs import Verdict
from visup.report.pictures import html_picture, text_picture
from visup.terminal.display import html_of
from visup.terminal.narrator import event_row, verdict_line
from visup.wording import worded_once

MAX_EVENTS = 12
MAX_ROWS = 10


def run_summary(
    title: str, events: Iterable[Event], verdict: Verdict | None, *, has_task: bool
) -> RenderableType:
    """A run as text: title, latest events, verdict so far.

    Args:
        title: What the text is about.
        events: All events of the run.
        verdict: The verdict so far.
        has_task: Whether there is a task.
    """
    lines = worded_once(tuple(events))
    head = [Text(f"{len(lines) - MAX_EVENTS} earlier events", style="dim")]
    return Group(
        Text(title, style="bold"),
        *(head if len(lines) > MAX_EVENTS else ()),
        *(event_row(e) for e in lines[-MAX_EVENTS:]),
        Text.from_markup(verdict_line(verdict, has_task=has_task)),
    )


def with_picture(text: RenderableType, step: Step | None) -> RenderableType:
    """A text below the picture of a step, for a terminal."""
    return Group(text_picture(step.draw()), text) if step and step.frame else text


def html_with_picture(text: RenderableType, step: Step | None) -> str:
    """A text below the picture of a step, for a notebook."""
    return (html_picture(step.draw()) if step and step.frame else "") + html_of(text)


def rows(title: str, records: Iterable[Any]) -> RenderableType:
    """The first of some records as a table, as wide as the terminal."""
    first_records = list(islice(records, MAX_ROWS + 1))
    table = Table(title=title, title_justify="left", box=None, header_style="dim")
    names = _field_names(first_records[0]) if first_records else ()
    for name in names:
        table.add_column(name, no_wrap=name != "text", overflow="ellipsis")
    for record in first_records[:MAX_ROWS]:
        table.add_row(*(_short_text(getattr(record, name)) for name in names))
    return Group(table, *([Text("...")] if len(first_records) > MAX_ROWS else []))


def _field_names(record: Any) -> tuple[str, ...]:
    return tuple(f.name for f in fields(record))[:8] if is_dataclass(record) else ()


def _short_text(value: object) -> Text:
    if isinstance(value, float):
        return Text(f"{value:.6g}")
    text = value if isinstance(value, str | int | tuple) or value is None else type(value).__name__
    return Text(str(text))
