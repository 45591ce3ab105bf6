"""`visup replay`: reason again about a recorded run, and show what that changes."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.commands.options import REPLAY_SETTINGS, OptionValues, takes
from visup.runs.settings import Option, WatchSettings
from visup.terminal.console import make_console

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from visup.agent.model.step import Step
    from visup.agent.storage.journal_reader import Recording
    from visup.runs.replay import Transcript, TranscriptDiff
    from visup.runs.replay_report import ReplayReport


@dataclass(frozen=True, slots=True)
class ReplayComparison:
    """The run that the replay is compared with, and how the result is shown."""

    diff: Annotated[bool, Option("Show what changes compared with the recorded run.", "--diff")] = (
        False
    )
    against: Annotated[
        Path | None, Option("Show what changes compared with another run.", metavar="RUN")
    ] = None
    quiet: Annotated[bool, Option("Print only the last lines.", "--quiet")] = False

    def other(self, recording: Recording) -> Recording | None:
        """The run that the replay of a recording is compared with, or None."""
        from visup.agent.storage.journal_reader import Recording

        return Recording.open(self.against) if self.against else recording if self.diff else None


@takes(WatchSettings, ReplayComparison, only=(*REPLAY_SETTINGS, "diff", "against", "quiet"))
def replay(
    options: OptionValues,
    comparison_options: OptionValues,
    run: Annotated[Path, typer.Argument(help="Run folder of `visup watch`, or its journal.")],
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write the replay to this folder as a run.")
    ] = None,
) -> None:
    """Reason again about a recorded run, with other tasks, rules or actors.

    Exit code: with --diff or --against, 0 if nothing changes and 1 if something does; otherwise that of
    `visup watch`. 2 for bad input.
    """
    from visup.agent.storage.journal_reader import Recording
    from visup.runs.replay import replay as reason_again
    from visup.runs.replay import settings_for
    from visup.runs.replay_report import ReplayReport
    from visup.runs.runner import fresh_folder
    from visup.terminal.narrator import Narrator

    console, comparison = make_console(), ReplayComparison(**comparison_options)
    recording = Recording.open(run)
    other = comparison.other(recording)
    settings = settings_for(recording, **options)
    folder = fresh_folder(out, settings.source) if out else None
    silent = comparison.quiet or other
    narrator = Narrator(console)
    with ExitStack() as stack:
        report = stack.enter_context(ReplayReport(recording, settings)) if folder else None

        def on_step(step: Step) -> None:
            if not silent:
                narrator(step)
            if report:
                report(step)

        transcript = reason_again(recording, settings, folder, on_step)
        if not silent:
            narrator.finish()
        console.print(_speed(transcript), style="dim")
        if report and folder:
            _write_report(console, report, folder, transcript)
    if other is None:
        raise typer.Exit(_print_verdict(console, transcript, has_task=bool(settings.tasks)))
    raise typer.Exit(_print_changes(console, other, transcript, comparison.quiet))


def _write_report(
    console: Console, report: ReplayReport, folder: Path, transcript: Transcript
) -> None:
    from visup.agent import Verdict

    path = report.write(folder, Verdict(transcript.verdict) if transcript.verdict else None)
    for note in report.notes:
        console.print(note, soft_wrap=True, markup=False, style="yellow")
    if path:
        console.print(f"Report:  {path}", soft_wrap=True, markup=False)


def _print_verdict(console: Console, transcript: Transcript, *, has_task: bool) -> int:
    """Print how the replay ended; returns the exit code."""
    from visup.agent import Verdict
    from visup.compiled import cache_note
    from visup.runs.result import RunResult
    from visup.terminal.narrator import verdict_line

    verdict = Verdict(transcript.verdict) if transcript.verdict else None
    for text in filter(None, (cache_note(), *transcript.at_end)):
        console.print(text, soft_wrap=True, markup=False, style="yellow")
    console.print(verdict_line(verdict, has_task=has_task))
    return RunResult(verdict, transcript.steps, has_task=has_task).exit_code


def _print_changes(console: Console, other: Recording, transcript: Transcript, quiet: bool) -> int:
    """Print what differs from the other run; returns the exit code."""
    from visup.runs.replay import recorded_transcript, transcript_diff

    changed = transcript_diff(recorded_transcript(other), transcript)
    for text in _lines(changed, quiet):
        console.print(text, soft_wrap=True, markup=False)
    return int(bool(changed))


def _speed(transcript: Transcript) -> str:
    rate = transcript.steps / transcript.seconds if transcript.seconds else 0.0
    return (
        f"{transcript.steps} frames replayed in {transcript.seconds:.1f} s ({rate:.0f} per second)"
    )


def _differing_events(changed: TranscriptDiff) -> Iterator[str]:
    """Events that only one of the two runs reported, by time; events with the same text share a line."""
    from visup.wording import prose

    gone, new = (
        dict.fromkeys((float(e.get("time", 0)), str(e.get("text", ""))) for e in events)
        for events in (changed.gone, changed.new)
    )
    marked = [("-", e) for e in gone if e not in new] + [("+", e) for e in new if e not in gone]
    for mark, (time, text) in sorted(marked, key=lambda m: m[1][0]):
        yield f"{mark} {time:7.1f} s  {prose(text)}"


def _lines(changed: TranscriptDiff, quiet: bool) -> Iterator[str]:
    if not changed:
        yield "Nothing changes."
        return
    if not quiet:
        yield from _differing_events(changed)
    for group, (gone, new) in changed.counts().items():
        if gone or new:
            yield f"{group}: {gone} gone, {new} new"
    before, after = changed.verdicts
    if before != after:
        yield f"verdict: {before or 'none'} -> {after or 'none'}"
