"""Intermediate results of the segmenter for one frame, for inspection."""

from __future__ import annotations

from dataclasses import dataclass

from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground.cues import FrameCues
from visup.percepts.motion.tracks.measurements import FrameMeasurements
from visup.percepts.motion.tracks.track import Track


@dataclass(frozen=True, slots=True, eq=False)
class SegmentationTrace:
    """The intermediate results of one step; read-only.

    Attributes:
        scene: The measurements of the frame.
        tracks: The tracks after the step, reported or not.
        keys: Keys of the K tracks that superpixels were assigned to; some may have ended since.
        posterior: (count, K + 2) float32, share of background, tracks and unknown motion in each
            superpixel.
        cues: The foreground cues of each superpixel; None when the foreground model is not used.
        belief: (count,) float32, probability that each superpixel moves independently; or None.
    """

    scene: FrameMeasurements
    tracks: tuple[Track, ...]
    keys: tuple[int, ...]
    posterior: Floats
    cues: FrameCues | None = None
    belief: Floats | None = None
