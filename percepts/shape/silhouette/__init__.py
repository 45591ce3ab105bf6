"""Silhouettes in normal form, and their comparison without graphs.

Read `silhouette.py` (normalisation of a mask), `fragments.py` (joining islands of a mask), `area_overlap.py`
(area overlap at all rotations) and `height_functions.py` (point-by-point comparison of outlines).
"""
