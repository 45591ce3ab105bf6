"""Place, size, direction and number of objects as rules may ask for them."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import pytest

from tests.rules.predicates.test_certainty import mind_of
from visup.agent import Candidate, Mind, Presence
from visup.agent.model.errors import RuleError
from visup.rules.language.parser import parse_rules
from visup.rules.predicates.snapshot import Snapshot
from visup.rules.predicates.vocabulary import QUANTITIES


def quantity(mind: Mind, name: str, *words: str) -> list[float]:
    """The lower bounds of a quantity of all objects."""
    table = QUANTITIES[name].evaluate(Snapshot(mind), *words)
    return [float(v) for v in table[0].ravel()]


def test_position_and_size_are_those_of_the_boxes() -> None:
    mind = mind_of((200, 300, 150, 120), (500, 100, 40, 60))
    assert quantity(mind, "width") == [150, 40]
    assert quantity(mind, "height") == [120, 60]
    assert quantity(mind, "position_x") == pytest.approx([274.5, 519.5], abs=1.0)
    assert quantity(mind, "position_y") == pytest.approx([359.5, 129.5], abs=1.0)
    width, height = mind.frame_size
    assert quantity(mind, "area") == pytest.approx(
        [150 * 120 / width / height, 40 * 60 / width / height], rel=0.05
    )
    apart = quantity(mind, "centre_distance")
    assert apart[1] == pytest.approx(((519.5 - 274.5) ** 2 + 230**2) ** 0.5, abs=2.0)
    assert apart == [0.0, apart[1], apart[1], 0.0]


def test_overlap_is_intersection_over_union() -> None:
    mind = mind_of((100, 100, 100, 100), (150, 100, 100, 100))
    assert quantity(mind, "overlap") == pytest.approx([1.0, 1 / 3, 1 / 3, 1.0])


def test_depth_is_in_metres_within_its_deviation_and_is_never_compared_with_pixels() -> None:
    mind = mind_of((200, 300, 150, 120), (500, 100, 40, 60))
    mind = mind.with_objects(replace(mind.objects[1], depth=3.0, depth_sigma=0.25))
    assert quantity(mind, "depth") == [2.75, -inf]
    (rule,) = parse_rules('rule near(a): info when depth(a) < 250 cm leave 3 m say "{a}"')
    assert rule.when.right.base == 2.5  # type: ignore[union-attr]
    for wrong in (
        "depth(a) < 3 px",
        "width(a) < 3 cm",
        "depth(a) < 3 m/s",
        "rate(depth(a), 1 s) > 1 m",
    ):
        with pytest.raises(RuleError, match="is compared with"):
            parse_rules(f'rule near(a): info when {wrong} say "{{a}}"')


def test_quantities_of_hidden_or_resting_objects_are_unknown() -> None:
    mind = mind_of((200, 300, 150, 120), (500, 100, 40, 60))
    assert quantity(mind, "heading") == [-inf, -inf]
    hidden = replace(mind.objects[2], presence=Presence.HIDDEN)
    mind = mind.with_objects(hidden)
    assert quantity(mind, "width") == [150, -inf]
    assert quantity(mind, "overlap")[1] == -inf


@pytest.mark.parametrize(
    ("velocity", "degrees"), [((50, 0), 0), ((0, -50), 90), ((-50, 0), 180), ((0, 50), 270)]
)
def test_heading_is_the_direction_of_motion_in_the_image(
    velocity: tuple[float, float], degrees: float
) -> None:
    mind = mind_of((200, 300, 150, 120))
    region = replace(mind.objects[1].region, velocity=velocity)
    moving = mind.with_objects(replace(mind.objects[1], region=region))
    assert quantity(moving, "heading") == pytest.approx([degrees])


def test_objects_are_counted_and_those_of_a_name_bounded() -> None:
    mind = mind_of((200, 300, 150, 120), (500, 100, 40, 60))
    assert quantity(mind, "objects") == [2.0]
    named = replace(mind.objects[1], candidates=(Candidate("mug", 5.0, 0.9),))
    table = QUANTITIES["objects_named"].evaluate(Snapshot(mind.with_objects(named)), "mug")
    assert table.tolist() == [1.0, 2.0]
