"""Machines at work, rendered and real: taught from a brief, watched, and scored; and a baseline beside it.

Read in this order: `clips.py` (what is told of a clip, and its truth), `recorder.py` (what was reported),
`scores.py` (figures as pure functions), `runner.py` (all of it; `visup.teaching` does the teaching).
`mask_regions.py` sees by the masks of a world in place of eyes, `csrt.py` is the baseline.
"""
