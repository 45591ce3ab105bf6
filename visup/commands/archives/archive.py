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
from visup.commands.archives.lake_argument import IntoLake, LakeLocation
from visup.commands.options import REPLAY_SETTINGS, OptionValues, SettingsFile, takes
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

FILL_SETTINGS = (
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

app = typer.Typer(no_args_is_help=True, help="Lakes: many recorded runs, stored as tables.")


@dataclass(frozen=True, slots=True)
class WorkerOptions:
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
@takes(WatchSettings, PoolSettings, FillOptions, only=FILL_SETTINGS)
def run(
    options: OptionValues,
    pool_options: OptionValues,
    fill_options: OptionValues,
    sources: Annotated[
        list[str],
        typer.Argument(
            metavar="SOURCE...",
            help="Clips, folders, patterns ('*.mp4'), URLs, manifests (.csv, .parquet).",
        ),
    ],
    into: IntoLake,
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

    console = make_console()
    pool, filling = PoolSettings(**pool_options), FillOptions(**fill_options)
    settings = watch_settings("", options, settings_file)
    clips = clips_of(sources)
    if filling.plan:
        existing = open_lake(into) if is_lake(into) else None
        _print_plan(
            console, into, make_plan(existing, clips, settings, filling.cutting), pool.processes
        )
        return
    lake, store = create_lake(into), store_of(into)
    with only_filler(lake):
        clear_attempts(lake, retry=filling.retry)
        plan = make_plan(lake, clips, settings, filling.cutting)
        _print_plan(console, into, plan, pool.processes)
        result = _fill(console, lake, plan, pool, store)
        settle(lake, store)
    for text in _closing_lines(result):
        console.print(text, soft_wrap=True, markup=False)
    raise typer.Exit(1 if result.failed else 0)


@app.command("add")
def add(
    runs: Annotated[
        list[Path], typer.Argument(metavar="RUN...", help="Run folders of `visup watch`.")
    ],
    into: IntoLake,
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
        except VisupError as error:
            print_error(str(error))
            failed += 1
        else:
            echo(f"{key}  {folder}" if added else f"{key}  {folder} was already there")
    if store:
        store.push(lake)
    raise typer.Exit(1 if failed else 0)


@app.command("compact")
def compact(
    location: LakeLocation,
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

    lake, store = open_lake(location), store_of(location)
    with only_filler(lake):
        done = compacting.compact(lake, grace_s=0.0 if now else compacting.GRACE_S)
        if store:
            store.push(lake)
        merged = _plural(done.joined, "run")
        parts = f"Merged {merged}; the lake has {_plural(done.partitions, 'partition')}."
        removed = f" Replaced files of {done.tidied} runs were removed." if done.tidied else ""
    echo(f"{parts}{removed}")


app.command("calibrate")(calibrate)


@app.command("report")
def report(
    location: LakeLocation,
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

    path = out or Path("" if is_url(location) else location) / "report.html"
    with open_database(open_lake(location)) as database:
        statistics = lake_statistics(database)
    write_lake_page(statistics, Path(location), path)
    echo(f"{path}: {_plural(statistics.runs, 'run')}")


@app.command("replay")
@takes(WatchSettings, WorkerOptions, only=(*REPLAY_SETTINGS, "workers"))
def replay(
    options: OptionValues,
    worker_options: OptionValues,
    location: LakeLocation,
) -> None:
    """Reason again about all runs of a lake, with other rules, tasks or actors, and report what changes.

    Exit code: 0 if nothing changes, 1 if something does, 2 for bad input.
    """
    from visup.archive.replaying import ChangeSummary, changes
    from visup.archive.storing.places import open_lake
    from visup.terminal.console import make_console

    console, summary, lake = make_console(), ChangeSummary(), open_lake(location)
    for change in changes(lake, lake.runs(), **worker_options, **options):
        summary.take(change)
        if change.diff:
            console.print(_change_line(change), soft_wrap=True, markup=False)
    for text in summary.lines():
        console.print(text, soft_wrap=True, markup=False)
    raise typer.Exit(1 if summary.changed else 0)


def _change_line(change: RunChanges) -> str:
    """What changes in a run, in one line."""
    lost, gained = change.alerts
    parts = [f"{kind}: {lost.get(kind, 0)} lost, {gained.get(kind, 0)} gained"
            for kind in sorted({*lost, *gained})]  # fmt: skip
    before, after = change.diff.verdicts
    parts += [f"verdict {before or 'none'} -> {after or 'none'}"] if before != after else []
    return f"{change.clip}: {'; '.join(parts) or 'other events'} ({change.folder})"


def _fill(
    console: Console, lake: Lake, plan: Plan, pool_settings: PoolSettings, store: LakeStore | None
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
        with open_pool(pool_settings) as pool, _progress(console, plan) as notify:
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
            elapsed_s = bar.tasks[0].elapsed or 0.0
            speed = f"{video_s / elapsed_s:.1f} s of video per second" if elapsed_s > 1.0 else ""
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
    status = "set aside" if failed.put_aside else "failed"
    text = f"{failed.source}: {status}: {failed.reason}"
    console.print(text, style="yellow", soft_wrap=True, markup=False)


def _print_plan(console: Console, into: str, plan: Plan, workers: int) -> None:
    from visup.archive.filling.filling import estimated_s
    from visup.archive.storing.places import copy_of

    parts = [f"{len(plan.jobs)} to watch ({_size(plan.bytes)})"]
    chunk_counts = [len(job.spans) for job in plan.jobs if job.spans]
    parts += [f"{len(chunk_counts)} of them in {sum(chunk_counts)} chunks"] if chunk_counts else []
    parts += [f"{plan.present} already in the lake"] if plan.present else []
    parts += [f"{plan.same} duplicates"] if plan.same else []
    parts += [f"{len(plan.failed)} cannot be watched"] if plan.failed else []
    seconds = estimated_s(copy_of(into), plan.bytes, workers)
    if plan.jobs and seconds is not None:
        parts.append(f"about {_duration(seconds)} on {_plural(max(1, workers), 'worker')}")
    console.print(f"Clips: {', '.join(parts)}.", soft_wrap=True, markup=False)


def _closing_lines(result: FillResult) -> Iterator[str]:
    if result.added and result.work_s:
        rate = result.video_s / result.work_s
        yield (
            f"{_plural(result.added, 'run')} added, {_duration(result.video_s)} of video; "
            f"each worker watched {rate:.2f} s of video per second."
        )
    if result.failed:
        yield f"{_plural(len(result.failed), 'clip')} without a run:"
        yield from (f"  {f.source}: {f.reason.splitlines()[0]}" for f in result.failed)


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def _plural(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _size(count: int) -> str:
    """A number of bytes in a readable unit."""
    return f"{count / 1e6:.0f} MB" if count >= 1e7 else f"{count / 1e6:.1f} MB"
