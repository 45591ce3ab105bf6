"""What a run says on the terminal: one line for each event worth telling, and the verdict last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.console import Console
from rich.table import Table
from rich.text import Text

from visup.agent import Event, Frame, Severity, Verdict
from visup.agent.model.step import Step
from visup.agent.storage.jsonable import event_record
from visup.terminal.console import echo_json
from visup.wording import prose, worded_once

STYLE = {Severity.INFO: "default", Severity.WARNING: "yellow", Severity.CRITICAL: "bold red"}
MARK = {Severity.INFO: " ", Severity.WARNING: "!", Severity.CRITICAL: "‼"}
VERDICT_STYLE = {
    Verdict.SUCCEEDED: "bold green",
    Verdict.IN_PROGRESS: "bold cyan",
    Verdict.FAILED: "bold red",
    Verdict.INTERRUPTED: "bold yellow",
    Verdict.UNKNOWN: "bold magenta",
}
VERDICT_TEXT = {
    Verdict.SUCCEEDED: "the task went as intended",
    Verdict.IN_PROGRESS: "the task was still in progress at the end, and nothing was wrong",
    Verdict.FAILED: "the task failed",
    Verdict.INTERRUPTED: "something unsafe or unexpected interrupted it",
    Verdict.UNKNOWN: "the task could not be followed",
}


@dataclass(frozen=True, slots=True)
class Narrator:
    """Prints events as they come. Give it to an agent as an observer.

    Attributes:
        console: Where to.
        as_json: One JSON object a line instead of sentences.
    """

    console: Console
    as_json: bool = False

    def __call__(self, step: Step, frame: Frame) -> None:
        """Print the events of one step."""
        self.print_events(step.events)

    def print_events(self, events: Sequence[Event]) -> None:
        """Print the events of one step."""
        for event in events if self.as_json else worded_once(events):
            self.print_event(event)

    def print_event(self, event: Event) -> None:
        """Print one event."""
        if self.as_json:
            echo_json(event_record(event), ensure_ascii=False, sort_keys=True)
        else:
            self.console.print(event_row(event))


def event_row(event: Event) -> Table:
    """One event as a row: time, mark, sentence; long sentences go on below themselves."""
    style = STYLE[event.severity]
    row = Table.grid(padding=(0, 1), expand=False)
    row.add_column(justify="right", min_width=8, style="dim", no_wrap=True)
    row.add_column(width=1, style=style)
    row.add_column(style=style)
    row.add_row(f"{event.time:.1f} s", MARK[event.severity], Text(prose(event.text)))
    return row


def verdict_line(verdict: Verdict | None) -> str:
    """The verdict as a line of rich markup; None stands for a run without a task."""
    if verdict is None:
        return "Verdict: [bold green]nothing unsafe was seen[/bold green] (no task was given)"
    style = VERDICT_STYLE[verdict]
    return f"Verdict: [{style}]{verdict.value}[/{style}] ({VERDICT_TEXT[verdict]})"
