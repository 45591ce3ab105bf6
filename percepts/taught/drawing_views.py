"""Images of taught views: each view's pixels with its outline, and the name below."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from visup.percepts.taught.taught_view import TaughtView

TILE = 200
"""Side of a view, pixels."""

_BELOW = 28
_MAX_COLUMNS = 5
_PAPER, _INK, _LINE = (255, 255, 255), (47, 39, 35), (60, 180, 255)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def taught_views_sheet(views: Sequence[TaughtView]) -> NDArray[np.uint8]:
    """All views side by side, in rows.

    Args:
        views: At least one.

    Returns:
        (H, W, 3) uint8, BGR.
    """
    columns = min(_MAX_COLUMNS, len(views))
    rows = -(-len(views) // columns)
    sheet = np.full((rows * (TILE + _BELOW), columns * TILE, 3), _PAPER, np.uint8)
    for k, view in enumerate(views):
        top, left = k // columns * (TILE + _BELOW), k % columns * TILE
        sheet[top : top + TILE, left : left + TILE] = view_tile(view, TILE)
        name = view.name.encode("ascii", "replace").decode()
        cv2.putText(sheet, name[:22], (left + 8, top + TILE + 18), _FONT, 0.5, _INK, 1, cv2.LINE_AA)
    return sheet


def view_tile(view: TaughtView, side: int) -> NDArray[np.uint8]:
    """A view's pixels with its outline, fitted into a white square (side, side, 3), BGR."""
    zoom = (side - 12) / max(view.mask.shape)
    size = tuple(max(1, round(n * zoom)) for n in view.mask.shape[::-1])
    interpolation = cv2.INTER_AREA if zoom < 1 else cv2.INTER_LINEAR
    image = cv2.resize(view.image, size, interpolation=interpolation)
    mask = cv2.resize(view.mask.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    outlines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(image, outlines, -1, _LINE, 2, cv2.LINE_AA)
    tile = np.full((side, side, 3), _PAPER, np.uint8)
    top, left = (side - size[1]) // 2, (side - size[0]) // 2
    tile[top : top + size[1], left : left + size[0]] = image
    return tile
