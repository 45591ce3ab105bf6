"""Geometry of outlines and fits over time, shared by all reasoners.

Read in this order: `regions.py` (boxes, masks, support functions), `rings.py` (outlines of regions in several
parts), `outlines.py` (cached computations per region and pair), `borders.py` (how much of one outline lies
along another) and `pairs.py` (pairs of objects as one flat list). `_outlines_jit.py` and `_fit_jit.py` hold
the compiled loops: nearest points and iterated closest points; Theil-Sen lines and velocities of outlines.
`_covered_motion_jit.py` tells the motion of bodies that are covered in part, `_recent_motion_jit.py` that of
now.
"""
