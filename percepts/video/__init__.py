"""Video sources: a file, a folder of images, a ROS 2 bag, a camera or a URL, all read as frames.

Read `source.py` first (what a source is); `open.py` chooses the kind for what the user named:
`video_file.py`, `image_folder.py`, `ros_bag.py` or `live_source.py`. `looped.py` plays a clip again and
again as a camera would, by `waiting_clock.py`. `realtime.py` drops frames to keep pace; `capture.py` and
`quiet_decoder.py` are the little of OpenCV that they share. OpenCV is imported only when a source is opened.
"""

from __future__ import annotations

from visup.percepts.video.open import open_source
from visup.percepts.video.source import Ending, VideoSource

__all__ = ["Ending", "VideoSource", "open_source"]
