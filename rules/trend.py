"""Trends of a distance: converging, keeping distance, diverging; in the image and in depth."""

from __future__ import annotations

import numpy as np

from visup.rules.geometry import Floats
from visup.rules.latch import UNKNOWN, Codes

CONVERGING, KEEPING, DIVERGING = 0, 1, 2
TREND_NAMES = ("converging", "keeping_distance", "diverging")


def wanted_trend(
    rate: Floats,
    sigma: Floats,
    before: Codes,
    pending: Codes,
    enter: float,
    leave: float,
    sigmas: tuple[float, float],
) -> Codes:
    """Which trend a rate of change stands for, with hysteresis.

    Args:
        rate: (P,) pixels per second; NaN unknown.
        sigma: (P,) its standard deviation.
        before: (P,) the trend believed so far.
        pending: (P,) the trend that wanted to be believed so far.
        enter: Rate that must be exceeded to enter a trend, pixels per second.
        leave: Rate below which it ends.
        sigmas: How many deviations the rate must also exceed to want to enter, and how many to go
            on wanting it. Deviations are themselves estimates and jump; one wide one in a row does
            not take back what was seen.

    Returns:
        (P,) codes; a rate between the thresholds leaves things as they are.
    """
    sign = np.where(rate < 0, np.int8(CONVERGING), np.int8(DIVERGING))
    least = np.where(pending == sign, sigmas[1], sigmas[0]) * sigma
    strong = np.abs(rate) > np.maximum(enter, least)
    weak = np.abs(rate) < leave
    # Below the entering threshold a new pair keeps its distance; one that moved is let go later.
    goes_on = (before == CONVERGING) & (rate <= 0)
    goes_on |= (before == DIVERGING) & (rate >= 0)
    weakly = np.where(goes_on & ~weak, before, np.int8(KEEPING))
    wanted: Codes = np.where(strong, sign, weakly)
    wanted[~np.isfinite(rate)] = UNKNOWN
    return wanted


def with_depth(image: Codes, depth: Codes) -> Codes:
    """Judge the trends of image distance and of depth difference together.

    Args:
        image: Codes of trends in the image.
        depth: Codes of trends of the depth difference, UNKNOWN where depth is not known.

    Returns:
        The image's trend where the depth agrees, keeps or is unknown; the depth's where the image
        keeps its distance; UNKNOWN where they contradict each other.
    """
    if (depth == UNKNOWN).all():
        return image
    joined = image.copy()
    by_depth = (image == KEEPING) & (depth != UNKNOWN)
    joined[by_depth] = depth[by_depth]
    against = (image == CONVERGING) & (depth == DIVERGING)
    against |= (image == DIVERGING) & (depth == CONVERGING)
    joined[against] = UNKNOWN
    return joined
