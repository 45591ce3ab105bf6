"""Moving objects over time: prediction, update, lifecycle.

Read `track.py` (what is remembered of an object, its prediction and update), `measurements.py` (what one
frame shows, and the likelihood of points under each track), `lifecycle.py` (initiate, update, confirm,
delete), `salience.py` (whether a candidate truly moves by itself), `merge_split.py` (parts of one object
merged, an object split from its occluder) and `warping.py` (dense comparison of warped images).
"""
