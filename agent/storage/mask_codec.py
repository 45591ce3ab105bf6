"""Run-length codes for masks and chain codes for contours, with a limit of their total size; for `codec.py`.

In plain NumPy, without compiled loops: the process of an isolated behaviour, which also encodes documents,
starts in a third of the time.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_PIXELS = 2**28
"""Maximum number of pixels and points of all masks and contours of a step together."""


_pixels_left: ContextVar[list[int]] = ContextVar("pixels that are left")


@contextmanager
def pixel_limit() -> Iterator[None]:
    """A context in which the total size of decoded masks and contours is limited."""
    token = _pixels_left.set([MAX_PIXELS])
    try:
        yield
    finally:
        _pixels_left.reset(token)


def _reserve(pixels: int) -> None:
    """Account for memory before it is taken."""
    remaining = _pixels_left.get([MAX_PIXELS])
    remaining[0] -= pixels
    if pixels < 0 or remaining[0] < 0:
        raise ValueError(f"its masks have more than {MAX_PIXELS} pixels")


def mask_to_runs(mask: NDArray[np.bool_]) -> list[int]:
    """Run lengths of a mask in reading order, beginning with False (0 if there is none)."""
    flat = np.ascontiguousarray(mask).reshape(-1)
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    bounds = [0, *changes.tolist(), flat.size]
    lengths = [after - before for before, after in pairwise(bounds)]
    return [0, *lengths] if flat.size and flat[0] else lengths


def runs_to_mask(lengths: list[int], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """The mask of run lengths, of shape (height, width).

    Raises:
        ValueError: The runs do not sum to that many pixels.
    """
    _reserve(shape[0] * shape[1])
    counts = np.asarray(lengths, np.int64)
    if counts.ndim != 1 or (counts < 0).any() or int(counts.sum()) != shape[0] * shape[1]:
        raise ValueError("the runs of a mask do not fill its box")
    return np.repeat(np.arange(len(counts)) % 2 == 1, counts).reshape(shape)


LARGEST = 2.0**24
"""float32 represents all smaller integers exactly."""

_CHAIN = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
_NO_MOVE = 4
"""Index of (0, 0)."""
_CODE = np.zeros(9, np.uint8)
"""Character of a move (dx, dy) at index 3 (dx + 1) + dy + 1."""
for _digit, (_dx, _dy) in enumerate(_CHAIN):
    _CODE[3 * (_dx + 1) + _dy + 1] = ord("0") + _digit


def contour_to_chain(contour: NDArray[np.float32]) -> dict[str, Any] | None:
    """A contour between neighbouring pixels as a chain code (Freeman, 1961).

    Digits are directions in steps of 45 degrees, 0 to the right, 2 down. None for any other contour, which is
    stored as an array.
    """
    points = np.asarray(contour)
    if points.dtype != np.float32 or points.ndim != 2 or points.shape[1] != 2 or not len(points):
        return None
    # NaN fails every comparison; a negative zero is equal to zero, but is not the same.
    if not (np.abs(points) < LARGEST).all() or (points != np.floor(points)).any():
        return None
    if (np.signbit(points) & (points == 0.0)).any():
        return None
    steps = points[1:] - points[:-1]
    if (np.abs(steps) > 1.0).any():
        return None
    moves = (3.0 * steps[:, 0] + steps[:, 1]).astype(np.intp) + _NO_MOVE
    if (moves == _NO_MOVE).any():
        return None
    first = [int(points[0, 0]), int(points[0, 1])]
    return {"$": "chain", "from": first, "of": _CODE[moves].tobytes().decode()}


def chain_to_contour(document: Mapping[str, Any]) -> NDArray[np.float32]:
    """The contour of a chain code, (N, 2) pixels.

    Raises:
        ValueError: It is not valid, or exceeds the limit.
    """
    digits = np.frombuffer(document["of"].encode(), np.uint8) - ord("0")
    if len(digits) and digits.max() > 7:
        raise ValueError("a chain code has digits from 0 to 7")
    x, y = document["from"]
    _reserve(len(digits))
    points = np.empty((len(digits) + 1, 2), np.int64)
    points[0] = int(x), int(y)
    points[1:] = _CHAIN[digits]
    return np.cumsum(points, axis=0).astype(np.float32)
