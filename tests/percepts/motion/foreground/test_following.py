"""The learnt belief in the segmenter."""

from __future__ import annotations

import numpy as np

from tests.percepts.motion.clips import clip, texture
from visup.agent import Frame
from visup.percepts.motion import MotionSegmenter, MotionSettings

DISC = (lambda n: (60 + 3.0 * n, 80.0), 26.0, texture(2, (320, 480), 0, 255))


def test_what_moves_over_a_panning_ground_is_believed_and_reported_under_one_id() -> None:
    segmenter = MotionSegmenter()
    ids, fits = set(), []
    for shot in clip(texture(1, (320, 480)), lambda n: (20 + 1.5 * n, 30), [DISC], 16):
        regions = segmenter.step(shot.frame)
        ids |= {r.id for r in regions}
        mask = shot.masks[0]
        seen = np.zeros_like(mask)
        for r in regions:
            seen |= r.full_mask(shot.frame.size)
        fits.append((seen & mask).sum() / (seen | mask).sum())
    assert len(ids) == 1
    assert np.mean(fits[8:]) > 0.6
    assert segmenter.trace is not None
    belief = segmenter.trace.belief
    assert belief is not None
    assert 0 <= belief.min() < 0.1 < 0.9 < belief.max() <= 1


def test_a_camera_at_rest_is_known_before_objects_are_reported() -> None:
    segmenter, ids = MotionSegmenter(), set()
    for shot in clip(texture(1, (320, 480)), lambda n: (20, 30), [DISC], 16):
        ids |= {r.id for r in segmenter.step(shot.frame)}
    assert ids == {1}, "what the belief alone speaks for has taken no id"


def test_nothing_is_believed_where_that_is_not_wanted() -> None:
    segmenter = MotionSegmenter(MotionSettings(learnt=False))
    for n in range(3):
        segmenter.step(Frame(n, n / 25, np.full((96, 128, 3), 40 * n, np.uint8)))
    assert segmenter.trace is not None
    assert segmenter.trace.cues is None


def test_a_picture_without_any_structure_is_no_trouble() -> None:
    segmenter = MotionSegmenter()
    for n in range(4):
        assert segmenter.step(Frame(n, n / 25, np.full((96, 128, 3), 40 * n, np.uint8))) == ()


def test_while_the_camera_is_static_nothing_is_asked_of_the_belief_and_ids_stay() -> None:
    """A camera pans, rests, and pans again; the disc keeps its id."""
    segmenter, ids, asked = MotionSegmenter(), set(), []
    disc = (lambda n: (60 + 1.0 * n, 80.0), 26.0, texture(2, (320, 480), 0, 255))
    ground = texture(1, (320, 480))

    def camera(n: int) -> tuple[float, float]:
        return 20 + 0.8 * (min(n, 16) + max(n - 75, 0)), 30.0

    for n, shot in enumerate(clip(ground, camera, [disc], 92)):
        regions = segmenter.step(shot.frame)
        if n >= 12:
            ids |= {r.id for r in regions if (r.full_mask(shot.frame.size) & shot.masks[0]).any()}
        if n and segmenter.camera_static:
            assert segmenter.trace is not None
            asked.append(segmenter.trace.cues is not None)
    assert any(not a for a in asked)
    assert len(ids) == 1
