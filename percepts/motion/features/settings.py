"""Settings of motion segmentation, with defaults for any video."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from visup.agent.model.errors import SettingsError


@dataclass(frozen=True, slots=True)
class MotionSettings:
    """Settings of `MotionSegmenter`; lengths are pixels of the working image.

    Attributes:
        work_size: Longer side of the image that is worked on; larger frames are reduced to it.
        cell: Spacing of motion constraints and of superpixels.
        lags_s: Baselines in time over which motion is measured, seconds; 0 means one frame.
        contrast: Difference of tone at which neighbouring superpixels count as unlike.
        noise: Least standard deviation of grey values that is assumed, grey levels.
        outlier: Mahalanobis distance at which a motion is no longer explained by a layer.
        min_area: Least area of a region, share of the image.
        persistence: Weight of what is carried from the last frame.
        evidence: Weight of one superpixel's evidence in a frame.
        background_bias: Weight of the belief that what shows nothing is background.
        confirm_s: How long a new region must be seen before it is reported, seconds.
        memory_s: How long a hidden region is remembered, seconds.
        max_regions: Most regions that are followed at once.
        least_blob: Least area of a silhouette where the camera rests, share of the image.
        missed_s: How long such a silhouette is missed before it is given up, seconds.
        learnt: Whether a learnt belief, in place of the tracks' own, says what moves while the camera does.
        foreground: The file of `visup train motion` that says so; what ships when None and `learnt`.
    """

    work_size: int = 512
    cell: int = 8
    lags_s: tuple[float, ...] = (0.0, 0.16, 0.48, 1.2, 2.4)
    contrast: float = 8.0
    noise: float = 1.0
    outlier: float = 3.5
    min_area: float = 0.0012
    persistence: float = 0.2
    evidence: float = 0.6
    background_bias: float = 0.02
    confirm_s: float = 0.4
    memory_s: float = 12.0
    max_regions: int = 32
    least_blob: float = 0.0003
    missed_s: float = 3.0
    learnt: bool = True
    foreground: Path | None = None

    def __post_init__(self) -> None:
        if self.work_size < 64:
            raise SettingsError("work_size is too small", expected="at least 64 pixels")
        if not 4 <= self.cell <= 64:
            raise SettingsError("cell is out of range", expected="4 to 64 pixels")
        if not self.lags_s or min(self.lags_s) < 0:
            raise SettingsError("lags_s must hold baselines in seconds", expected="0 or more each")
        if not 0 < self.min_area < 1:
            raise SettingsError("min_area is out of range", expected="a share between 0 and 1")
