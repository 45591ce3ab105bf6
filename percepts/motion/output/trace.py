"""What the segmenter made of a frame, for those who want to see how it came to its regions."""

from __future__ import annotations

from dataclasses import dataclass

from visup.percepts.motion.features.work_image import Floats
from visup.percepts.motion.foreground.cues import FrameCues
from visup.percepts.motion.tracks.measurements import FrameMeasurements
from visup.percepts.motion.tracks.track import Track


@dataclass(frozen=True, slots=True, eq=False)
class SegmentationTrace:
    """The workings of one step; for reading only.

    Attributes:
        scene: What was measured.
        tracks: The tracks after the step, reported or not.
        keys: Of the K tracks that superpixels were shared among; some may have ended since.
        posterior: (count, K + 2) float32, share of background, tracks and unknown motion in each
            superpixel.
        cues: What the frame shows of each superpixel, by which foreground is believed; None when
            that is not done.
        belief: (count,) float32, probability that each superpixel shows something that moves by itself; or
            None.
    """

    scene: FrameMeasurements
    tracks: tuple[Track, ...]
    keys: tuple[int, ...]
    posterior: Floats
    cues: FrameCues | None = None
    belief: Floats | None = None
