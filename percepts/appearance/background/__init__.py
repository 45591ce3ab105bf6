"""Camera motion and change detection in the scene behind the taught objects.

Read `point_tracking.py` (points tracked between two frames), `camera_motion.py`, `change_map.py` (what
changed recently), then `background_memory.py` (what changed since an object was seen elsewhere).
"""
