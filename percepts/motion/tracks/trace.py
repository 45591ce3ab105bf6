"""What the segmenter made of a frame, for those who want to see how it came to its regions."""

from __future__ import annotations

from dataclasses import dataclass

from visup.percepts.motion.features.image import Floats
from visup.percepts.motion.tracks.scene import Scene
from visup.percepts.motion.tracks.tracking import Track


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """The workings of one step; for reading only.

    Attributes:
        scene: What was measured.
        tracks: The tracks after the step, reported or not.
        keys: Of the K tracks that superpixels were shared among; some may have ended since.
        posterior: (count, K + 2) float32, share of background, tracks and unknown motion in each
            superpixel.
    """

    scene: Scene
    tracks: tuple[Track, ...]
    keys: tuple[int, ...]
    posterior: Floats
