"""Segmentation and tracking of bright bodies in front of a dark sky (black space), moving or not.

Read `sky.py` (detection of the sky, and of the bright components in front of it), `body.py` (the state of a
tracked body), `splitting.py` (division of a component among bodies that touch in the image), `tracking.py`
(data association from frame to frame), `reporting.py` (gives moving regions the outlines of bodies, and
reports bodies that drift slowly), then `sky_segmenter.py`, which runs all of these on a frame.

Names used throughout: `tone` is the brightness of pixels, and the *ground* is the background whose motion
shows that of the camera.
"""
