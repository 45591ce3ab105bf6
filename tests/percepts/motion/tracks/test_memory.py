from __future__ import annotations

import numpy as np
import pytest

from tests.percepts.motion.clips import FPS, Shot, clip, texture
from visup.percepts.motion.features.settings import MotionSettings
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.percepts.motion.tracks.track_prediction import PATH_S

PERIOD = 25


def passing(camera: float, frames: int) -> list[Shot]:
    """One disc stays, going to and fro, while others pass, one after another."""
    stays = (lambda n: (120 + 40 * np.sin(n / 15), 40.0), 18.0, texture(2, (320, 480), 0, 255))
    others = (lambda n: (-20 + 12.0 * (n % PERIOD), 120.0), 16.0, texture(3, (320, 480), 0, 255))
    return list(
        clip(texture(1, (320, 480)), lambda n: (20 + camera * n, 30), [stays, others], frames)
    )


def kept(camera: float, frames: int) -> MotionSegmenter:
    segmenter = MotionSegmenter(MotionSettings(memory_s=1.0))
    for shot in passing(camera, frames):
        segmenter.step(shot.frame)
    return segmenter


@pytest.mark.parametrize("camera", [0.0, 0.4])
def test_what_is_kept_is_bounded_by_what_lives(camera: float) -> None:
    segmenter = kept(camera, 90)
    tracks = segmenter._tracks
    keys = {t.key for t in tracks}
    lags = max(segmenter.settings.lags_s) * 1.1 * FPS + 2
    assert segmenter._last_key > len(tracks) + 3  # enough has come and gone
    assert len(segmenter._history) <= lags
    assert len(segmenter._camera) <= lags
    for t in tracks:
        assert {*t.separate_s, *t.merge_votes} <= keys
        assert len(t.path) <= PATH_S * FPS + 2
        assert all(len(m.rates) <= lags for m in t.motions)
    fusion = segmenter._static._fusion
    living = set(fusion._last)
    newest = max(fusion._last.values())
    assert all(newest - last <= segmenter.settings.memory_s for last in fusion._last.values())
    assert {*fusion._alias, *fusion._predating} <= living
    assert fusion._reported_without_blob <= living | set(fusion._alias.values())
