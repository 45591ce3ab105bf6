"""`visup watch` and `visup demo`: supervise a video, tell the story, give the verdict."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from visup.runs.resume import InterruptedRun
    from visup.runs.runner import Progress, RunOptions, RunResult
    from visup.runs.settings import WatchSettings

Source = Annotated[str, typer.Argument(help="Video file, folder of images, camera index or URL.")]
Tasks = Annotated[
    list[str] | None,
    typer.Option("--task", metavar="FILE", help="Task file, or the name of a shipped task."),
]
Models = Annotated[
    Path | None, typer.Option(metavar="DB", help="Model database (see `visup models build`).")
]
Rules = Annotated[
    list[Path] | None,
    typer.Option(metavar="FILE", help="Rules file, instead of the shipped rules."),
]
Actors = Annotated[
    list[str] | None,
    typer.Option("--actor", metavar="NAME=MODEL", help="What an actor of the task looks like."),
]
Every = Annotated[int, typer.Option(help="Use every n-th frame.")]
Behaviours = Annotated[
    list[str] | None,
    typer.Option("--behaviour", metavar="FILE", help="Your own: FILE.py or package.module:Class."),
]
Plugins = Annotated[
    list[str] | None,
    typer.Option("--plugin", metavar="NAME", help="Name of an installed behaviour to add."),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="NAME.KEY=VALUE", help="A setting of a behaviour of your own."),
]
SettingsFile = Annotated[
    Path | None,
    typer.Option("--settings", metavar="TOML", help="Settings, in tables [behaviours.NAME]."),
]
Isolate = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME", help="Run this behaviour in a process of its own."),
]
Budgets = Annotated[
    bool, typer.Option("--budgets", help="Give up what exceeds its budget; for live sources.")
]
Realtime = Annotated[
    bool | None,
    typer.Option(
        "--realtime/--no-realtime",
        help="Drop the frames that visup is too slow for, and say so (default: of live sources).",
    ),
]
Attention = Annotated[
    bool, typer.Option("--attention", help="Match what is known well less often: cheaper.")
]
Fps = Annotated[float | None, typer.Option(help="Frame rate, where the source has none.")]
Fov = Annotated[float | None, typer.Option(help="Vertical field of view of the camera, degrees.")]

Zones = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="File with zones that rules can name (see docs/formats.md)."),
]


def settings_of(
    source: str,
    task: list[str] | None,
    models: Path | None,
    rules: list[Path] | None,
    actor: list[str] | None,
    every: int,
    behaviour: list[str] | None,
    plugin: list[str] | None,
    fps: float | None,
    fov: float | None,
    zones: Path | None = None,
    setting: list[str] | None = None,
    settings_file: Path | None = None,
    isolate: list[str] | None = None,
    budgets: bool = False,
    attention: bool = False,
    realtime: bool | None = None,
) -> WatchSettings:
    """The settings of a run, from the command's options."""
    from visup.agent.plugins.settings import merged, parse_settings, read_settings
    from visup.runs.settings import WatchSettings, parse_actors

    return WatchSettings(
        source=source,
        tasks=tuple(task or ()),
        models=models,
        rules=tuple(rules or ()),
        actors=parse_actors(actor or ()),
        behaviours=tuple(behaviour or ()),
        plugins=tuple(plugin or ()),
        plugin_settings=merged(
            read_settings(settings_file) if settings_file else {}, parse_settings(setting or ())
        ),
        isolate=tuple(isolate or ()),
        budgets=budgets,
        attention=attention,
        realtime=realtime,
        every=every,
        fps=fps,
        fov_vertical_deg=fov,
        zones=zones,
    )


def watch(
    source: Annotated[
        str | None, typer.Argument(help="Video file, folder of images, camera index or URL.")
    ] = None,
    task: Tasks = None,
    models: Models = None,
    rules: Rules = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Run folder (default: runs/NAME).")
    ] = None,
    actor: Actors = None,
    every: Every = 1,
    behaviour: Behaviours = None,
    plugin: Plugins = None,
    fps: Fps = None,
    fov: Fov = None,
    zones: Zones = None,
    setting: Set = None,
    settings_file: SettingsFile = None,
    isolate: Isolate = None,
    budgets: Budgets = False,
    attention: Attention = False,
    realtime: Realtime = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Only the verdict.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Events as JSON, one a line.")] = False,
    video: Annotated[bool, typer.Option(help="Write the annotated video.")] = True,
    answer: Annotated[
        list[str] | None,
        typer.Option("--answer", metavar="ID=NAME", help="Who an object is, such as 2=arm."),
    ] = None,
    answers: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Such answers, one a line.")
    ] = None,
    resume: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Go on with this run, which was stopped or killed."),
    ] = None,
    sink: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND:PLACE", help="Send alerts there too: jsonl:- or webhook:URL ..."
        ),
    ] = None,
    keep_gb: Annotated[
        float | None, typer.Option(min=0.0, help="Keep so much of the journal, gigabytes.")
    ] = None,
    state_every: Annotated[
        float, typer.Option(min=0.0, help="Seconds between states to resume from; 0 for none.")
    ] = 30.0,
) -> None:
    """Watch a video and say whether the work goes well.

    Exit code: 0 when it went well, 1 when it failed, was unsafe or could not be followed, 2 on bad input.
    """
    from visup.agent.storage.journal import Limits
    from visup.runs.runner import RunOptions

    keep = None if keep_gb is None else int(keep_gb * 1e9)
    options = RunOptions(
        video=video,
        limits=Limits(keep_bytes=keep),
        state_every_s=state_every,
        sinks=tuple(sink or ()),
    )
    if resume:
        given = (source, task, models, rules, out, actor, behaviour, plugin, fps, fov, zones)
        more = (
            setting,
            settings_file,
            isolate,
            budgets,
            attention,
            realtime is not None,
            every != 1,
        )
        settings, past = _past(resume, *given, *more)
    elif source is None:
        raise typer.BadParameter("name a video, or a run with --resume", param_hint="SOURCE")
    else:
        past = None
        settings = settings_of(
            source,
            task,
            models,
            rules,
            actor,
            every,
            behaviour,
            plugin,
            fps,
            fov,
            zones,
            setting,
            settings_file,
            isolate,
            budgets,
            attention,
            realtime,
        )
    result = run_and_report(
        settings,
        out,
        quiet=quiet,
        as_json=as_json,
        answers=_answers(answer or [], answers),
        options=options,
        past=past,
    )
    raise typer.Exit(result.exit_code)


def _answers(given: list[str], path: Path | None) -> dict[int, str]:
    from visup.runs.operator import parse_answers, read_answers

    return {**(read_answers(path) if path else {}), **parse_answers(given)}


def _past(run: Path, *given: object) -> tuple[WatchSettings, InterruptedRun]:
    """The run that goes on; what it is about was settled when it began."""
    from visup.agent.model.errors import SettingsError
    from visup.runs.resume import interrupted_run

    if any(given):
        raise SettingsError(
            "a run goes on as it was begun: --resume takes no source, task or other settings",
            hint=f"visup watch --resume {run}",
        )
    past = interrupted_run(run)
    return past.settings, past


def demo(
    out: Annotated[Path | None, typer.Option(help="Run folder (default: demo-run).")] = None,
    every: Every = 2,
) -> None:
    """Supervise the shipped clip: a capture that fails.

    An arm tries to capture a satellite, and sends it away spinning. Exit code 0 when visup sees that.
    """
    from visup.runs.demo import demo_settings, free_folder

    result = run_and_report(demo_settings(every), out or free_folder(Path("demo-run")))
    # The clip shows a failed capture: having seen that is the demo's success.
    from visup.agent import Verdict

    raise typer.Exit(0 if result.verdict is Verdict.FAILED else 1)


def run_and_report(
    settings: WatchSettings,
    out: Path | None,
    *,
    quiet: bool = False,
    as_json: bool = False,
    answers: dict[int, str] | None = None,
    options: RunOptions | None = None,
    past: InterruptedRun | None = None,
) -> RunResult:
    """Run, print the narrative as it goes and the verdict last."""
    from rich.console import Console
    from rich.markup import escape

    from visup.runs.operator import HumanOperator, typed_lines
    from visup.runs.runner import fresh_folder, supervise
    from visup.terminal.narrator import Narrator

    console = Console(highlight=False)
    folder = past.recording.path.parent if past else fresh_folder(out, settings.source)
    narrator = Narrator(console, as_json)
    silent = quiet or as_json
    # Whoever reads events from a pipe does not type answers.
    typed = None if silent or not console.is_terminal else typed_lines()
    operator = HumanOperator(answers or {}, typed, console.print)
    with progress_bar(console, "watching", shown=not silent) as progress:
        result = supervise(
            settings,
            folder,
            observers=() if quiet else (narrator,),
            progress=progress,
            operator=operator,
            notice=None
            if as_json
            else lambda text: console.print(f"[yellow]{escape(text)}[/yellow]"),
            options=options,
            past=past,
        )
    _tell_end(console, result, as_json=as_json)
    return result


@contextmanager
def progress_bar(console: Console, word: str, *, shown: bool = True) -> Iterator[Progress]:
    """A progress bar on a terminal; nothing where the output is not one.

    Args:
        console: Where it is shown.
        word: What is being done.
        shown: Whether to show it at all.

    Yields:
        What is to be told frames done and frames in all.
    """
    from rich import progress

    bar = progress.Progress(
        word,
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not (shown and console.is_terminal),
    )
    with bar:
        task = bar.add_task(word, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _tell_end(console: Console, result: RunResult, *, as_json: bool) -> None:
    if as_json:
        import json

        print(json.dumps(_as_json(result), sort_keys=True))
        return
    for text in _closing(result):
        console.print(text, soft_wrap=True)


def _as_json(result: RunResult) -> dict[str, object]:
    return {
        "kind": "result",
        "verdict": result.verdict.value if result.verdict else None,
        "frames": result.steps,
        "problem": result.problem,
        "folder": str(result.folder) if result.folder else None,
        "report": str(result.report) if result.report else None,
    }


def _closing(result: RunResult) -> Iterator[str]:
    from rich.markup import escape

    from visup.terminal.narrator import verdict_line

    if result.problem:
        yield f"[yellow]The source: {escape(result.problem)}[/yellow]"
    for note in result.notes:
        yield f"[yellow]{escape(note)}[/yellow]"
    if result.report:
        yield f"Report:  {escape(str(result.report))}"
    elif result.folder:
        yield f"Run:     {escape(str(result.folder))}"
    yield verdict_line(result.verdict)
