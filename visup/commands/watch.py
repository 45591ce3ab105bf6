"""`visup watch` and `visup demo`: supervise a video, print what happens, give the verdict."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.commands.options import OptionValues, SettingsFile, takes
from visup.runs.settings import Option, RunOptions, WatchSettings
from visup.terminal.console import echo_json, make_console

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import Console

    from visup.runs.result import RunResult
    from visup.runs.resume import InterruptedRun
    from visup.runs.runner import RunProgress


MIN_SHOWN_LAG_S = 0.5
"""A lag behind a live source is shown from this many seconds on; less is not noticeable."""


def _parse_answers(texts: list[str]) -> dict[int, str]:
    from visup.runs.operator import parse_answers

    return parse_answers(texts)


@dataclass(frozen=True, slots=True)
class Presentation:
    """What `visup watch` shows of a run, and the operator's answers given in advance."""

    out: Annotated[Path | None, Option("Run folder (default: runs/NAME).", metavar="DIR")] = None
    quiet: Annotated[bool, Option("Print only the verdict.", "--quiet")] = False
    verbose: Annotated[
        bool, Option("Print every event, including those of unidentified objects.", "--verbose")
    ] = False
    as_json: Annotated[bool, Option("Print every event as JSON, one per line.", "--json")] = False
    answers: Annotated[
        Mapping[int, str],
        Option("What an object is, such as 2=arm.", "--answer", "ID=NAME", _parse_answers),
    ] = field(default_factory=dict)
    answers_file: Annotated[
        Path | None, Option("File of answers, one per line.", "--answers", "FILE")
    ] = None

    def all_answers(self) -> dict[int, str]:
        """The answers from the file and from the command line.

        Raises:
            SettingsError: The file cannot be read, or a line of it is not an answer.
        """
        from visup.runs.operator import read_answers

        return {**(read_answers(self.answers_file) if self.answers_file else {}), **self.answers}


@takes(WatchSettings, RunOptions, Presentation)
def watch(
    options: OptionValues,
    run_options: OptionValues,
    presentation: OptionValues,
    source: Annotated[
        str | None, typer.Argument(help="Video file, folder of images, camera index or URL.")
    ] = None,
    settings_file: SettingsFile = None,
    resume: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Resume a run that was stopped or killed."),
    ] = None,
) -> None:
    """Watch a video and report whether the work goes well.

    Exit code: 0 if the task succeeded, 1 if it failed, was unsafe or could not be followed, 2 for bad
    input, 3 if the task was still in progress, 4 if the source broke off, 130 if you stopped the run.
    """
    past = None
    if resume:
        past = _interrupted(resume, options, source, settings_file, presentation.get("out"))
        settings = past.settings
    elif source is None:
        raise typer.BadParameter("give a video, or a run with --resume", param_hint="SOURCE")
    else:
        settings = watch_settings(source, options, settings_file)
    result = run_and_report(settings, Presentation(**presentation), RunOptions(**run_options), past)
    raise typer.Exit(result.exit_code)


def watch_settings(
    source: str, options: OptionValues, settings_file: Path | None = None
) -> WatchSettings:
    """The settings of a run, from the options of a command.

    Raises:
        SettingsError: A setting is invalid.
    """
    if settings_file:
        from visup.agent.plugins.settings import merge_settings
        from visup.runs.inputs.settings_file import read_settings_file

        from_file = read_settings_file(settings_file)
        merged = merge_settings(from_file["plugin_settings"], options.get("plugin_settings", {}))
        options = {**from_file, **options, "plugin_settings": merged}
    return WatchSettings(source, **options)


def _interrupted(
    run: Path, options: OptionValues, source: str | None, *other_options: Any
) -> InterruptedRun:
    """The run to resume; its settings were fixed when it began, except for behaviours of the user's own."""
    from visup.agent.model.errors import SettingsError
    from visup.redaction import has_secret
    from visup.runs.resume import interrupted_run

    # The password of an address is not recorded, so such an address must be given again.
    address = source if source and has_secret(source) else None
    if any((*other_options, source != address)) or options.keys() - {"behaviours", "plugins"}:
        raise SettingsError(
            "a resumed run keeps its settings: --resume takes no source, task or other settings",
            expected="nothing except the behaviours that it had (--behaviour, --plugin)",
            hint=f"visup watch --resume {run}",
        )
    return interrupted_run(run, **options, source=address)


@takes(WatchSettings, only=("every",), every=2)
def demo(
    options: OptionValues,
    out: Annotated[Path | None, typer.Option(help="Run folder (default: demo-run).")] = None,
) -> None:
    """Supervise the shipped clip: a capture that fails.

    An arm tries to capture a satellite and knocks it away. Exit code 0 if visup reports the failure.
    """
    from visup.runs.demo import demo_settings, free_folder

    folder = out or free_folder(Path("demo-run"))
    result = run_and_report(demo_settings(**options), Presentation(folder))
    # The clip shows a failed capture, so that verdict is the demo's success.
    from visup.agent import Verdict

    raise typer.Exit(0 if result.verdict is Verdict.FAILED else 1)


def run_and_report(
    settings: WatchSettings,
    presentation: Presentation,
    options: RunOptions | None = None,
    past: InterruptedRun | None = None,
) -> RunResult:
    """Run, printing the narrative as it goes and the verdict at the end."""
    from rich.markup import escape

    from visup.narrative import Detail, Narrative
    from visup.runs.operator import HumanOperator, typed_lines
    from visup.runs.runner import Audience, fresh_folder, supervise
    from visup.terminal.narrator import Narrator

    console = make_console()
    narrative = Narrative(Detail.ALL if presentation.verbose else Detail.USUAL)
    narrator = Narrator(console, presentation.as_json, narrative)
    folder = past.recording.path.parent if past else fresh_folder(presentation.out, settings.source)
    silent = presentation.quiet or presentation.as_json
    # Output to a pipe means that nobody is there to type answers.
    typed = None if silent or not console.is_terminal else typed_lines()
    with progress_bar(console, "watching", shown=not silent) as progress:
        audience = Audience(
            observers=() if presentation.quiet else (narrator,),
            progress=progress,
            operator=HumanOperator(presentation.all_answers(), typed, console.print),
            notice=None
            if presentation.as_json
            else lambda text: console.print(f"[yellow]{escape(text)}[/yellow]", soft_wrap=True),
        )
        with no_empty_folder(folder):
            result = supervise(settings, folder, audience=audience, options=options, past=past)
    narrator.finish()
    _print_result(console, result, as_json=presentation.as_json)
    return result


@contextmanager
def no_empty_folder(folder: Path) -> Iterator[None]:
    """A run that is refused before its first frame leaves no empty folder behind."""
    try:
        yield
    except Exception:
        with suppress(OSError):
            folder.rmdir()  # only what is empty can be removed so
        raise


@contextmanager
def progress_bar(console: Console, label: str, *, shown: bool = True) -> Iterator[RunProgress]:
    """A progress bar, if the output is a terminal.

    Args:
        console: Where to show it.
        label: What is being done.
        shown: Whether to show it at all.

    Yields:
        A callable that takes the number of frames done and the total.
    """
    from rich import progress

    bar = progress.Progress(
        label,
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TextColumn("{task.fields[rate]}"),
        progress.TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not (shown and console.is_terminal),
    )
    with bar:
        task = bar.add_task(label, total=None, rate="")

        def update(done: int, total: int | None, lag_s: float | None = None) -> None:
            elapsed_s = bar.tasks[0].elapsed or 0.0
            bar.update(task, completed=done, total=total, rate=pace_text(done, elapsed_s, lag_s))

        yield update


def pace_text(done: int, took_s: float, lag_s: float | None) -> str:
    """The processing rate, and how far behind a live source visup is, if noticeably.

    >>> pace_text(50, 2.0, 3.0)
    '25.0 frames/s, 3.0 s behind'
    """
    rate = f"{done / took_s:.1f} frames/s" if took_s > 1.0 else ""
    lag = f", {lag_s:.1f} s behind" if lag_s is not None and lag_s >= MIN_SHOWN_LAG_S else ""
    return f"{rate}{lag}"


def _print_result(console: Console, result: RunResult, *, as_json: bool) -> None:
    if as_json:
        echo_json(_as_json(result), sort_keys=True)
        return
    for text in _closing_lines(result):
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


def _closing_lines(result: RunResult) -> Iterator[str]:
    from rich.markup import escape

    from visup.terminal.narrator import verdict_line, watched_part

    if result.problem:
        yield f"[yellow]The source: {escape(result.problem)}[/yellow]"
    for note in result.notes:
        yield f"[yellow]{escape(note)}[/yellow]"
    if result.report:
        yield f"Report:  {escape(str(result.report))}"
    elif result.folder:
        yield f"Run:     {escape(str(result.folder))}"
    yield verdict_line(result.verdict, has_task=result.has_task, part=watched_part(result))
