"""Visualises the internals of the motion segmenter for a frame.

`panels.py` draws four panels (constraints, layers, labels, regions), `marks.py` their arrows, hatching and
headings.
"""
