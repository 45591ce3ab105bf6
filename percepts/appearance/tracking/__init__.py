"""Detection and tracking of taught objects.

Read `track.py` (the state of an object), `verification.py` and `detection.py` (detection), `following.py`
(frame-to-frame tracking), `segmentation.py` (assignment of pixels), `learning.py` (adaptation of the
appearance), then `tracker.py`, which runs all of these on a frame.
"""
