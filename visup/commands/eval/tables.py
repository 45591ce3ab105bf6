"""Tables of single evaluations, and the lines below them; `figures_table.py` has the shared ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

Rows = Mapping[str, Mapping[str, Any]]

_HARDEST_COUNT = 6


def totals_table(figures: Mapping[str, Any]) -> Table:
    """The totals, one row each."""
    table = Table("figure", "value")
    for name, value in figures["total"].items():
        table.add_row(name, f"{value:.3g}" if isinstance(value, float) else str(value))
    return table


def reliability_table(figures: Mapping[str, Any]) -> Table:
    """How often identities were right, by confidence."""
    table = Table("confidence", "right", "object-frames", title="identity: believed and right")
    for row in figures["total"]["reliability"]:
        believed, right = f"{row['confidence']:.2f}", f"{row['right']:.3f}"
        table.add_row(believed, right, f"{row['count']:.0f}")
    return table


def clips_table(items: Rows) -> Table:
    """A row for each object of each clip, within 80 columns.

    Args:
        items: From `evaluate_clips`.
    """
    table = Table(title="clips", title_justify="left", padding=(0, 0))
    table.add_column("clip", no_wrap=True)
    table.add_column("object", no_wrap=True)
    for heading in ("J", "switches", "ghosts"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("missed")
    for name, item in items.items():
        for row in _clip_rows(name, item):
            table.add_row(*row)
    return table


def _clip_rows(clip: str, item: Mapping[str, Any]) -> Iterator[tuple[str | Text, ...]]:
    missed = "; ".join(item["missed"])
    verdict = Text(missed, "red") if missed else Text("pass", "green")
    cells: tuple[str | Text, ...] = (clip, f"{item.get('ghost', 0.0):.1%}", verdict)
    for name, o in list(item.get("objects", {}).items()) or [("", {})]:
        scores = (f"{o['J']:.3f}", str(o["id_switches"])) if o else ("", "")
        yield (cells[0], name, *scores, *cells[1:])
        cells = ("", "", "")


def views_table(total: Mapping[str, Any]) -> Table:
    """Recognition of views in each condition."""
    from visup.evaluation.shape.view_queries import CONDITIONS

    baseline = total["baseline"]
    table = Table(title="views", title_justify="left")
    headings = ("top1", "top5", "angle", "known told", "strangers told", "ms")
    for heading in ("", *headings, *(f"{name} top1" for name in baseline)):
        table.add_column(heading, justify="right" if heading else "left")
    for condition in CONDITIONS:
        row = total[condition]
        angle = "" if row["angle_deg"] is None else f"{row['angle_deg']:.1f}°"
        others = (f"{baseline[name][condition]:.3f}" for name in baseline)
        rates = (f"{row[key]:.3f}" for key in ("known_told", "stranger_told"))
        best = (f"{row[key]:.3f}" for key in ("top1", "top5"))
        table.add_row(condition, *best, angle, *rates, f"{row['ms']:.1f}", *others)
    return table


def hardest_views(items: Rows) -> str:
    """The objects that are named correctly least often, over all conditions."""
    from visup.evaluation.shape.view_queries import CONDITIONS

    shares = {
        name: sum(row[c]["top1"] for c in CONDITIONS) / len(CONDITIONS)
        for name, row in items.items()
    }
    hardest = sorted(shares, key=lambda name: shares[name])[:_HARDEST_COUNT]
    return "hardest: " + ", ".join(f"{name} {shares[name]:.2f}" for name in hardest)
