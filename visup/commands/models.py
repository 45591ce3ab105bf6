"""`visup models`: build a model database, add to it, look into it, match a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from visup.percepts.shape.database import ModelDatabase, Ranking

app = typer.Typer(
    no_args_is_help=True, help="Model databases: the shapes that objects are known by."
)

Db = Annotated[Path, typer.Argument(metavar="DB", help="Model database file.")]


@app.command("build")
def build(
    db: Db,
    meshes: Annotated[
        list[Path], typer.Argument(metavar="MESH...", help="Mesh files (PLY, STL, OBJ, ...).")
    ],
    views: Annotated[
        int, typer.Option(help="Views of each mesh, spread evenly over the sphere.")
    ] = 32,
    seed: Annotated[int, typer.Option(help="Turns the directions of the views.")] = 0,
    jobs: Annotated[int, typer.Option(help="Processes; 0 for one on each core.")] = 0,
) -> None:
    """Build a database from meshes. Each model is called as its file, without the ending."""
    import os

    from rich.progress import Progress

    from visup.percepts.shape.build import build_database

    with Progress(transient=True) as bar:
        task = bar.add_task("views", total=len(meshes))
        built = build_database(
            db,
            meshes,
            views=views,
            seed=seed,
            jobs=jobs or os.cpu_count() or 1,
            progress=lambda done, _, name: bar.update(task, completed=done, description=name),
        )
    _tell_size(built)


@app.command("add")
def add(
    db: Db,
    name: Annotated[str, typer.Option(help="Name of the model; one that exists gets more views.")],
    silhouettes: Annotated[Path, typer.Option(help="Folder of silhouette pictures.")],
    clusters: Annotated[int, typer.Option(help="Exemplars that stand for all pictures.")] = 8,
) -> None:
    """Add exemplars of a folder of silhouettes, which may be cut by the pictures' borders."""
    from visup.agent.errors import SettingsError
    from visup.percepts.shape.build import read_silhouettes, silhouette_views
    from visup.percepts.shape.database import ModelDatabase

    if clusters < 1 or not name.strip():
        raise SettingsError(
            f"{clusters} exemplars for a model called {name!r} were asked for",
            expected="a name, and at least 1 exemplar",
        )
    database = ModelDatabase.open(db)
    _tell_size(database.add(silhouette_views(name, read_silhouettes(silhouettes), clusters)))


@app.command("list")
def list_models(db: Db) -> None:
    """List the models of a database with their views."""
    from rich.console import Console
    from rich.table import Table

    from visup.percepts.shape.database import ModelDatabase

    database = ModelDatabase.open(db)
    table = Table("object", "views", "of a mesh", "cut by a border", title=str(db))
    for name in database.names():
        own = [v for v in database.views if v.name == name]
        rendered = sum(v.direction is not None for v in own)
        table.add_row(name, str(len(own)), str(rendered), str(sum(v.cut for v in own)))
    Console().print(table)
    _tell_size(database)


@app.command("match")
def match_picture(
    db: Db,
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="Picture of a silhouette.")],
    top: Annotated[int, typer.Option(help="How many views to show.")] = 5,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Rank the views that a silhouette looks like."""
    from visup.agent.errors import DatabaseError, SettingsError
    from visup.percepts.shape.build import read_silhouette
    from visup.percepts.shape.database import ModelDatabase
    from visup.percepts.shape.silhouette import looks_cut, normalise

    if top < 1:
        raise SettingsError(f"the best {top} views were asked for", expected="at least 1")
    database = ModelDatabase.open(db)
    mask = read_silhouette(image)
    silhouette = normalise(mask, cut=looks_cut(mask))
    if silhouette is None:
        raise DatabaseError(
            "there is no silhouette in this picture",
            where=str(image),
            expected="an object of at least 24 pixels, one shade on another",
        )
    ranking = database.query(silhouette, top=top)
    if as_json:
        _print_json(ranking)
    else:
        _print_ranking(ranking, image, len(database.views))


@app.command("show")
def show(
    db: Db,
    out: Annotated[Path, typer.Option(help="Picture to write (PNG).")],
) -> None:
    """Draw a contact sheet: a row for each model, its views with their shock graphs."""
    import cv2

    from visup.agent.errors import OutputError
    from visup.percepts.shape.database import ModelDatabase
    from visup.percepts.shape.pictures import contact_sheet

    sheet = contact_sheet(ModelDatabase.open(db))
    done, data = cv2.imencode(".png", sheet)
    try:
        out.write_bytes(data.tobytes() if done else b"")
    except OSError as e:
        raise OutputError(f"the picture cannot be written ({e.strerror})", where=str(out)) from e
    typer.echo(f"{out}: {sheet.shape[1]} x {sheet.shape[0]} pixels")


def _tell_size(database: ModelDatabase) -> None:
    typer.echo(f"{database.path}: {len(database.names())} models, {len(database.views)} views")


def _print_json(ranking: Ranking) -> None:
    import json

    rows = [
        {
            "object": m.view.name,
            "view": m.view.number,
            "similarity": round(m.similarity, 6),
            "rotation_rad": m.rotation,
            "direction": m.direction,
        }
        for m in ranking.matches
    ]
    typer.echo(json.dumps({"matches": rows, "compared": ranking.compared}))


def _print_ranking(ranking: Ranking, image: Path, views: int) -> None:
    import math

    from rich.console import Console
    from rich.table import Table

    table = Table("rank", "object", "view", "similarity", "rotation", title=str(image))
    for rank, m in enumerate(ranking.matches, start=1):
        turn = "unknown" if m.rotation is None else f"{math.degrees(m.rotation):.0f}°"
        table.add_row(str(rank), m.view.name, str(m.view.number), f"{m.similarity:.3f}", turn)
    Console().print(table)
    typer.echo(f"{ranking.compared} of {views} views compared in full")
