"""Teaching: a user outlines objects in one picture, and a model database stores them.

Read `outline_teaching.py` (`visup.teach`, and what it reports), `outlines.py` (outlines on the command line),
`briefs.py` (outlines in a file), `clip_frames.py` (the frames of a clip), `snapping.py` (outlines that
follow edges), `page/` (the window in the browser), and `learning.py` (`visup.learn`: further views from
recorded runs).
"""

from visup.teaching.learning import learn
from visup.teaching.outline_teaching import teach

__all__ = ["learn", "teach"]
