"""A contact sheet of a model database."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from visup.percepts.shape.database.model_database import ModelDatabase
from visup.percepts.shape.drawing.pictures import draw_graph, draw_shape, placement
from visup.percepts.shape.drawing.sheet import PALE, RULE, Sheet, legend
from visup.percepts.shape.index.view_records import ModelView
from visup.percepts.taught.drawing_views import view_tile

TILE = 104
"""Side of one view on a contact sheet, pixels."""

Item = TypeVar("Item")

_VIEWS_SHOWN = 10
_PHOTOS_SHOWN = 5
_LABEL = 170
_HEAD = 44
_MARGIN = 18


def contact_sheet(database: ModelDatabase, names: Sequence[str] | None = None) -> NDArray[np.uint8]:
    """A row for each model: its name, how many views it has, and up to ten of them; photos first.

    Args:
        database: The models.
        names: Models to show; all when None.

    Returns:
        (H, W, 3) uint8, BGR.
    """
    shown = list(database.names() if names is None else names)
    sheet = Sheet(_LABEL + _VIEWS_SHOWN * TILE + _MARGIN, _HEAD + max(1, len(shown)) * TILE)
    title = f"{len(shown)} models, {len(database.views)} views"
    if database.taught:
        title += f", {len(database.taught)} outlines taught"
    sheet.text((_MARGIN, 28), title, 16)
    legend(sheet, (_LABEL + _VIEWS_SHOWN * TILE - 4 * 104, 28), 104)
    for number, name in enumerate(shown):
        _draw_row(sheet, database, name, _HEAD + number * TILE)
    return sheet.picture()


def _draw_row(sheet: Sheet, database: ModelDatabase, name: str, top: float) -> None:
    views_of_model = database.views.named({name}).tolist()
    taught = [view for view in database.taught if view.name == name]
    sheet.line([(0, top), (sheet.size[0], top)], RULE)
    sheet.fitted((_MARGIN, top + 32), name, _LABEL - _MARGIN - 8, 14)
    for k, line in enumerate(_counts([database.views[k] for k in views_of_model], len(taught))):
        sheet.text((_MARGIN, top + 50 + 15 * k), line, 12, PALE)
    photos = _evenly_selected(taught, _PHOTOS_SHOWN if views_of_model else _VIEWS_SHOWN)
    for column, photo in enumerate(photos):
        corner = (_LABEL + column * TILE + 4, top + 4)
        sheet.photo(corner, view_tile(photo, 2 * TILE), TILE - 8)
    for column, view in enumerate(
        _evenly_selected(views_of_model, _VIEWS_SHOWN - len(photos)), start=len(photos)
    ):
        shape = database.shapes[view]
        centre = (_LABEL + (column + 0.5) * TILE, top + TILE / 2)
        place = placement(shape.contour, centre, TILE - 16)
        draw_shape(sheet, shape.contour, place)
        draw_graph(sheet, shape.graph, place)


def _counts(views: Sequence[ModelView], taught: int) -> list[str]:
    cut, directions = sum(v.cut for v in views), sum(len(v.seen_from) for v in views)
    lines = [f"{len(views)} view{'s' if len(views) != 1 else ''}"]
    if directions:
        lines.append(f"{directions} directions")
    if cut:
        lines.append(f"{cut} cut by a border")
    if taught:
        lines.append(f"{taught} taught")
    return lines


def _evenly_selected(items: Sequence[Item], most: int) -> list[Item]:
    """At most `most` items, evenly spaced over a sequence."""
    if len(items) <= most:
        return list(items)
    return [items[i * len(items) // most] for i in range(most)]
