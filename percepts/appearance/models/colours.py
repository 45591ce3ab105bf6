"""Colour models: histograms of an object's colours against those of its surroundings."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

OWN_LOG_ODDS = 0.7  # log odds from which a colour is the object's own
_STEPS = 16  # bins of lightness and of each colour; 4096 in all
# Shares of the pixels below which a colour is not distinctive. A colour seen neither on the object nor around
# it probably belongs to something else: it counts slightly against the object.
_RARE, _STRANGE = np.float32(1 / 1500), np.float32(1 / 450)
_CLIP = np.float32(3.0)


@dataclass(frozen=True, slots=True, eq=False)
class ColourModel:
    """Histograms over CIE Lab of an object and of its surroundings.

    Attributes:
        thing: (4096,) float32, shares of the object, which sum to 1.
        around: (4096,) float32, shares of its surroundings.
        table: (4096,) float32, log odds of the object for each colour, -3 to 3.
    """

    thing: Floats
    around: Floats
    table: Floats

    def odds(self, bins: NDArray[np.int32]) -> Floats:
        """Log odds that pixels of these colours are the object's, float32 in the shape of `bins`.

        Args:
            bins: From `colour_bins`, any shape.
        """
        return self.table[bins]

    def shared(self, other: ColourModel) -> float:
        """Intersection of the colour histograms of two objects, 0 to 1."""
        return float(np.minimum(self.thing, other.thing).sum())

    def blended(self, other: ColourModel, thing: float, around: float) -> ColourModel:
        """This model blended with shares of another's object and surroundings."""
        return colour_model(
            self.thing * np.float32(1 - thing) + other.thing * np.float32(thing),
            self.around * np.float32(1 - around) + other.around * np.float32(around),
        )


def colour_bins(lab: Bytes) -> NDArray[np.int32]:
    """The bin of each pixel's colour.

    Args:
        lab: (..., 3) uint8, CIE Lab as OpenCV codes it.

    Returns:
        (...) int32, 0 to 4095. Bins are finer near grey, where most colours are.
    """
    bins = _LIGHT[lab[..., 0]]
    bins += _GREEN[lab[..., 1]]
    bins += _BLUE[lab[..., 2]]
    return bins


def colour_model(thing: Floats, around: Floats) -> ColourModel:
    """A model from the histograms of an object and of its surroundings, (4096,) float32 each."""
    table = np.log((thing + _RARE) / (around + _STRANGE))
    return ColourModel(thing, around, np.clip(table, -_CLIP, _CLIP).astype(np.float32))


def learn_colours(lab: Bytes, thing: Floats, around: Floats) -> ColourModel:
    """Learn the colours of a patch.

    Args:
        lab: (h, w, 3) uint8, CIE Lab.
        thing: (h, w) float32, weight of each pixel as the object's.
        around: (h, w) float32, weight of each pixel as its surroundings'.
    """
    bins = colour_bins(lab).ravel()
    return colour_model(_histogram(bins, thing.ravel()), _histogram(bins, around.ravel()))


def summed_colours(models: list[ColourModel]) -> ColourModel:
    """The mean of the colour models of several views of one object."""
    share = np.float32(1 / len(models))
    thing = reduce(np.add, [m.thing for m in models]) * share
    return colour_model(thing, reduce(np.add, [m.around for m in models]) * share)


def _histogram(bins: NDArray[np.int32], weights: Floats) -> Floats:
    counts = np.bincount(bins, weights, minlength=_STEPS**3).reshape((_STEPS,) * 3)
    binned: Floats = counts.astype(np.float32)
    for axis in range(3):
        # Smoothed, since light and noise shift colours to neighbouring bins.
        flat = np.moveaxis(binned, axis, 0).reshape(_STEPS, -1)
        smooth = cv2.filter2D(
            np.ascontiguousarray(flat), -1, _KERNEL, borderType=cv2.BORDER_REPLICATE
        )
        binned = np.moveaxis(np.asarray(smooth, dtype=np.float32).reshape((_STEPS,) * 3), 0, axis)
    total = binned.sum()
    return np.ascontiguousarray(binned / max(total, np.float32(1e-6)), dtype=np.float32).ravel()


_KERNEL = np.array([[0.2], [0.6], [0.2]], dtype=np.float32)


def _chroma_steps() -> NDArray[np.int32]:
    away = np.abs(np.arange(256) - 128.0)
    steps = np.minimum(np.sqrt(away / 64) * (_STEPS / 2), _STEPS / 2 - 0.01)
    signed = np.where(np.arange(256) < 128, -steps, steps)
    return np.asarray(np.clip(np.floor(signed + _STEPS / 2), 0, _STEPS - 1), dtype=np.int32)


_LIGHT = (np.arange(256) // (256 // _STEPS)).astype(np.int32) * np.int32(_STEPS**2)
_GREEN = _chroma_steps() * np.int32(_STEPS)
_BLUE = _chroma_steps()
