"""What a run prints on the terminal: one line per notable event, and the verdict at the end."""

from __future__ import annotations

from dataclasses import dataclass, field

from rich.console import Console
from rich.table import Table
from rich.text import Text

from visup.agent import Event, Frame, Severity, Verdict
from visup.agent.model.step import Step
from visup.agent.storage.jsonable import event_record
from visup.narrative import Narrative, summary_lines
from visup.runs.result import RunResult
from visup.terminal.console import echo_json
from visup.wording import prose

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
    Verdict.INTERRUPTED: "something unsafe or unexpected interrupted the task",
    Verdict.UNKNOWN: "the task could not be followed",
}


@dataclass(slots=True)
class Narrator:
    """Prints the notable events of each step. Give it to an agent as an observer.

    Attributes:
        console: The console.
        as_json: Print every event as one line of JSON, instead of sentences.
        narrative: Chooses what to print.
        last: The last step.
    """

    console: Console
    as_json: bool = False
    narrative: Narrative = field(default_factory=Narrative)
    last: Step | None = None

    def __call__(self, step: Step, frame: Frame | None = None) -> None:
        """Print the notable events of one step."""
        self.last = step
        for event in step.events if self.as_json else self.narrative.lines(step, frame):
            self.print_event(event)

    def finish(self) -> None:
        """Print what remains when the run is over, and a summary."""
        if self.last is None or self.as_json:
            return
        for event in self.narrative.rest(self.last.time, self.last.frame_index):
            self.print_event(event)
        for text in summary_lines(self.narrative.log, self.narrative.paths):
            self.console.print(text, soft_wrap=True, markup=False)

    def print_event(self, event: Event) -> None:
        """Print one event."""
        if self.as_json:
            echo_json(event_record(event), ensure_ascii=False, sort_keys=True)
        elif self.console.is_terminal:
            self.console.print(event_row(event))
        else:
            # In a file or pipe: one line per event, so that it can be searched.
            self.console.print(Text(event_line(event)), soft_wrap=True)


def event_line(event: Event) -> str:
    """One event as one line of plain text: time, mark, sentence."""
    return f"{event.time:6.1f} s {MARK[event.severity]} {prose(event.text)}"


def event_row(event: Event) -> Table:
    """One event as a row: time, mark, sentence; long sentences wrap in their column."""
    style = STYLE[event.severity]
    row = Table.grid(padding=(0, 1), expand=False)
    row.add_column(justify="right", min_width=8, style="dim", no_wrap=True)
    row.add_column(width=1, style=style)
    row.add_column(style=style)
    row.add_row(f"{event.time:.1f} s", MARK[event.severity], Text(prose(event.text)))
    return row


def verdict_line(verdict: Verdict | None, *, has_task: bool = True, part: str = "") -> str:
    """The verdict as a line of rich markup.

    Args:
        verdict: None stands for a complete run without a task in which nothing unsafe was seen.
        has_task: Whether there was a task to judge.
        part: How much was seen, if not the whole source: ` in the first 2.0 s`.
    """
    if verdict is None:
        return (
            f"Verdict: [bold green]nothing unsafe was seen[/bold green]{part} (no task was given)"
        )
    style = VERDICT_STYLE[verdict]
    if not has_task and verdict is Verdict.UNKNOWN:
        unsure = f"[{style}]but the scene could not always be watched[/{style}]"
        return f"Verdict: nothing unsafe was seen{part}, {unsure} (no task was given)"
    if not has_task:
        return f"Verdict: [{style}]something unsafe was seen[/{style}]{part} (no task was given)"
    return f"Verdict: [{style}]{verdict.value}[/{style}]{part} ({VERDICT_TEXT[verdict]})"


def watched_part(result: RunResult) -> str:
    """How much of a source was seen, if not all of it; otherwise empty."""
    if not (result.problem or result.stopped):
        return ""
    frames = "1 frame" if result.steps == 1 else f"{result.steps} frames"
    until = "before it was stopped" if result.stopped else "before the source broke off"
    return f" in the {frames} ({result.seconds:.1f} s) {until}"
