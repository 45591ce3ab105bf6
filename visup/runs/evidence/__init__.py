"""Evidence of alerts: for each a picture with what was believed, and a clip from before to after it.

Read `frame_ring.py` (what was seen a moment ago), `clip_spool.py` (a clip while it is made, which outlives a
kill) and `keeper.py` (what is kept of which alert, and under which names).
"""
