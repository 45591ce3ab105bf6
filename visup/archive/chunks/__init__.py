"""Long videos in chunks that are watched beside each other, and stitched to one run.

Read `spans.py` (where a video is cut), `region_matching.py` (who is who in two chunks), `seams.py` (where
one recording ends and the next begins) with `extending.py`, then `stitching.py` (what all of them perceived
as one recording, about which a mind reasons from beginning to end).
"""
