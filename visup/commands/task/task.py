"""`visup task`: check, format, show, explain, simulate, learn and compare task files."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from visup.commands.task import learning
from visup.commands.task.format import format_files
from visup.commands.task.simulate import simulate
from visup.terminal.console import echo, echo_json, make_console

if TYPE_CHECKING:
    from visup.agent.model.errors import VisupError

app = typer.Typer(
    help="Check, format, show, simulate, learn and compare task files.", no_args_is_help=True
)
app.command("simulate")(simulate)
app.command("format")(format_files)
for command in (learning.learn, learning.fit, learning.coverage, learning.diff):
    app.command(command.__name__)(command)

Files = Annotated[list[str], typer.Argument(help="Task files, or names of shipped tasks.")]
File = Annotated[str, typer.Argument(help="A task file, or the name of a shipped task.")]
AsJson = Annotated[bool, typer.Option("--json", help="Write JSON instead of text.")]
Without = Annotated[
    list[str] | None,
    typer.Option(help="A kind of percept that will not be available, such as depth; repeatable."),
]


@app.command()
def check(files: Files, as_json: AsJson = False, without: Without = None) -> None:
    """Report every mistake in task files; exit code 2 if there are any."""
    from visup.agent.model.errors import SettingsError, TaskError, VisupError
    from visup.rules.language.diagnostics import raise_errors
    from visup.tasks.actions.actions import ALL_PERCEPTS
    from visup.tasks.checks.diagnose import diagnose
    from visup.tasks.checks.files import read_text

    unknown = set(without or ()) - ALL_PERCEPTS
    if unknown:
        message = f"there is no kind of percept called `{min(unknown)}`"
        raise SettingsError(message, expected=f"one of: {', '.join(sorted(ALL_PERCEPTS))}")
    errors_by_file: dict[str, list[VisupError]] = {}
    for file in files:
        try:
            diagnostics = diagnose(
                read_text(file), file, percepts=ALL_PERCEPTS - set(without or ())
            )[1]
            errors_by_file[file] = [d.error(TaskError) for d in diagnostics]
        except VisupError as error:
            errors_by_file[file] = [error]
    reported = [e for errors in errors_by_file.values() for e in errors]
    if as_json:
        echo_json(
            {f: [_as_data(e) for e in errors] for f, errors in errors_by_file.items()}, indent=2
        )
        raise typer.Exit(2 if reported else 0)
    for file, errors in errors_by_file.items():
        if not errors:
            echo(f"{file}: ok")
    raise_errors(reported)


@app.command()
def show(
    file: File,
    form: Annotated[
        Literal["tree", "mermaid", "dot"],
        typer.Option("--format", help="A tree for the terminal, or source for a diagram."),
    ] = "tree",
) -> None:
    """Draw a task as a tree, or as a flow chart for Mermaid or Graphviz."""
    from visup.tasks.checks.load import load_tasks

    for task in load_tasks(file):
        if form == "tree":
            from visup.commands.task.tree import task_tree

            make_console().print(task_tree(task))
        else:
            from visup.tasks.tools.diagram import dot, flow_of, mermaid

            echo(mermaid(flow_of(task)) if form == "mermaid" else dot(flow_of(task)))


@app.command("list")
def list_tasks(as_json: AsJson = False) -> None:
    """List the tasks that ship with visup, with a line about each."""
    from visup.tasks.checks.files import read_text, shipped_tasks

    about = {name: _first_comment(read_text(name)) for name in shipped_tasks()}
    if as_json:
        echo_json(about, indent=2)
        return
    width = max(map(len, about), default=0)
    for name, comment in about.items():
        echo(f"{name:{width}}  {comment}")


@app.command()
def actions(as_json: AsJson = False) -> None:
    """List everything a stage can require: actions, predicates, quantities, also of plug-ins."""
    from visup.tasks.actions.actions import known_actions
    from visup.tasks.actions.describe import written

    entries = {m.name: (written(m), m.about or m.text) for m in known_actions().values()}
    if as_json:
        data = {n: {"written": form, "about": about} for n, (form, about) in entries.items()}
        echo_json(data, indent=2)
        return
    width = max(len(form) for form, _ in entries.values())
    for form, about in sorted(entries.values()):
        echo(f"{form:{width}}  {about}")


@app.command()
def explain(
    code: Annotated[str, typer.Argument(help="An error code from a message, such as E102.")],
) -> None:
    """Explain an error code, with a wrong and a right example."""
    from visup.tasks.diagnostics.explain import explain as explanation

    echo(str(explanation(code)))


@app.command()
def textmate() -> None:
    """Print the TextMate grammar of task files, for syntax highlighting in editors."""
    from visup.tasks.checks.files import textmate_grammar

    echo(textmate_grammar(), nl=False)


@app.command()
def syntax(
    editor: Annotated[Literal["vim", "emacs", "highlightjs"], typer.Argument(help="The editor.")],
    language: Annotated[
        Literal["task", "rules"], typer.Option(help="The language to highlight.")
    ] = "task",
) -> None:
    """Print a syntax highlighting file for an editor, generated from the grammar."""
    from visup.tasks.tools.syntaxes import EDITORS, SYNTAXES

    echo(EDITORS[editor](SYNTAXES[language]), nl=False)


@app.command()
def lsp() -> None:
    """Run a language server (LSP) for editors over stdin and stdout (extra `lsp`)."""
    from visup.agent.model.errors import ExtraMissingError

    try:
        from visup.commands.task.language_server import serve
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in ("pygls", "lsprotocol"):
            raise
        raise ExtraMissingError("`visup task lsp`", "lsp") from error
    serve(sys.stdin.buffer, sys.stdout.buffer)


def _as_data(error: VisupError) -> dict[str, Any]:
    from visup.agent.model.errors import SourceLocation

    where = error.where
    location: dict[str, Any] = {"file": str(where) if where else None}
    if isinstance(where, SourceLocation):
        location = {
            "file": where.file,
            "line": where.line,
            "column": where.column,
            "length": where.length,
        }
    return {
        "code": error.code,
        "what": error.what,
        **location,
        "expected": error.expected,
        "hint": error.hint,
    }


def _first_comment(text: str) -> str:
    first = text.split("\n", 1)[0].lstrip("# ").strip()
    return first.split(": ", 1)[-1]
