"""Video sources: a file, a folder of images, a ROS 2 bag, a camera or a URL, all read as frames.

Read `source.py` first (the interface); `open.py` selects the implementation: `video_file.py`,
`image_folder.py`, `ros_bag.py` or `live_source.py`. `looped.py` replays a clip in a loop like a camera, paced
by `waiting_clock.py`. `realtime.py` drops frames to keep up; `capture.py` and `quiet_decoder.py` wrap the
parts of OpenCV they share. OpenCV is imported only when a source is opened.
"""

from __future__ import annotations

from visup.percepts.video.open import open_source
from visup.percepts.video.source import Ending, VideoSource

__all__ = ["Ending", "VideoSource", "open_source"]
