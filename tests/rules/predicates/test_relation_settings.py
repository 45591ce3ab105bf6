"""Predicates and motion onset use the run's settings of relations, not the defaults."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest

from tests.rules.runs import think
from tests.rules.scenes import Rect, box_region, seen
from visup.agent import Mind, Observation
from visup.rules.formula.truth import NO, YES
from visup.rules.predicates.image_quantities import heading
from visup.rules.predicates.motion import moving
from visup.rules.predicates.outline_quantities import shared_outline
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.reasoners import ReasonerSettings, default_reasoners
from visup.rules.relations.kinematics import RelationSettings
from visup.rules.relations.reasoner import relation_settings
from visup.rules.relations.thresholds import ThresholdSettings
from visup.tasks.verification.motion_onset import moving_bodies
from visup.tasks.verification.new_trends import new_trend

FPS = 25.0
SETS_OUT = 40
"""Frame in which the first box starts to move towards the second one."""


def boxes(frame: int, speed: float) -> tuple[Rect, Rect]:
    """A box that starts to move to the right, by so many pixels a frame, and one at rest."""
    return (100 + speed * max(0, frame - SETS_OUT), 200, 60, 60), (420, 200, 60, 60)


def last_mind(settings: RelationSettings, speed: float = 3.0, frames: int = 60) -> Mind:
    reasoners = default_reasoners(ReasonerSettings(relations=settings))

    def observations() -> Iterator[Observation]:
        for frame in range(frames):
            first, second = boxes(frame, speed)
            moving_box, resting_box = box_region(1, first), box_region(2, second)
            assert moving_box is not None
            if frame > SETS_OUT:
                moving_box = replace(moving_box, velocity=(speed * FPS, 0.0))
            yield seen(frame, [moving_box, resting_box], FPS)

    return list(think((*reasoners.update, *reasoners.cogitate), observations()))[-1].mind


def test_the_settings_of_a_run_are_those_of_its_reasoner() -> None:
    settings = RelationSettings(still_speed=0.2)
    assert relation_settings(last_mind(settings)) == settings
    assert relation_settings(Mind()) == RelationSettings()


@pytest.mark.parametrize(("still_speed", "moves"), [(0.0025, True), (0.2, False)])
def test_the_speed_limit_of_motion_is_that_of_the_run(still_speed: float, moves: bool) -> None:
    """75 px/s are 0.09 image diagonals per second."""
    mind = last_mind(RelationSettings(still_speed=still_speed))
    facts = Snapshot(mind)
    assert moving(facts).tolist() == [YES if moves else NO, NO]
    assert (heading(facts)[0, 0] == pytest.approx(0.0)) == moves


def test_the_speed_limit_of_motion_onset_is_that_of_the_run() -> None:
    """The body is slow: the change of its outline alone does not show its motion."""
    slow = 0.8
    assert 1 in moving_bodies(last_mind(RelationSettings(), slow, 80))
    assert 1 not in moving_bodies(last_mind(RelationSettings(still_speed=0.2), slow, 80))


def test_the_noise_of_new_trends_is_that_of_the_run() -> None:
    frames = SETS_OUT + 12
    noisy = RelationSettings(thresholds=ThresholdSettings(noise_px=40.0))
    assert new_trend(last_mind(RelationSettings(), 4.0, frames), "converging", (1, 2)) is not None
    assert new_trend(last_mind(noisy, 4.0, frames), "converging", (1, 2)) is None


@pytest.mark.parametrize(("touch_enter", "shares"), [(0.0035, False), (0.05, True)])
def test_outlines_lie_along_each_other_within_the_touching_gap_of_the_run(
    touch_enter: float, shares: bool
) -> None:
    """The boxes are 20 px apart, 0.025 image diagonals, when the first one has come near."""
    settings = RelationSettings(touch_enter=touch_enter)
    mind = last_mind(settings, 4.0, SETS_OUT + 61)
    assert (shared_outline(Snapshot(mind))[0, 0, 1] > 0.1) == shares
