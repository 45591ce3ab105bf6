"""`visup models`: build a model database, add to it, inspect it, match a picture against it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from visup.terminal.console import echo, echo_json, make_console

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from visup.percepts.shape.database.model_database import ModelDatabase, Ranking

app = typer.Typer(
    no_args_is_help=True, help="Model databases: the shapes by which objects are recognised."
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
    seed: Annotated[int, typer.Option(help="Seed for the rotation of the viewing directions.")] = 0,
    jobs: Annotated[int, typer.Option(help="Processes; 0 for one per core.")] = 0,
) -> None:
    """Build a database from meshes. Each model is named after its file, without the extension.

    Running the same command again continues a build that was stopped. Views that are identical by
    symmetry are stored once.
    """
    import os

    from rich.progress import Progress

    from visup.percepts.shape.building.database_builder import build_database

    with Progress(transient=True) as bar:
        task = bar.add_task("views", total=len(meshes) * max(1, views))
        built = build_database(
            db,
            meshes,
            views=views,
            seed=seed,
            jobs=jobs or os.cpu_count() or 1,
            progress=lambda done, _, name: bar.update(task, completed=done, description=name),
        )
    _print_size(built)


@app.command("add")
def add(
    db: Db,
    name: Annotated[str, typer.Option(help="Name of the model; an existing one gets more views.")],
    silhouettes: Annotated[
        Path | None, typer.Option(help="Folder of pictures, one silhouette each.")
    ] = None,
    masks: Annotated[Path | None, typer.Option(help="Folder of label masks of a video.")] = None,
    label: Annotated[
        int | None,
        typer.Option(min=1, max=255, help="The object's value in --masks; any by default."),
    ] = None,
    clusters: Annotated[
        int, typer.Option(help="Number of exemplars to cluster the pictures into.")
    ] = 8,
) -> None:
    """Add exemplars from silhouettes, or from masks of an object in a video.

    Silhouettes that the picture border cuts are stored as truncated. A database that does not exist is
    created.
    """
    from visup.agent.model.errors import SettingsError
    from visup.percepts.shape.building.database_builder import (
        read_masks,
        read_silhouettes,
        silhouette_views,
    )
    from visup.percepts.shape.database.model_database import ModelDatabase

    if clusters < 1 or not name.strip():
        raise SettingsError(
            f"{clusters} exemplars for a model called {name!r} were asked for",
            expected="a name, and at least 1 exemplar",
        )
    if label is not None and masks is None:
        raise SettingsError("--label needs --masks, which is not given")
    if silhouettes is not None and masks is None:
        new = silhouette_views(name, read_silhouettes(silhouettes), clusters)
    elif masks is not None and silhouettes is None:
        new = silhouette_views(name, read_masks(masks, label), clusters)
    else:
        raise SettingsError(
            "either --silhouettes or --masks is needed, not both",
            expected="--silhouettes DIR or --masks DIR",
        )
    _print_size(ModelDatabase.open_or_new(db).add(new))


@app.command("learn")
def learn(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run folder, or its journal.")],
    models: Annotated[
        Path, typer.Option(metavar="DB", help="Model database; created if there is none.")
    ],
    thing: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=OBJECT", help="Name an object of the run; repeatable."),
    ] = None,
    source: Annotated[
        str | None, typer.Option(metavar="FILE", help="The video of the run, if it has moved.")
    ] = None,
    views: Annotated[int, typer.Option(min=1, help="Most views to add for each name.")] = 5,
    out: Annotated[
        Path | None,
        typer.Option(metavar="PNG", help="Picture of what was stored (default: beside DB)."),
    ] = None,
) -> None:
    """Add views of objects whose identity was confirmed in a run.

    Both the operator's answers during the run and --thing count as confirmation.
    """
    from visup.percepts.taught.drawing_views import taught_views_sheet
    from visup.teaching.learning import learn_from
    from visup.teaching.outlines import parse_things

    result = learn_from(run, models, parse_things(thing or ()), source, views)
    for sentence in result.messages:
        echo(sentence)
    out = out or models.with_name(f"{models.stem}-taught.png")
    write_picture(out, taught_views_sheet(result.views))


@app.command("list")
def list_models(db: Db) -> None:
    """List the models of a database and their views."""
    from collections import Counter

    from rich.table import Table

    from visup.percepts.shape.database.model_database import ModelDatabase

    database = ModelDatabase.open(db)
    columns = ("object", "views", "directions", "cut by a border", "taught")
    table = Table(*columns, title=str(db))
    taught = Counter(view.name for view in database.taught)
    for name in database.names():
        model_views = [database.views[k] for k in database.views.named({name})]
        directions = sum(len(v.seen_from) for v in model_views)
        counts = (len(model_views), directions, sum(v.cut for v in model_views), taught[name])
        table.add_row(name, *map(str, counts))
    make_console().print(table)
    _print_size(database)


@app.command("match")
def match_picture(
    db: Db,
    image: Annotated[Path, typer.Argument(metavar="IMAGE", help="Picture of a silhouette.")],
    top: Annotated[int, typer.Option(help="How many views to show.")] = 5,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
    out: Annotated[
        Path | None, typer.Option(help="Picture of the best five views to write (PNG).")
    ] = None,
) -> None:
    """Rank the views that match a silhouette; with --out, draw how they correspond."""
    from visup.agent.model.errors import DatabaseError, SettingsError
    from visup.percepts.shape.building.database_builder import read_silhouette
    from visup.percepts.shape.database.model_database import ModelDatabase
    from visup.percepts.shape.silhouette.silhouette import looks_cut, normalise

    if top < 1:
        raise SettingsError(f"the best {top} views were asked for", expected="at least 1")
    database = ModelDatabase.open(db)
    mask = read_silhouette(image)
    silhouette = normalise(mask, cut=looks_cut(mask))
    if silhouette is None:
        raise DatabaseError(
            "this picture contains no silhouette",
            where=str(image),
            expected="an object of at least 24 pixels, in one shade on a background of another",
        )
    ranking = database.query(silhouette, top=top)
    if as_json:
        _print_json(ranking)
    else:
        _print_ranking(ranking, image, len(database.views))
    if out is not None:
        from visup.percepts.shape.drawing.pictures import match_picture

        write_picture(out, match_picture(database, silhouette, ranking, image.name), as_json)


@app.command("show")
def show(
    db: Db,
    out: Annotated[
        Path | None, typer.Option(help="Picture to write (PNG; default: beside the database).")
    ] = None,
) -> None:
    """Draw a contact sheet: one row per model, its views with their shock graphs."""
    from visup.percepts.shape.database.model_database import ModelDatabase
    from visup.percepts.shape.drawing.contact_sheet import contact_sheet

    sheet = contact_sheet(ModelDatabase.open(db))
    write_picture(out or db.with_name(f"{db.stem}-sheet.png"), sheet)


def write_picture(out: Path, picture: NDArray[np.uint8], quiet: bool = False) -> None:
    """Write a picture as PNG and, unless quiet, say so.

    Raises:
        OutputError: It cannot be written.
    """
    import cv2

    from visup.agent.model.errors import OutputError

    done, data = cv2.imencode(".png", picture)
    try:
        out.write_bytes(data.tobytes() if done else b"")
    except OSError as e:
        raise OutputError(f"the picture cannot be written ({e.strerror})", where=str(out)) from e
    if not quiet:
        echo(f"{out}: {picture.shape[1]} x {picture.shape[0]} pixels")


def _print_size(database: ModelDatabase) -> None:
    parts = [f"{len(database.names())} models, {len(database.views)} views"]
    if database.taught:
        parts.append(f"{len(database.taught)} taught outlines")
    echo(f"{database.path}: {', '.join(parts)}")


def _print_json(ranking: Ranking) -> None:

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
    echo_json({"matches": rows, "compared": ranking.compared})


def _print_ranking(ranking: Ranking, image: Path, views: int) -> None:
    import math

    from rich.table import Table

    table = Table(title=image.name, title_justify="left")
    for heading, justify in (("", "right"), ("object", "left"), ("view", "right")):
        table.add_column(heading, justify=justify, overflow="fold")  # type: ignore[arg-type]
    for heading in ("similarity", "graph", "outline", "area", "rotation"):
        table.add_column(heading, justify="right", no_wrap=True)
    for rank, m in enumerate(ranking.matches, start=1):
        rotation = f"{math.degrees(m.rotation):.0f}°"
        mirrored = " m" if m.terms.mirrored else ""
        terms = (
            m.similarity,
            m.terms.graph_similarity,
            m.terms.outline_similarity,
            m.terms.area_similarity,
        )
        figures = (f"{t:.3f}" for t in terms)
        table.add_row(str(rank), m.view.name, str(m.view.number), *figures, rotation + mirrored)
    make_console().print(table)
    if any(m.terms.mirrored for m in ranking.matches):
        echo("m: mirrored, as seen from behind")
    echo(f"{ranking.compared} of {views} views compared in full")
