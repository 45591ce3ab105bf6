"""Seeing motion: constraints, layers, the dense posterior, contours and tracks (paper, section 3).

Read `segmenter.py` first: it is the loop; each of its steps lives in a module of its own name.
"""
