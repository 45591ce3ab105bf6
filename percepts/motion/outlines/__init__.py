"""Outlines of regions: from a probability map to a mask and its contour.

`outline_refinement.py` moves the border of a region to where tones, colours and motion change, the last by
`outline_motion.py`; `region_outline.py` cleans the mask, enlarges it to the size of the frame and
describes it.
"""
