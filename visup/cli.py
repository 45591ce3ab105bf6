"""The `visup` command. Heavy imports stay inside the commands, so that `--help` comes at once."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Callable
from functools import cache
from typing import Annotated

import typer
from typer.main import get_command

from visup.agent.memory_limit import check_memory
from visup.agent.model.errors import VisupError
from visup.commands.archives.archive import app as archive_app
from visup.commands.archives.find import find
from visup.commands.archives.query import query
from visup.commands.behaviours import app as behaviours_app
from visup.commands.check import check
from visup.commands.debug import app as debug_app
from visup.commands.doctor import doctor
from visup.commands.eval.catalogue import eval_app
from visup.commands.eval.train import app as train_app
from visup.commands.export import export
from visup.commands.models import app as models_app
from visup.commands.presets import presets
from visup.commands.render import render
from visup.commands.replay import replay
from visup.commands.rules import app as rules_app
from visup.commands.serve.console_command import console
from visup.commands.serve.site_commands import app as serve_app
from visup.commands.step import step
from visup.commands.task.task import app as task_app
from visup.commands.teach import OutlineCommand, teach
from visup.commands.watch import demo, watch
from visup.terminal.console import echo, print_error
from visup.terminal.overview import Overview

BAD_INPUT = 2
FAILED = 1
COLLECT_AFTER = 5000
"""New objects after which garbage is collected: with Python's 700 it takes a twentieth of a short run."""

# Small matrices are many here: threads of the linear algebra library cost more than they bring.
# Set before NumPy is imported; whoever set it otherwise is obeyed.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    name="visup",
    cls=Overview,
    help="The visual supervisor: watches machines work and reports whether the work goes well.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: drawing it with rich would double the time to start
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("watch")(watch)
app.command("demo")(demo)
app.command("check")(check)
app.command("presets")(presets)
app.command("teach", cls=OutlineCommand)(teach)
app.command("step")(step)
app.command("replay")(replay)
app.command("export")(export)
app.command("console")(console)
app.command("query")(query)
app.command("find")(find)
app.command("render")(render)
app.command("doctor")(doctor)
app.add_typer(serve_app, name="serve", help="Watch many cameras as a service.")
app.add_typer(task_app, name="task", help="Check, show, simulate and learn task files.")
app.add_typer(rules_app, name="rules", help="Check, list and explain safety rules.")
app.add_typer(models_app, name="models", help="Build, extend, list and query model databases.")
app.add_typer(archive_app, name="archive", help="Lakes: many recorded runs, stored as tables.")
app.add_typer(
    behaviours_app, name="behaviours", help="List, check and create behaviours (plug-ins)."
)
app.add_typer(eval_app(), name="eval", help="Measure accuracy and speed against ground truth.")
app.add_typer(train_app, name="train", help="Train the learned parts of visup on labelled data.")
app.add_typer(
    debug_app, name="debug", help="Visualise intermediate results, for developers of visup."
)


def _version(wanted: bool) -> None:
    if wanted:
        from visup.version import __version__

        echo(f"visup {__version__}")
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """The visual supervisor: watches machines work and reports whether the work goes well."""


@cache
def command() -> Callable[[], object]:
    """The command with its groups, which take typer longer to put together than most commands take."""
    return get_command(app)


def main() -> None:
    """Run the command; an error that the user can fix is printed as one message, with exit code 2."""
    if gc.get_threshold()[0] < COLLECT_AFTER:
        gc.set_threshold(COLLECT_AFTER)
    try:
        if not {"-h", "--help", "--version"} & set(sys.argv):
            check_memory()
        command()()
    except VisupError as error:
        print_error(str(error))
        sys.exit(BAD_INPUT)
    except MemoryError as fault:
        hint = "use smaller frames or files; a run that had started can be resumed"
        print_error(str(VisupError(f"out of memory: {fault}".rstrip(": "), hint=hint)))
        sys.exit(FAILED)
    except BrokenPipeError:
        # The reader (such as `head`) went away; nothing more can be said to it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)


if __name__ == "__main__":
    main()
