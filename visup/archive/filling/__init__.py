"""Filling a lake with the runs of many clips, on many workers.

Read `clips.py` (the sources) with `stores.py` (sources in object stores), `plan.py` (which runs are missing),
`watching.py` (one clip, from video to committed rows), `piece_queue.py` (units of work), `attempts.py` (clips
that crash their workers), `pool.py` (pieces on workers) and `filling.py` (all of it together).
"""
