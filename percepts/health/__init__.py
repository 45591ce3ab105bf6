"""Health of the camera's image: faults that must never be mistaken for motion.

`behaviour.py` reports one `Health` for each frame. What it rests on: `image_quality.py` (one image by
itself: dark, saturated, noisy, broken), `standstill.py` (all or a large part of the image stands still or
is covered from one moment on), `frozen_under_noise.py` (the same under fresh noise), `repeated_frames.py`
and `frame_timing.py` (frames repeated or missing). `settings.py` holds the thresholds.
"""

from visup.percepts.health.behaviour import HealthBehaviour
from visup.percepts.health.settings import HealthSettings

__all__ = ["HealthBehaviour", "HealthSettings"]
