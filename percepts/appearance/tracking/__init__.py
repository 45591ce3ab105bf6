"""Finding taught things, and following them.

Read `track.py` (what is believed of a thing), `verification.py` and `detection.py` (finding it),
`points.py` and `following.py` (where it went), `segmentation.py` (which pixels are its own),
`learning.py` (how it looks now), then `tracker.py`, a frame's way through all of these.
"""
