"""Health of the camera's image: faults that must not be mistaken for motion.

`behaviour.py` reports one `Health` per frame, from: `image_quality.py` (a single image: dark, saturated,
noisy, broken), `standstill.py` (all or a large part of the image stops or is covered at one moment),
`frozen_under_noise.py` (the same under fresh noise), `repeated_frames.py` and `frame_timing.py` (frames
repeated or missing). `settings.py` holds the thresholds.
"""

from visup.percepts.health.behaviour import HealthBehaviour
from visup.percepts.health.settings import HealthSettings

__all__ = ["HealthBehaviour", "HealthSettings"]
