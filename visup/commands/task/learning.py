"""`visup task learn`, `fit`, `coverage` and `diff`: tasks from runs, and tasks against each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.terminal.console import echo, echo_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from visup.tasks.analysis.judging import JudgedRun
    from visup.tasks.grammar.nodes import Task

Runs = Annotated[
    list[Path], typer.Argument(help="Run folders of `visup watch`, or their journals.")
]
OneTask = Annotated[str, typer.Argument(help="A task file, `file.task:NAME`, or a shipped task.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON instead of text.")]


def learn(
    runs: Runs,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Task file to write.")],
    bad: Annotated[
        list[Path] | None,
        typer.Option("--bad", metavar="RUN", help="A run that went wrong; repeatable."),
    ] = None,
    name: Annotated[
        str | None, typer.Option(help="Name of the task (default: that of the file).")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Propose a task file from good runs: the stages in the order they all share, with evidence.

    Exit code: 1 if it rejects a good run or accepts a bad one.
    """
    from visup.agent import Verdict
    from visup.runs.learning_runs import declared_actors, run_trace
    from visup.tasks.learning.induction import learn_task

    _check_writable(out)
    actors = {n: actor for run in runs for n, actor in declared_actors(run).items()}
    task_name = name or "".join(c if c.isalnum() else "_" for c in out.stem)
    good = [run_trace(run) for run in runs]
    learned = learn_task(task_name, good, [run_trace(run) for run in bad or ()], actors)
    out.write_text(learned.text, encoding="utf-8")
    misjudged = [run for run, verdict in learned.good.items() if verdict is not Verdict.SUCCEEDED]
    misjudged += [run for run, verdict in learned.bad.items() if verdict is Verdict.SUCCEEDED]
    if as_json:
        verdicts = {
            run: verdict.value for run, verdict in (*learned.good.items(), *learned.bad.items())
        }
        echo_json({"file": str(out), "verdicts": verdicts, "left_out": learned.dropped}, indent=2)
    else:
        echo(learned.text, nl=False)
        for dropped in learned.dropped:
            echo(f"left out: {dropped}")
        for run, verdict in (*learned.good.items(), *learned.bad.items()):
            echo(f"{run}: {verdict.value.replace('_', ' ')}")
    raise typer.Exit(1 if misjudged else 0)


def fit(
    file: Annotated[Path, typer.Argument(help="A task file, changed in place.")],
    runs: Runs,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only print what would change.")
    ] = False,
) -> None:
    """Fit the times of `within` and `for` in a task file to good runs; nothing else changes."""
    from visup.tasks.checks.files import read_text
    from visup.tasks.checks.load import load_task
    from visup.tasks.learning.fitting import fitted_amounts, with_amounts

    task = load_task(str(file))
    fitted = fitted_amounts(task, _judge_runs(task, runs))
    for change in fitted:
        echo(f"<{change.stage}>: {change.clause} -> {change.new} ({change.seen})")
    if not fitted:
        echo("Nothing changes.")
    elif not dry_run:
        _check_writable(file)
        file.write_text(with_amounts(read_text(str(file)), fitted), encoding="utf-8")


def coverage(file: OneTask, runs: Runs, as_json: AsJson = False) -> None:
    """Show which stages of a task the runs have covered, and which they never have.

    Exit code: 1 if a stage was never completed.
    """
    from visup.tasks.analysis.coverage import coverage_of, share_covered
    from visup.tasks.checks.load import load_task

    task = load_task(file)
    stages = coverage_of(task, _judge_runs(task, runs))
    share = share_covered(stages)
    if as_json:
        rows: dict[str, Any] = {
            s.stage: {
                "runs": s.runs,
                "begun": s.begun,
                **{status.value: n for status, n in s.statuses.items()},
            }
            for s in stages
        }
        echo_json({"covered": share, "stages": rows}, indent=2)
    else:
        for stage in stages:
            echo(str(stage))
        echo(f"{share:.0%} of {len(stages)} stages were completed")
    raise typer.Exit(0 if share == 1.0 else 1)


def diff(
    first: OneTask,
    second: OneTask,
    as_json: AsJson = False,
) -> None:
    """Show how two tasks differ in the sequences they allow, however they are written.

    Exit code: 0 if they are equivalent, 1 if they are not.
    """
    from visup.tasks.analysis.languages import difference
    from visup.tasks.checks.load import load_task

    differences = difference(load_task(first), load_task(second))
    lines = list(differences.lines(f"`{first}`", f"`{second}`"))
    if as_json:
        echo_json({"same": not differences, "differences": lines if differences else []}, indent=2)
    else:
        for line in lines:
            echo(line)
    raise typer.Exit(1 if differences else 0)


def _judge_runs(task: Task, runs: Sequence[Path]) -> list[JudgedRun]:
    from visup.runs.learning_runs import run_judged

    return [run_judged(task, run) for run in runs]


def _check_writable(path: Path) -> None:
    """Fail before the work rather than after it.

    Raises:
        OutputError: The file cannot be written.
    """
    from visup.agent.model.errors import OutputError

    if not path.parent.is_dir():
        raise OutputError(
            "there is no such folder",
            where=str(path.parent),
            hint="create it, or write elsewhere",
        )
