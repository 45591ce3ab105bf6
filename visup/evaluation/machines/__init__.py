"""Evaluation on machines at work, rendered and real: taught from a brief, watched, and scored.

Read in this order: `clips.py` (brief and truth of a clip), `recorder.py` (the reports), `scores.py` (figures
as pure functions), `runner.py` (all of it; `visup.teaching` does the teaching). `mask_regions.py` replaces
perception by ground-truth masks, `csrt.py` is the baseline.
"""
