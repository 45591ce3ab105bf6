"""The report of a run: what was kept of it, annotated pictures and video, and one page to read.

Read in this order: `records.py` (what a report is made of), `data.py` (kept during a run),
`annotate.py` and `video.py` (pictures), `story.py`, `figures.py`, `html.py` (the page).
Import from those modules; this one stays empty, so that the command starts quickly.
"""
