"""How commands are told which lake is meant."""

from __future__ import annotations

from typing import Annotated

import typer

LakePlace = Annotated[
    str, typer.Argument(metavar="LAKE", help="A lake of `visup archive`: its folder, or a URL.")
]
Into = Annotated[
    str,
    typer.Option(
        "--into", metavar="LAKE", help="The lake, a folder or URL; made when it is not there."
    ),
]
