"""`visup archive`: fill, compact and report on lakes of many runs."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.archive.chunks.spans import SHORTEST_CHUNK_S, Cutting
from visup.archive.filling.pool_settings import PoolSettings
from visup.archive.parallel import Workers
from visup.commands.archives.calibrate import calibrate
from visup.commands.archives.lake_argument import Into, LakePlace
from visup.commands.options import REPLAYED, Given, SettingsFile, takes
from visup.commands.watch import watch_settings
from visup.runs.settings import Option, WatchSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.console import Console

    from visup.archive.filling.filling import FillResult
    from visup.archive.filling.plan import FailedClip, Plan
    from visup.archive.filling.watching import ClipOutcome
    from visup.archive.lake import Lake
    from visup.archive.replaying import RunChanges
    from visup.archive.storing.lake_store import LakeStore

FILLED = (
    "tasks",
    "models",
    "rules",
    "actors",
    "bystanders",
    "behaviours",
    "plugins",
    "plugin_settings",
    "isolate",
    "every",
    "pace",
    "fps",
    "fov_vertical_deg",
    "zones",
    "motion",
    "preset",
    "attention",
    *("workers", "scheduler", "memory_gb"),
    *("plan", "retry", "chunk"),
)
"""Settings that apply to every clip, without those for live sources or single clips."""

app = typer.Typer(no_args_is_help=True)


@dataclass(frozen=True, slots=True)
class ManyRuns:
    """How runs are processed in parallel."""

    workers: Workers = None


@dataclass(frozen=True, slots=True)
class FillOptions:
    """Further options for filling a lake."""

    plan: Annotated[bool, Option("Only print what would be done.", "--plan")] = False
    retry: Annotated[bool, Option("Retry clips that were set aside after failing.", "--retry")] = (
        False
    )
    chunk: Annotated[
        float | None,
        Option(
            "Split longer clips into chunks of this length, which are watched in parallel.",
            metavar="SECONDS",
            at_least=SHORTEST_CHUNK_S,
        ),
    ] = None

    @property
    def cutting(self) -> Cutting | None:
        """How to split clips; None for not at all."""
        return None if self.chunk is None else Cutting(self.chunk)


@app.command("run")
@takes(WatchSettings, PoolSettings, FillOptions, only=FILLED)
def run(
    setting: Given,
    where: Given,
    wanted: Given,
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="SOURCE...",
            help="Clips, folders, patterns ('*.mp4'), URLs, manifests (.csv, .parquet).",
        ),
    ],
    into: Into,
    settings_file: SettingsFile = None,
) -> None:
    """Watch many clips on many workers, and store the runs in a lake.

    Clips whose run is already in the lake are skipped, so the same command continues after an interruption.
    Exit code: 0 if all runs are in the lake, 1 if some clips failed (the others are stored), 2 for bad
    input, 130 if you stopped it.
    """
    from visup.archive.filling.clips import clips_of
    from visup.archive.filling.filling import clear_attempts, only_filler
    from visup.archive.filling.plan import make_plan
    from visup.archive.storing.places import create_lake, is_lake, open_lake, settle, store_of
    from visup.terminal.console import make_console

    console, pool, options = make_console(), PoolSettings(**where), FillOptions(**wanted)
    settings = watch_settings("", setting, settings_file)
    clips = clips_of(sources)
    if options.plan:
        there = open_lake(into) if is_lake(into) else None
        _print_plan(
            console, into, make_plan(there, clips, settings, options.cutting), pool.processes
        )
        return
    lake, store = create_lake(into), store_of(into)
    with only_filler(lake):
        clear_attempts(lake, retry=options.retry)
        todo = make_plan(lake, clips, settings, options.cutting)
        _print_plan(console, into, todo, pool.processes)
        result = _filled(console, lake, todo, pool, store)
        settle(lake, store)
    for text in _closing(result):
        console.print(text, soft_wrap=True, markup=False)
    raise typer.Exit(1 if result.failed else 0)


@app.command("add")
def add(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Run folders of `visup watch`.")
    ],
    into: Into,
) -> None:
    """Add recorded runs to a lake; runs that are already there are skipped.

    Exit code: 1 if a run could not be added (the others are added), 2 for bad input.
    """
    from visup.agent.model.errors import VisupError
    from visup.archive.adding import add_run
    from visup.archive.storing.places import create_lake, store_of
    from visup.terminal.console import echo, print_error

    lake, store, failed = create_lake(into), store_of(into), 0
    for folder in runs:
        try:
            key, added = add_run(lake, folder)
        except VisupError as fault:
            print_error(str(fault))
            failed += 1
        else:
            echo(f"{key}  {folder}" if added else f"{key}  {folder} was already there")
    if store:
        store.push(lake)
    raise typer.Exit(1 if failed else 0)


@app.command("compact")
def compact(
    lake: LakePlace,
    now: Annotated[
        bool,
        typer.Option(
            "--now",
            help="Remove replaced files immediately; only while nobody is querying the lake.",
        ),
    ] = False,
) -> None:
    """Merge the files of many runs, so that queries on large lakes take seconds.

    Replaced files are removed by the next call, after ten minutes at the earliest, since a query may still
    be reading them.
    """
    from visup.archive.filling.filling import only_filler
    from visup.archive.joining import compacting
    from visup.archive.storing.places import open_lake, store_of
    from visup.terminal.console import echo

    found, store = open_lake(lake), store_of(lake)
    with only_filler(found):
        done = compacting.compact(found, grace_s=0.0 if now else compacting.GRACE_S)
        if store:
            store.push(found)
        merged = _counted(done.joined, "run")
        parts = f"Merged {merged}; the lake has {_counted(done.partitions, 'partition')}."
        gone = f" Replaced files of {done.tidied} runs were removed." if done.tidied else ""
    echo(f"{parts}{gone}")


app.command("calibrate")(calibrate)


@app.command("report")
def report(
    lake: LakePlace,
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="The page to write (default: report.html in the lake's folder)."
        ),
    ] = None,
) -> None:
    """Write a page about all runs: stage durations by week and actor, drift, and how runs fail."""
    from visup.archive.filling.stores import is_url
    from visup.archive.querying.database import open_database
    from visup.archive.reporting.page import write_lake_page
    from visup.archive.reporting.statistics import lake_statistics
    from visup.archive.storing.places import open_lake
    from visup.terminal.console import echo

    path = out or Path("" if is_url(lake) else lake) / "report.html"
    with open_database(open_lake(lake)) as database:
        found = lake_statistics(database)
    write_lake_page(found, Path(lake), path)
    echo(f"{path}: {_counted(found.runs, 'run')}")


@app.command("replay")
@takes(WatchSettings, ManyRuns, only=(*REPLAYED, "workers"))
def replay(
    setting: Given,
    wanted: Given,
    lake: LakePlace,
) -> None:
    """Reason again about all runs of a lake, with other rules, tasks or actors, and report what changes.

    Exit code: 0 if nothing changes, 1 if something does, 2 for bad input.
    """
    from visup.archive.replaying import ChangeSummary, changes
    from visup.archive.storing.places import open_lake
    from visup.terminal.console import make_console

    console, summary, found = make_console(), ChangeSummary(), open_lake(lake)
    for one in changes(found, found.runs(), **wanted, **setting):
        summary.take(one)
        if one.diff:
            console.print(_changed(one), soft_wrap=True, markup=False)
    for text in summary.lines():
        console.print(text, soft_wrap=True, markup=False)
    raise typer.Exit(1 if summary.changed else 0)


def _changed(one: RunChanges) -> str:
    """What changes in a run, in one line."""
    lost, gained = one.alerts
    parts = [f"{kind}: {lost.get(kind, 0)} lost, {gained.get(kind, 0)} gained"
            for kind in sorted({*lost, *gained})]  # fmt: skip
    before, after = one.diff.verdicts
    parts += [f"verdict {before or 'none'} -> {after or 'none'}"] if before != after else []
    return f"{one.clip}: {'; '.join(parts) or 'other events'} ({one.folder})"


def _filled(
    console: Console, lake: Lake, plan: Plan, where: PoolSettings, store: LakeStore | None
) -> FillResult:
    """Process the clips that have no run yet, and report on each."""
    from visup.archive.filling.filling import FillResult, fill
    from visup.archive.filling.plan import check_settings
    from visup.archive.filling.pool import open_pool
    from visup.archive.storing.places import pushed

    for failed in plan.failed:
        _print_failure(console, failed)
    if not plan.jobs:
        return FillResult(failed=list(plan.failed))
    for warning in check_settings(plan.jobs):
        console.print(warning, style="yellow", soft_wrap=True, markup=False)
    try:
        with open_pool(where) as pool, _progress(console, plan) as notify:
            if pool.dashboard:
                console.print(f"Dashboard: {pool.dashboard}", soft_wrap=True, markup=False)
            return fill(lake, plan, pool, pushed(store, lake, notify))
    except KeyboardInterrupt:
        console.print("Stopped. Run the same command again to continue.")
        raise typer.Exit(130) from None


@contextmanager
def _progress(console: Console, plan: Plan) -> Iterator[Callable[[ClipOutcome], None]]:
    """One line per clip and, on a terminal, a progress bar; the time left is estimated from file sizes."""
    from rich import progress

    sizes = {job.run: job.bytes for job in plan.jobs}
    bar = progress.Progress(
        "{task.fields[clips]}",
        progress.BarColumn(),
        "{task.fields[speed]}",
        progress.TimeRemainingColumn(elapsed_when_finished=True),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
    with bar:
        task = bar.add_task("", total=plan.bytes or 1, clips="", speed="")
        done, video_s = 0, 0.0

        def notify(outcome: ClipOutcome) -> None:
            nonlocal done, video_s
            done, video_s = done + 1, video_s + outcome.video_s
            _print_outcome(console, outcome)
            took = bar.tasks[0].elapsed or 0.0
            speed = f"{video_s / took:.1f} s of video per second" if took > 1.0 else ""
            bar.update(
                task,
                advance=sizes[outcome.run],
                clips=f"{done} of {len(plan.jobs)} clips",
                speed=speed,
            )

        yield notify


def _print_outcome(console: Console, outcome: ClipOutcome) -> None:
    if outcome.failure:
        _print_failure(console, outcome.failure)
        return
    parts = f"{outcome.source}: {outcome.verdict or 'watched'}, {outcome.video_s:.0f} s of video"
    console.print(f"{parts} in {outcome.wall_s:.0f} s", soft_wrap=True, markup=False)


def _print_failure(console: Console, failed: FailedClip) -> None:
    word = "set aside" if failed.put_aside else "failed"
    text = f"{failed.source}: {word}: {failed.reason}"
    console.print(text, style="yellow", soft_wrap=True, markup=False)


def _print_plan(console: Console, into: str, plan: Plan, workers: int) -> None:
    from visup.archive.filling.filling import estimated_s
    from visup.archive.storing.places import copy_of

    parts = [f"{len(plan.jobs)} to watch ({_size(plan.bytes)})"]
    cut = [len(job.spans) for job in plan.jobs if job.spans]
    parts += [f"{len(cut)} of them in {sum(cut)} chunks"] if cut else []
    parts += [f"{plan.present} already in the lake"] if plan.present else []
    parts += [f"{plan.same} duplicates"] if plan.same else []
    parts += [f"{len(plan.failed)} cannot be watched"] if plan.failed else []
    seconds = estimated_s(copy_of(into), plan.bytes, workers)
    if plan.jobs and seconds is not None:
        parts.append(f"about {_duration(seconds)} on {_counted(max(1, workers), 'worker')}")
    console.print(f"Clips: {', '.join(parts)}.", soft_wrap=True, markup=False)


def _closing(result: FillResult) -> Iterator[str]:
    if result.added and result.work_s:
        rate = result.video_s / result.work_s
        yield (
            f"{_counted(result.added, 'run')} added, {_duration(result.video_s)} of video; "
            f"each worker watched {rate:.2f} s of video per second."
        )
    if result.failed:
        yield f"{_counted(len(result.failed), 'clip')} without a run:"
        yield from (f"  {f.source}: {f.reason.splitlines()[0]}" for f in result.failed)


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def _size(count: int) -> str:
    """A number of bytes in a readable unit."""
    return f"{count / 1e6:.0f} MB" if count >= 1e7 else f"{count / 1e6:.1f} MB"
