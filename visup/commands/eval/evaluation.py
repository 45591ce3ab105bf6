"""An evaluation as a command: its options, run, table, file of figures and exit code."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from inspect import Parameter, Signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.commands.options import OptionValues, Setting
from visup.runs.settings import Option
from visup.terminal.console import make_console

if TYPE_CHECKING:
    from rich.console import RenderableType

Figures = Mapping[str, Any]
"""`items` by name, and `total`; other keys appear only in the file."""

JSON = Setting(
    "json_file", Path | None, None, Option("Also write the figures to this file.", "--json")
)


@dataclass(frozen=True, slots=True)
class EvaluationCommand:
    """One command of `visup eval`.

    Attributes:
        name: Name of the command.
        about: Its help: what it measures.
        function: The function that computes the figures, as 'module:function'; called with the argument, the
            settings and `progress`.
        verb: Shown in the status line while it runs.
        keys: Figures for the columns of the table, in order; empty for an evaluation with tables of its own.
        settings: Its options.
        argument: The positional argument, or None.
        closing: Makes the lines after the table, from the figures.
        failed: Whether the exit code is 1, from the figures.
        recorded: Selects the settings for the file of figures; all of them by default.
    """

    name: str
    about: str
    function: str
    verb: str
    keys: tuple[str, ...] = ()
    settings: tuple[Setting, ...] = ()
    argument: Parameter | None = None
    closing: Callable[[Figures], Iterator[RenderableType]] = field(default=lambda _: iter(()))
    failed: Callable[[Figures], bool] = field(default=lambda _: False)
    recorded: Callable[[OptionValues], OptionValues] = field(default=dict)

    def command(self) -> Callable[..., None]:
        """The function from which typer makes a command."""

        def run(json_file: Path | None, **options: Any) -> None:
            self._run(json_file, options)

        run.__doc__ = self.about
        parameters = [self.argument] if self.argument else []
        parameters += [s.parameter() for s in (*self.settings, JSON)]
        run.__signature__ = Signature(parameters)  # type: ignore[attr-defined]
        run.__annotations__ = {}
        return run

    def _run(self, json_file: Path | None, options: OptionValues) -> None:

        from visup.commands.eval.figures_table import figures_tables
        from visup.evaluation.oracles import evaluation_module
        from visup.evaluation.record import write_record

        folder = options.get("folder")
        _check_paths(folder, json_file)
        module, _, function = self.function.partition(":")
        with _progress_line(self.verb) as progress:
            figures = getattr(evaluation_module(module), function)(**options, progress=progress)
        if (
            json_file
        ):  # written first: hours of work must not be lost if the table cannot be printed
            settings = {k: v for k, v in options.items() if k != "folder"}
            write_record(json_file, figures, self.recorded(settings))
        console = make_console()
        if self.keys:
            title = f"{self.name}: {folder}" if folder else self.name
            console.print(*figures_tables(title, figures, self.keys))
        for text in self.closing(figures):
            console.print(text, soft_wrap=isinstance(text, str), markup=False)
        if self.failed(figures):
            raise typer.Exit(1)


def folder_argument(about: str) -> Parameter:
    """The argument of an evaluation that reads a folder."""
    annotation = Annotated[Path, typer.Argument(help=about)]
    return Parameter("folder", Parameter.KEYWORD_ONLY, annotation=annotation)


def count(name: str, default: int | None, about: str, at_least: int | None = 1) -> Setting:
    """An integer option."""
    kind = int if default is not None else int | None
    return Setting(name, kind, default, Option(about, at_least=at_least))


def flag(name: str, about: str) -> Setting:
    """A flag."""
    return Setting(name, bool, False, Option(about, f"--{name}"))


FOLDER = folder_argument("Folder with the data and its ground truth.")
LIMIT = count("limit", None, "Most frames (or shapes) of each item, for a quick look.", None)


def _check_paths(folder: Path | None, json_file: Path | None) -> None:
    """Refuse invalid paths before an evaluation of minutes starts.

    Raises:
        SettingsError: The folder does not exist.
        OutputError: The folder of the file for the figures does not exist.
    """
    from visup.agent.model.errors import OutputError, SettingsError

    if folder is not None and not folder.is_dir():
        raise SettingsError("there is no such folder", where=str(folder))
    if json_file and not json_file.absolute().parent.is_dir():
        raise OutputError("its folder does not exist", where=str(json_file))


@contextmanager
def _progress_line(verb: str) -> Iterator[Callable[[str], None]]:
    """A status line on standard error, updated as items are done."""
    with make_console(stderr=True).status(verb) as status:
        yield lambda text: status.update(f"{verb}: {text}")
