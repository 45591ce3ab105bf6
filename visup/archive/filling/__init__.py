"""Filling a lake with the runs of many clips, on many workers.

Read `clips.py` (what is to be watched) with `stores.py` (what is not on this machine), `plan.py` (what is
missing), `watching.py` (one clip, from video to committed rows), `pieces.py` (what one worker does at a
time), `attempts.py` (clips that end their workers), `pool.py` (pieces on workers) and `filling.py` (all of
it together).
"""
