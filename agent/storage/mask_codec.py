"""Masks as runs, contours as chain codes, and how much of a document is read: for `codec.py`.

Compiled loops are imported where they are called: a process of an isolated behaviour, which reads and
writes documents too, starts in half the time without.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from numpy.typing import NDArray

MOST_PIXELS = 2**28
"""No step has masks and contours of more pixels and points together."""


_left: ContextVar[list[int]] = ContextVar("pixels that are left")


@contextmanager
def room() -> Iterator[None]:
    """Where masks and contours are read: together they are bounded."""
    token = _left.set([MOST_PIXELS])
    try:
        yield
    finally:
        _left.reset(token)


def _take(pixels: int) -> None:
    """Account for memory before it is taken."""
    left = _left.get([MOST_PIXELS])
    left[0] -= pixels
    if pixels < 0 or left[0] < 0:
        raise ValueError(f"its masks have more than {MOST_PIXELS} pixels")


def mask_to_runs(mask: NDArray[np.bool_]) -> list[int]:
    """Lengths of the runs of a mask in reading order, that of False first (0 when there is none)."""
    from visup.agent.storage._codec_jit import run_lengths

    lengths: list[int] = run_lengths(np.ascontiguousarray(mask).reshape(-1)).tolist()
    return lengths


def runs_to_mask(lengths: list[int], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """The mask of runs, of shape (height, width).

    Raises:
        ValueError: The runs are not of that many pixels.
    """
    _take(shape[0] * shape[1])
    counts = np.asarray(lengths, np.int64)
    if counts.ndim != 1 or (counts < 0).any() or int(counts.sum()) != shape[0] * shape[1]:
        raise ValueError("the runs of a mask do not fill its box")
    return np.repeat(np.arange(len(counts)) % 2 == 1, counts).reshape(shape)


NO_DIGIT = 9
"""Stands for what is no move of a chain code."""

_CHAIN = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)])
_CODE = np.full(9, NO_DIGIT, np.uint8)
"""The character of a move (dx, dy) at 3 (dx + 1) + dy + 1."""
for _digit, (_dx, _dy) in enumerate(_CHAIN):
    _CODE[3 * (_dx + 1) + _dy + 1] = ord("0") + _digit


def contour_to_chain(contour: NDArray[np.float32]) -> dict[str, Any] | None:
    """A contour that goes from pixel to neighbouring pixel as a chain code (Freeman, 1961).

    Digits are directions in steps of 45 degrees, 0 to the right, 2 down. None where it is another
    contour, which is kept as an array.
    """
    points = np.asarray(contour)
    if points.dtype != np.float32 or points.ndim != 2 or points.shape[1] != 2 or not len(points):
        return None
    from visup.agent.storage._codec_jit import chain_digits

    digits = chain_digits(np.ascontiguousarray(points), _CODE)
    if len(digits) == len(points):
        return None
    first = [int(points[0, 0]), int(points[0, 1])]
    return {"$": "chain", "from": first, "of": digits.tobytes().decode()}


def chain_to_contour(written: Mapping[str, Any]) -> NDArray[np.float32]:
    """The contour of a chain code, (N, 2) pixels.

    Raises:
        ValueError: It is none, or there is no room.
    """
    digits = np.frombuffer(written["of"].encode(), np.uint8) - ord("0")
    if len(digits) and digits.max() > 7:
        raise ValueError("a chain code has digits from 0 to 7")
    x, y = written["from"]
    _take(len(digits))
    from visup.agent.storage._codec_jit import chain_points

    return chain_points(int(x), int(y), digits, _CHAIN)
