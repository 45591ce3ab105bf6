"""Qualitative calculi by their definitions, on boxes and points, without noise thresholds or memory.

`rules/relations` judges what a camera sees, with hysteresis; these are for data that is exact, for
comparisons with other tools, and for laws: each calculus has its composition table.

Read in this order: `rcc.py` (connection of boxes and its coarser forms), `allen.py` (intervals and
rectangles), `qtc.py` (how points move to each other), `positions.py` (directions, distances,
movement, three points), `composition.py`.
"""
