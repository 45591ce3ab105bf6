"""Detection and tracking of taught objects.

Read `track.py` (the state of an object), `verification.py` and `detection.py` (detection),
`short_term_tracking.py` (from frame to frame), `segmentation.py` (assignment of pixels), `adaptation.py` (of
the appearance), `drift_correction.py` and `redetection.py`, then `tracker.py`, which runs all of these on a
frame.
"""
