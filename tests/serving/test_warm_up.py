"""What is compiled at set-up: also what only a moving camera needs."""

from __future__ import annotations

import pytest

from visup.agent import Frame, Region
from visup.percepts.motion.segmenter import MotionSegmenter
from visup.serving import warm_up


def test_the_warm_up_includes_a_panning_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[tuple[int, int]] = []
    moves: list[bool] = []

    class Watched(MotionSegmenter):
        def step(self, frame: Frame) -> tuple[Region, ...]:  # type: ignore[override]
            regions = super().step(frame)
            sizes.append(frame.size)
            moves.append(self._foreground.moves)
            return regions

    monkeypatch.setattr(warm_up, "MotionSegmenter", Watched)
    warm_up.warm_up_moving_camera()
    assert len(sizes) == warm_up.PAN_FRAMES
    assert len(set(sizes)) == 1, "another size would begin anew"
    assert all(moves[1:])
