"""The segmenter of bodies before a dark sky, which goes over the regions of motion."""

from __future__ import annotations

import numpy as np

from visup.agent import Frame, Region
from visup.percepts.motion.dark_sky.body import Point
from visup.percepts.motion.dark_sky.reporting import bodies_with_ids, members_of, regions_of
from visup.percepts.motion.dark_sky.sky import bright_components, brightness
from visup.percepts.motion.dark_sky.tracking import Bodies, SkyFrame, follow
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.tracks.id_allocator import IdAllocator
from visup.percepts.motion.tracks.measurements import FrameMeasurements, min_region_area


class DarkSkySegmenter:
    """Gives regions the outlines of bodies that stand out from a dark sky; one per video.

    Also reports such bodies without a region, once they have drifted against the ground, or stand alone.
    """

    def __init__(self) -> None:
        self._bodies: Bodies = ()
        self._ground: Point = (0.0, 0.0)
        self._last_key = 0

    def step(
        self,
        frame: Frame,
        scene: FrameMeasurements,
        regions: tuple[Region, ...],
        ids: IdAllocator,
        settings: MotionSettings,
    ) -> tuple[Region, ...]:
        """The regions of one frame; as they are while there is no dark sky.

        Args:
            frame: The next frame.
            scene: The frame as measured.
            regions: Moving regions.
            ids: Gives new ids.
            settings: Give the least area.

        Returns:
            The regions, by id.
        """
        height, width = scene.image.shape
        x, y = scene.measured[0].background.models[-1].shift((width / 2, height / 2))
        shift = x / scene.image.scale, y / scene.image.scale
        least = min_region_area(scene, settings) / scene.image.scale**2
        return self.outlined(frame, regions, shift, least, ids)

    def outlined(
        self,
        frame: Frame,
        regions: tuple[Region, ...],
        shift: Point,
        least: float,
        ids: IdAllocator,
    ) -> tuple[Region, ...]:
        """The regions of one frame, as `step` returns them.

        Args:
            frame: The next frame.
            regions: Moving regions.
            shift: (x, y) from a point of the ground in the middle of this frame to where it was in the last
                one, frame pixels.
            least: Least area, frame pixels.
            ids: Gives new ids.

        Returns:
            The regions, by id.
        """
        self._ground = self._ground[0] - shift[0], self._ground[1] - shift[1]
        tone = brightness(frame.image)
        found = bright_components(tone, least)
        if found is None:
            self._bodies = ()
            return regions
        here = SkyFrame(tone, found, frame.time, self._ground)
        bodies = follow(self._bodies, here, self._last_key + 1)
        self._last_key = max([self._last_key, *(b.key for b in bodies)])
        members = members_of(bodies, regions, found.bright, frame.time)
        diagonal = float(np.hypot(*frame.size))
        self._bodies = bodies_with_ids(bodies, members, ids, diagonal)
        return regions_of(self._bodies, members, regions, frame.time)
