"""Showing things once: a user outlines them in one picture, and a model database keeps what was shown.

Read `lesson.py` (`visup.teach`, and what it tells), `outlines.py` (outlines as they are typed), `briefs.py`
(outlines in a file), `clip_frames.py` (the frame in which something is shown), `snapping.py` (outlines that
follow edges), `page/` (the window in the browser), and `learning.py` (`visup.learn`: further views from
recorded runs).
"""

from visup.teaching.learning import learn
from visup.teaching.lesson import teach

__all__ = ["learn", "teach"]
