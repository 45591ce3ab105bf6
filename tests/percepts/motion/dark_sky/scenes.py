"""Drawn bodies before a dark sky."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

SHAPE = (120, 160)
SKY = 4

Disc = tuple[float, float, float]
"""x, y, radius: pixels."""


def disc(x: float, y: float, radius: float) -> np.ndarray:
    """(H, W) bool."""
    ys, xs = np.mgrid[: SHAPE[0], : SHAPE[1]]
    return np.asarray(np.hypot(xs - x, ys - y) < radius)


def bar(x0: int, x1: int, y0: int, y1: int) -> np.ndarray:
    """(H, W) bool."""
    out = np.zeros(SHAPE, bool)
    out[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)] = True
    return out


def painted(
    masks: Sequence[np.ndarray],
    levels: Sequence[float],
    seed: int = 0,
    corners: Sequence[tuple[float, float]] | None = None,
) -> np.ndarray:
    """(H, W) uint8: bodies over each other, the last one in front, with a little noise.

    Args:
        masks: (H, W) bool each.
        levels: Mean level of each.
        seed: Random seed of the noise.
        corners: Where the pattern of each begins, which moves with it; without patterns when None.
    """
    grey = np.full(SHAPE, float(SKY))
    ys, xs = np.mgrid[: SHAPE[0], : SHAPE[1]]
    for k, (mask, level) in enumerate(zip(masks, levels, strict=True)):
        x, y = corners[k] if corners else (0.0, 0.0)
        pattern = np.sin((xs - x) / 2.3 + k) * np.cos((ys - y) / 3.1) if corners else 0.0 * xs
        grey[mask] = (level * (1 + 0.3 * pattern))[mask]
    noise = np.random.default_rng(seed).normal(0, 0.7, SHAPE)
    return np.clip(np.round(grey + noise), 0, 255).astype(np.uint8)


def alike(a: np.ndarray, b: np.ndarray) -> float:
    """Intersection over union."""
    return float((a & b).sum() / max((a | b).sum(), 1))
