"""How figures are drawn: tables that can be read at 80 columns, and the lines below them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from rich.table import Table
from rich.text import Text

Rows = Mapping[str, Mapping[str, Any]]

_WORST = 6


def figures_table(title: str, figures: Mapping[str, Any], keys: tuple[str, ...]) -> Table:
    """Figures as a table that fits 80 columns.

    Args:
        title: Of the table.
        figures: With `items` by name and `total`.
        keys: Which figures, in order; those that no item has are left out.
    """
    rows: Rows = {**figures["items"], "total": figures["total"]}
    shown = [k for k in keys if any(k in row for row in rows.values())]
    # Many columns are told as many rows: a table must be readable at 80 columns.
    tall = len(shown) > 8 and len(figures["items"]) <= 8
    return _tall(title, rows, shown) if tall else _wide(title, rows, shown)


def _wide(title: str, rows: Rows, keys: list[str]) -> Table:
    table = Table(title=title, title_justify="left", padding=(0, 0))
    table.add_column("", no_wrap=True)
    for key in keys:
        table.add_column(key, justify="right", no_wrap=True)
    for name, row in rows.items():
        if name == "total":
            table.add_section()
        table.add_row(name, *(_cell(row.get(k)) for k in keys))
    return table


def _tall(title: str, rows: Rows, keys: list[str]) -> Table:
    """Figures as rows; items as numbered columns, whose names stand below."""
    names = [name for name in rows if name != "total"]
    table = Table(title=title, title_justify="left", caption_justify="left", padding=(0, 0))
    table.add_column("", no_wrap=True)
    for heading in (*(str(n) for n in range(1, len(names) + 1)), "total"):
        table.add_column(heading, justify="right", no_wrap=True)
    for key in keys:
        table.add_row(key, *(_cell(row.get(key)) for row in rows.values()))
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


def totals_table(figures: Mapping[str, Any]) -> Table:
    """The totals, a row for each."""
    table = Table("figure", "value")
    for name, value in figures["total"].items():
        table.add_row(name, f"{value:.3g}" if isinstance(value, float) else str(value))
    return table


def reliability_table(figures: Mapping[str, Any]) -> Table:
    """How often identities were right, by the confidence with which they were believed."""
    table = Table("confidence", "right", "object-frames", title="identity: believed and right")
    for row in figures["total"]["reliability"]:
        believed, right = f"{row['confidence']:.2f}", f"{row['right']:.3f}"
        table.add_row(believed, right, f"{row['count']:.0f}")
    return table


def clips_table(items: Rows) -> Table:
    """A row for each object of each clip, whole at 80 columns.

    Args:
        items: As of `evaluate_clips`.
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


def _clip_rows(name: str, item: Mapping[str, Any]) -> Iterator[tuple[str | Text, ...]]:
    missed = "; ".join(item["missed"])
    verdict = Text(missed, "red") if missed else Text("pass", "green")
    first: tuple[str | Text, ...] = (name, f"{item.get('ghost', 0.0):.1%}", verdict)
    for thing, o in list(item.get("objects", {}).items()) or [("", {})]:
        scores = (f"{o['J']:.3f}", str(o["id_switches"])) if o else ("", "")
        yield (first[0], thing, *scores, *first[1:])
        first = ("", "", "")


def views_table(total: Mapping[str, Any]) -> Table:
    """How views are recognised in each condition."""
    from visup.evaluation.shape.view_queries import CONDITIONS

    baseline = total["baseline"]
    table = Table(title="views", title_justify="left")
    for heading in ("", "top1", "top5", "angle", *(f"{name} top1" for name in baseline)):
        table.add_column(heading, justify="right" if heading else "left")
    for condition in CONDITIONS:
        row = total[condition]
        angle = "" if row["angle_deg"] is None else f"{row['angle_deg']:.1f}°"
        others = (f"{baseline[name][condition]:.3f}" for name in baseline)
        table.add_row(condition, f"{row['top1']:.3f}", f"{row['top5']:.3f}", angle, *others)
    return table


def hardest_views(items: Rows) -> str:
    """The objects that are named rightly least often, over all conditions."""
    from visup.evaluation.shape.view_queries import CONDITIONS

    shares = {
        name: sum(row[c]["top1"] for c in CONDITIONS) / len(CONDITIONS)
        for name, row in items.items()
    }
    worst = sorted(shares, key=lambda name: shares[name])[:_WORST]
    return "hardest: " + ", ".join(f"{name} {shares[name]:.2f}" for name in worst)
