"""Silhouettes in normal form, and what is compared of them without a graph.

Read `silhouette.py` (a mask brought to normal form), `fragments.py` (which islands of a mask belong
together), `area_overlap.py` (areas laid on each other at all rotations) and `height_functions.py` (outlines
compared point by point).
"""
