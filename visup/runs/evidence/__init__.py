"""Evidence of alerts: for each a picture with the beliefs, and a clip from before to after it.

Read `frame_ring.py` (recent frames), `clip_spool.py` (a clip in progress, which survives a kill) and
`keeper.py` (saves the evidence of each alert).
"""
