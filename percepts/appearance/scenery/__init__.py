"""Camera motion and change detection in the scene behind the taught objects.

Read `points.py` (points tracked between two frames), `camera.py` (camera motion), `change.py` (what changed
lately), then `background_memory.py` (what changed since an object was seen elsewhere).
"""
