"""`visup replay`: reason again about a recorded run, and show what that changes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.commands.watch import Actors, Rules, Tasks, Zones

if TYPE_CHECKING:
    from collections.abc import Iterator

    from visup.runs.replay import Transcript, TranscriptDiff


def replay(
    run: Annotated[Path, typer.Argument(help="Run folder of `visup watch`, or its journal.")],
    task: Tasks = None,
    rules: Rules = None,
    actor: Actors = None,
    zones: Zones = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write the new run to this folder.")
    ] = None,
    diff: Annotated[
        bool, typer.Option("--diff", help="Show what changes against the recorded run.")
    ] = False,
    against: Annotated[
        Path | None, typer.Option(metavar="RUN", help="Show what changes against this other run.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Only the last lines.")] = False,
) -> None:
    """Reason again about what a run perceived, with other tasks, rules or actors.

    Exit code: with --diff or --against 0 when nothing changes and 1 when something does; else as of
    `visup watch`. 2 on bad input.
    """
    from rich.console import Console

    from visup.agent.storage.journal_reader import Recording
    from visup.runs.replay import recorded_transcript, settings_for, transcript_diff
    from visup.runs.replay import replay as reason_again
    from visup.runs.runner import fresh_folder
    from visup.runs.settings import parse_actors
    from visup.terminal.narrator import Narrator, verdict_line

    console = Console(highlight=False)
    recording = Recording.open(run)
    other = Recording.open(against) if against else recording if diff else None
    settings = settings_for(
        recording,
        tasks=tuple(task or ()),
        rules=tuple(rules or ()),
        actors=parse_actors(actor or ()),
        zones=zones,
    )
    folder = fresh_folder(out, settings.source) if out else None
    narrator = Narrator(console)
    told = reason_again(
        recording,
        settings,
        folder,
        None if quiet or other else lambda step: narrator.print_events(step.events),
    )
    console.print(_speed(told), style="dim")
    if other is None:
        from visup.agent import Verdict

        console.print(verdict_line(Verdict(told.verdict) if told.verdict else None))
        raise typer.Exit(int(told.failed))
    changed = transcript_diff(recorded_transcript(other), told)
    for text in _lines(changed, quiet):
        console.print(text, soft_wrap=True, markup=False)
    raise typer.Exit(int(bool(changed)))


def _speed(told: Transcript) -> str:
    rate = told.steps / told.seconds if told.seconds else 0.0
    return f"{told.steps} frames reasoned about again in {told.seconds:.1f} s ({rate:.0f} a second)"


def _lines(changed: TranscriptDiff, quiet: bool) -> Iterator[str]:
    if not changed:
        yield "Nothing changes."
        return
    marked = [("-", e) for e in changed.gone] + [("+", e) for e in changed.new]
    for mark, event in [] if quiet else sorted(marked, key=lambda m: float(m[1].get("time", 0))):
        yield f"{mark} {float(event.get('time', 0)):7.1f} s  {event.get('text', '')}"
    for group, (gone, new) in changed.counts().items():
        if gone or new:
            yield f"{group}: {gone} gone, {new} new"
    before, after = changed.verdicts
    if before != after:
        yield f"verdict: {before or 'none'} -> {after or 'none'}"
