"""Tables of figures by item that fit 80 columns, for any number of figures and items."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from rich.table import Table

Rows = Mapping[str, Mapping[str, Any]]
Cells = Mapping[str, Mapping[str, str]]

WIDTH = 80
MAX_NAME_LENGTH = 26
"""Characters; longer names of items are wrapped."""

HEADINGS = {
    "verdicts_right": "right",
    "false_alerts_per_min": "false alerts /min",
    "false_alerts_per_hour": "false alerts /hour",
    "false_reports_per_hour": "false reports /hour",
}
"""Headings that are shorter than the keys in the file of figures."""

ABBREVIATIONS = {"interrupted": "interr.", "in_progress": "in pr.", "succeeded": "succ."}
"""Abbreviated verdicts, used where the full words do not fit."""


def figures_tables(title: str, figures: Mapping[str, Any], keys: Sequence[str]) -> Iterator[Table]:
    """Figures as tables that fit 80 columns.

    Items are rows if that fits, else figures are rows and items are numbered columns if that fits, else the
    figures are spread over several tables.

    Args:
        title: Title of the table.
        figures: `items` by name, and `total`.
        keys: The figures, in order; those that no item has are left out.
    """
    rows: Rows = {**figures["items"], "total": figures["total"]}
    present_keys = [k for k in keys if any(k in row for row in rows.values())]
    for cells in (_cells(rows, present_keys, {}), _cells(rows, present_keys, ABBREVIATIONS)):
        if _fits([_name_width(rows), *_widths(cells, present_keys)]):
            yield _wide_table(title, cells, present_keys)
            return
        if len(rows) <= len(present_keys) and _fits(
            [max(map(len, present_keys)), *_transposed_widths(cells, present_keys)]
        ):
            yield _transposed_table(title, cells, present_keys)
            return
    for number, part in enumerate(_parts(cells, present_keys)):
        yield _wide_table(f"{title} (continued)" if number else title, cells, part)


def _cells(rows: Rows, keys: Sequence[str], abbreviations: Mapping[str, str]) -> Cells:
    return {name: {k: _cell(row.get(k), abbreviations) for k in keys} for name, row in rows.items()}


def _cell(value: object, abbreviations: Mapping[str, str]) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.3f}" if abs(value) < 10 else f"{value:.1f}"
    return abbreviations.get(str(value), str(value))


def _heading_words(key: str) -> list[str]:
    return HEADINGS.get(key, key.replace("_", " ")).split()


def _name_width(rows: Mapping[str, object]) -> int:
    return min(MAX_NAME_LENGTH, max(map(len, rows)))


def _widths(cells: Cells, keys: Sequence[str]) -> list[int]:
    """Width of each figure's column: its widest cell, or the longest word of its heading."""
    return [
        max(len(text) for text in (*_heading_words(k), *(c[k] for c in cells.values())))
        for k in keys
    ]


def _transposed_widths(cells: Cells, keys: Sequence[str]) -> list[int]:
    """Width of each item's column, when figures are rows."""
    return [max(5, *(len(row[k]) for k in keys)) for row in cells.values()]


def _fits(widths: Sequence[int]) -> bool:
    """Whether columns of these widths fit, with the lines between them."""
    return 1 + sum(w + 1 for w in widths) <= WIDTH


def _parts(cells: Cells, keys: Sequence[str]) -> Iterator[list[str]]:
    """Split the figures into parts, each as large as fits."""
    names, part = _name_width(cells), list[str]()
    for key in keys:
        if part and not _fits([names, *_widths(cells, [*part, key])]):
            yield part
            part = []
        part.append(key)
    yield part


def _wide_table(title: str, cells: Cells, keys: Sequence[str]) -> Table:
    table = _table(title)
    table.add_column("", overflow="fold", width=_name_width(cells))
    # Explicit widths: by default, rich fits whole headings at the cost of the cells.
    for key, width in zip(keys, _widths(cells, keys), strict=True):
        table.add_column(" ".join(_heading_words(key)), justify="right", width=width)
    for name, row in cells.items():
        if name == "total":
            table.add_section()
        table.add_row(name, *(row[k] for k in keys))
    return table


def _transposed_table(title: str, cells: Cells, keys: Sequence[str]) -> Table:
    """Figures as rows; items as numbered columns, with their names below."""
    names = [name for name in cells if name != "total"]
    table = _table(title)
    table.add_column("", no_wrap=True)
    for heading in (*(str(n) for n in range(1, len(names) + 1)), "total"):
        table.add_column(heading, justify="right", no_wrap=True)
    for key in keys:
        table.add_row(key, *(row[key] for row in cells.values()))
    table.caption = ", ".join(f"{n} {name}" for n, name in enumerate(names, start=1))
    return table


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", caption_justify="left", padding=(0, 0))
