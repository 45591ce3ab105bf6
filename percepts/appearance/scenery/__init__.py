"""What is behind the taught objects: the motion of the camera, and what has changed.

Read `points.py` (points tracked between two frames), `camera.py` (camera motion), `change.py` (what changed
lately), then `background_memory.py` (what changed since an object was seen elsewhere).
"""
