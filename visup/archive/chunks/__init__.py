"""Long videos are processed in parallel chunks, which are stitched to one run.

Read `spans.py` (where a video is cut), `region_matching.py` (which regions of two chunks are the same),
`seams.py` (where to pass from one recording to the next) with `extending.py`, then `stitching.py` (the
observations of all chunks as one recording, over which reasoning runs from beginning to end).
"""
