"""Options that several evaluations share."""

from __future__ import annotations

from inspect import Parameter
from typing import Annotated

import typer

from visup.commands.eval.evaluation import folder_argument
from visup.commands.options import Setting
from visup.runs.settings import Option


def count(name: str, default: int | None, about: str, at_least: int | None = 1) -> Setting:
    """A whole number."""
    kind = int if default is not None else int | None
    return Setting(name, kind, default, Option(about, at_least=at_least))


def flag(name: str, about: str) -> Setting:
    """What is said or not."""
    return Setting(name, bool, False, Option(about, f"--{name}"))


FOLDER = folder_argument("Folder with the data and its ground truth.")
LIMIT = count("limit", None, "Frames (or shapes) of each item, for a quick look.", None)
SEED = count("seed", 0, "Of all that is drawn.", 0)
CLIP_NAMES = Parameter(
    "names",
    Parameter.KEYWORD_ONLY,
    default=None,
    annotation=Annotated[
        list[str] | None, typer.Argument(metavar="NAME", help="Which clips; all if none.")
    ],
)
ADAPTERS = "visup.commands.eval.adapters"
