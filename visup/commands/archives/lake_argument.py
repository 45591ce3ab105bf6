"""The argument and the option that name a lake."""

from __future__ import annotations

from typing import Annotated

import typer

LakeLocation = Annotated[
    str, typer.Argument(metavar="LAKE", help="A lake made by `visup archive`: a folder or a URL.")
]
IntoLake = Annotated[
    str,
    typer.Option(
        "--into", metavar="LAKE", help="The lake, a folder or URL; created if it does not exist."
    ),
]
