"""Detects a camera that shakes in place: it moves from frame to frame without net displacement.

Such a camera shows no parallax: near objects at rest do not appear to move by themselves, as they do before a
travelling camera.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

DECAY = 0.9
"""Weight of the earlier steps in each frame: they fade over some ten frames, whatever the frame rate."""
MIN_PATH_PX = 5.0
"""Least path of the ground of a camera that shakes, working pixels."""
MAX_NET_SHARE = 0.5
"""Share of that path below which net motion counts as none: shaking in place 0.03 to 0.28, pans 0.6 to 1."""


@dataclass(frozen=True, slots=True)
class CameraSway:
    """Recent motion of the ground, exponentially weighted.

    Attributes:
        net: (x, y) sum of its steps, working pixels.
        path: Sum of their lengths, working pixels.
    """

    net: tuple[float, float] = (0.0, 0.0)
    path: float = 0.0

    @property
    def in_place(self) -> bool:
        """Whether the camera shakes without net displacement."""
        return self.path > MIN_PATH_PX and float(np.hypot(*self.net)) < MAX_NET_SHARE * self.path

    def after(self, step: tuple[float, float]) -> CameraSway:
        """The sway after one more step (x, y) of the ground, working pixels."""
        net = DECAY * self.net[0] + step[0], DECAY * self.net[1] + step[1]
        return CameraSway(net, DECAY * self.path + float(np.hypot(*step)))
