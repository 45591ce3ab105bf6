"""The segmenter of bodies in front of a dark sky, which refines the regions of motion segmentation."""

from __future__ import annotations

import numpy as np

from visup.agent import Frame, Region
from visup.percepts.motion.dark_sky.body import Point
from visup.percepts.motion.dark_sky.reporting import (
    bodies_with_ids,
    regions_of_bodies,
    reported_regions,
)
from visup.percepts.motion.dark_sky.sky import bright_components, brightness
from visup.percepts.motion.dark_sky.tracking import Bodies, SkyFrame, track_bodies
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.tracks.id_allocator import IdAllocator
from visup.percepts.motion.tracks.measurements import FrameMeasurements, min_region_area


class DarkSkySegmenter:
    """Replaces moving regions by the bodies in front of a dark sky that they lie on; one per video.

    Also reports bodies without a moving region, once they have drifted relative to the ground, or stand alone
    (`SkyBody.is_fully_visible`).
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
        """The regions to report for a frame; the given ones while there is no dark sky.

        Args:
            frame: The next frame.
            scene: Its measurements.
            regions: Moving regions.
            ids: Allocates public ids.
            settings: Settings of the segmenter, for the least area of a region.

        Returns:
            The regions, sorted by id.
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
        """The regions to report for a frame; `step` with the measurements it needs given directly.

        Args:
            frame: The next frame.
            regions: Moving regions.
            shift: (x, y) displacement of the ground, at the centre of the image, from this frame to the
                previous one (backwards), frame pixels.
            least: Least area of a body, frame pixels.
            ids: Allocates public ids.

        Returns:
            The regions, sorted by id.
        """
        self._ground = self._ground[0] - shift[0], self._ground[1] - shift[1]
        tone = brightness(frame.image)
        found = bright_components(tone, least)
        if found is None:
            self._bodies = ()
            return regions
        here = SkyFrame(tone, found, frame.time, self._ground)
        bodies = track_bodies(self._bodies, here, self._last_key + 1)
        self._last_key = max([self._last_key, *(b.key for b in bodies)])
        members = regions_of_bodies(bodies, regions, found.bright, frame.time)
        diagonal = float(np.hypot(*frame.size))
        self._bodies = bodies_with_ids(bodies, members, ids, diagonal)
        return reported_regions(self._bodies, members, regions, frame.time)
