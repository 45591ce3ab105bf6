"""Moving objects over time: prediction, update, lifecycle.

Read `track.py` (the state of an object), `measurements.py` (the measurements of one frame, and the likelihood
of points under each track), `lifecycle.py` (initiate, update, confirm, delete), `salience.py` (whether a
candidate moves independently), `merge_split.py` (parts of one object merged, an object split from its
occluder) and `warping.py` (dense comparison of warped images).
"""
