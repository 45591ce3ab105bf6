"""`visup eval`: figures against ground truth, as tables and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from visup.commands.eval.clips import clips
from visup.commands.eval.databases import robustness, scale
from visup.commands.eval.faults import faults
from visup.commands.eval.reasoning import reasoning
from visup.commands.eval.recognition import recognition
from visup.commands.eval.relations import relations
from visup.commands.eval.rules import rules
from visup.commands.eval.runtime import pace, resume, soak, stepping
from visup.commands.eval.tasks import tasks
from visup.commands.eval.views import views

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

app = typer.Typer(no_args_is_help=True)
app.command("clips")(clips)
app.command("scale")(scale)
app.command("robustness")(robustness)
app.command("views")(views)
app.command("faults")(faults)
app.command("relations")(relations)
app.command("rules")(rules)
app.command("reasoning")(reasoning)
app.command("tasks")(tasks)
app.command("recognition")(recognition)
app.command("resume")(resume)
app.command("soak")(soak)
app.command("stepping")(stepping)
app.command("pace")(pace)

Folder = Annotated[Path, typer.Argument(help="Folder with the data and its ground truth.")]
Json = Annotated[Path | None, typer.Option("--json", help="Write the figures to this file too.")]
Limit = Annotated[
    int | None, typer.Option(help="Frames (or shapes) of each item, for a quick look.")
]

MOTION_KEYS = ("J", "F", "J_object", "ghost", "id_switches", "mota", "idf1", "ms", "ratio")
SHAPE_KEYS = ("nn1", "rank_sum", "bullseye", "ms_shape", "ms_pair", "compared", "lost")
MISSION_KEYS = (
    "identity",
    "event_precision",
    "event_recall",
    "event_f1",
    "stage",
    "failing_latency_s",
    "alerts_found",
    "alerts_expected",
    "false_alerts",
    "false_alerts_per_hour",
    "verdicts_right",
    "verdicts",
    "verdict",
    "view_deg",
    "spin_error",
    "fps",
)

HEALTH_KEYS = (
    "clips",
    "found",
    "named",
    "latency_s",
    "early",
    "false_reports",
    "hours",
    "false_reports_per_hour",
    "ms",
)


@app.command("motion")
def motion(folder: Folder, json_file: Json = None, limit: Limit = None) -> None:
    """Segmentation and tracking: J, F, ghosts, id switches, MOTA, IDF1, time."""
    from visup.evaluation.motion.runner import evaluate_motion

    checked(folder, json_file)
    with told("seeing") as tell:
        figures = evaluate_motion(folder, limit=limit, progress=tell)
    _show("motion", folder, figures, MOTION_KEYS, json_file, {"limit": limit})


@app.command("shapes")
def shapes(folder: Folder, json_file: Json = None, limit: Limit = None) -> None:
    """Shape retrieval, leave one out: nearest neighbour, rank sums, bullseye, time."""
    from visup.evaluation.shape.retrieval import evaluate_shapes

    checked(folder, json_file)
    with told("comparing") as tell:
        figures = evaluate_shapes(folder, limit=limit, progress=tell)
    _show("shapes", folder, figures, SHAPE_KEYS, json_file, {"limit": limit})


@app.command("missions")
def missions(
    folder: Folder,
    json_file: Json = None,
    models: Annotated[Path | None, typer.Option(help="Model database.")] = None,
    limit: Limit = None,
) -> None:
    """Whole missions: identity, events, stages, alerts, verdicts, speed."""
    from visup.evaluation.missions.runner import evaluate_missions

    checked(folder, json_file)
    with told("supervising") as tell:
        figures = evaluate_missions(folder, models=models, limit=limit, progress=tell)
    settings = {"limit": limit, "models": str(models) if models else None}
    _show("missions", folder, figures, MISSION_KEYS, json_file, settings)


@app.command("health")
def health(
    folder: Annotated[Path, typer.Argument(help="Folder with sound video anywhere below it.")],
    json_file: Json = None,
    faults: Annotated[int, typer.Option(min=1, help="How many faults are injected.")] = 100,
    seed: Annotated[int, typer.Option(min=0, help="Of the faults that are drawn.")] = 0,
    limit: Annotated[
        int | None, typer.Option(min=1, help="Frames of each video when it is run unharmed.")
    ] = None,
) -> None:
    """Camera faults put into sound video: found within 1 s, rightly named, false reports."""
    from visup.evaluation.health.runner import evaluate_health

    checked(folder, json_file)
    with told("watching") as tell:
        figures = evaluate_health(folder, faults=faults, seed=seed, limit=limit, progress=tell)
    settings = {"faults": faults, "seed": seed, "limit": limit}
    _show("health", folder, figures, HEALTH_KEYS, json_file, settings)


def checked(folder: Path, json_file: Path | None) -> None:
    """Refuse what cannot work before an evaluation of minutes begins.

    Raises:
        SettingsError: The folder does not exist.
        OutputError: The folder of the file for the figures does not exist.
    """
    from visup.agent.model.errors import SettingsError

    if not folder.is_dir():
        raise SettingsError("there is no such folder", where=str(folder))
    writable(json_file)


def told(word: str) -> ProgressLine:
    """A line of progress on standard error: call it with what is being done."""
    return ProgressLine(word)


def writable(json_file: Path | None) -> None:
    """Refuse a file for the figures whose folder does not exist.

    Raises:
        OutputError: It does not.
    """
    from visup.agent.model.errors import OutputError

    if json_file and not json_file.absolute().parent.is_dir():
        raise OutputError("its folder does not exist", where=str(json_file))


class ProgressLine:
    """A line of progress on standard error, replaced as items are done."""

    def __init__(self, word: str) -> None:
        from rich.console import Console

        self._status = Console(stderr=True).status(word)
        self._word = word

    def __enter__(self) -> ProgressLine:
        self._status.start()
        return self

    def __call__(self, text: str) -> None:
        """Say what is being done."""
        self._status.update(f"{self._word}: {text}")

    def __exit__(self, *_: object) -> None:
        self._status.stop()


def _show(
    title: str,
    folder: Path,
    figures: Mapping[str, Any],
    keys: tuple[str, ...],
    json_file: Path | None,
    settings: Mapping[str, Any],
) -> None:
    from rich.console import Console

    from visup.evaluation.record import write_record

    console = Console()
    print_table(console, f"{title}: {folder}", figures, keys)
    if ranks := figures["total"].get("ranks"):
        console.print("ranks 1 to 10: " + " ".join(str(r) for r in ranks))
    if json_file:
        write_record(json_file, figures, settings)


def print_table(
    console: Console, title: str, figures: Mapping[str, Any], keys: tuple[str, ...]
) -> None:
    """Print figures as a table that fits 80 columns.

    Args:
        console: Where to.
        title: Of the table.
        figures: With `items` by name and `total`.
        keys: Which figures, in order; those that no item has are left out.
    """
    shown = [k for k in keys if any(k in row for row in _rows(figures).values())]
    # Many columns are told as many rows: a table must be readable at 80 columns.
    tall = len(shown) > 8 and len(figures["items"]) <= 8
    console.print(_tall(title, figures, shown) if tall else _wide(title, figures, shown))


def _rows(figures: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    return {**figures["items"], "total": figures["total"]}


def _wide(title: str, figures: Mapping[str, Any], keys: list[str]) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left", padding=(0, 0))
    table.add_column("", no_wrap=True)
    for key in keys:
        table.add_column(key, justify="right", no_wrap=True)
    for name, row in _rows(figures).items():
        if name == "total":
            table.add_section()
        table.add_row(name, *(_cell(row.get(k)) for k in keys))
    return table


def _tall(title: str, figures: Mapping[str, Any], keys: list[str]) -> Table:
    """Figures as rows; items as numbered columns, whose names stand below."""
    from rich.table import Table

    names = list(figures["items"])
    table = Table(title=title, title_justify="left", caption_justify="left", padding=(0, 0))
    table.add_column("", no_wrap=True)
    for heading in (*(str(n) for n in range(1, len(names) + 1)), "total"):
        table.add_column(heading, justify="right", no_wrap=True)
    for key in keys:
        table.add_row(key, *(_cell(row.get(key)) for row in _rows(figures).values()))
    table.caption = ", ".join(f"{n} {name}" for n, name in enumerate(names, start=1))
    return table


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"
    # Verdicts are long words for narrow columns.
    return {"interrupted": "interr.", "in_progress": "in pr.", "succeeded": "succ."}.get(
        str(value), str(value)
    )
