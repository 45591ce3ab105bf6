"""How the motion segmenter understood a frame, drawn for people.

`panels.py` draws four panels (constraints, layers, labels, regions); `marks.py` the arrows, hatching and
headings on them.
"""
