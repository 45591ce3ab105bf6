"""Video sources: a file, a folder of images, a camera or a URL, all read as frames.

Start at `base.py` (what a source is); `open.py` chooses the kind for what the user named.
OpenCV is imported only when a source is opened.
"""

from __future__ import annotations

from visup.percepts.video.base import Ending, Source
from visup.percepts.video.open import open_source

__all__ = ["Ending", "Source", "open_source"]
