"""Qualitative calculi by their definitions, on boxes and points, without noise thresholds or memory.

`rules/relations` evaluates camera observations with hysteresis; these are for exact data, for comparisons
with other tools, and for laws: each calculus has its composition table.

Read in this order: `rcc.py` (connection of boxes and its coarser forms), `allen.py` (intervals and
rectangles), `qtc.py` (relative motion of points), `positions.py` (directions, distances,
movement, three points), `composition.py`.
"""
