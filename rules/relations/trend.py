"""Trends of a distance: converging, keeping distance, diverging; in the image and in depth."""

CONVERGING, KEEPING, DIVERGING = 0, 1, 2
TREND_NAMES = ("converging", "keeping_distance", "diverging")
