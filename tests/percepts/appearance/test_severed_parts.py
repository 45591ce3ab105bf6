"""Laws of parts of an object that are joined outside of the image."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import HEIGHT, WIDTH, Mask, picture, shown
from visup.agent import Directive, Frame, Hypothesis, Observation, Percept, Region
from visup.percepts.appearance.behaviour import AppearanceBehaviour
from visup.percepts.appearance.models.appearance_model import view_models
from visup.percepts.appearance.models.scene import prepare_scene
from visup.percepts.appearance.output.severed_parts import (
    MIN_SUPPORT,
    Support,
    cut_ends,
    joined,
    update_support,
    with_parts,
)
from visup.percepts.motion.behaviour import MotionBehaviour
from visup.percepts.motion.outlines.region_outline import describe_mask

Places = Mapping[str, tuple[int, int]]
(PART,) = view_models(shown({"part": (40, 60)}, "part"))
SIZE = (WIDTH, HEIGHT)
# Two parts of one colour that the upper border cuts.
TOP: Places = {"part": (60, -8), "twin": (110, -6)}


def region(number: int, mask: Mask, velocity: tuple[float, float] = (0.0, 0.0)) -> Region:
    return describe_mask(mask, (0, 0), SIZE).region(number, velocity, 1.0, 0.9)


def supported(
    places: Places, frames: int, before: Support | None = None, other: str = "twin"
) -> dict[tuple[int, int], int]:
    """What is known after some frames in which the part is taught, and the other thing moves."""
    image, masks = picture(places)
    thing, piece = region(1, masks["part"]), region(2, masks[other])
    found = dict(before or {})
    for _ in range(frames):
        scene = prepare_scene(image, 0.0)
        found = update_support(found, [(thing, PART.appearance)], [piece], scene)
    return found


def test_a_piece_of_its_colours_at_the_same_border_is_a_part() -> None:
    assert joined(supported(TOP, MIN_SUPPORT)) == [(1, 2)]
    assert joined(supported(TOP, MIN_SUPPORT - 1)) == []


@pytest.mark.parametrize(
    ("places", "other"),
    [
        ({"part": (60, -8), "tray": (110, -6)}, "tray"),  # other colours
        ({"part": (60, -8), "twin": (110, 20)}, "twin"),  # within the image
        ({"part": (60, -8), "twin": (190, -6)}, "twin"),  # too far away
        ({"part": (60, -8), "twin": (110, HEIGHT - 12)}, "twin"),  # at another border
    ],
)
def test_what_is_not_joined_outside_is_none(places: Places, other: str) -> None:
    assert joined(supported(places, 2 * MIN_SUPPORT, other=other)) == []


def test_a_part_stays_one_within_the_image_and_no_longer_than_its_region() -> None:
    found = supported(TOP, 2 * MIN_SUPPORT)
    inside = supported({"part": (60, -8), "twin": (110, 20)}, 20, found)
    assert joined(inside) == [(1, 2)]
    image, masks = picture(TOP)
    gone = update_support(
        inside, [(region(1, masks["part"]), PART.appearance)], [], prepare_scene(image, 0.0)
    )
    assert gone == {}


def test_contrary_colours_end_it() -> None:
    found = supported(TOP, 10 * MIN_SUPPORT)
    assert joined(supported({"part": (60, -8), "tray": (110, -6)}, MIN_SUPPORT, found, "tray")) == [
        (1, 2)
    ]
    assert supported({"part": (60, -8), "tray": (110, -6)}, 2 * MIN_SUPPORT, found, "tray") == {}


boxes = st.tuples(
    st.integers(0, WIDTH - 1), st.integers(0, HEIGHT - 1), st.integers(1, 80), st.integers(1, 80)
)


def filled(box: tuple[int, int, int, int]) -> Mask:
    mask = np.zeros((HEIGHT, WIDTH), dtype=bool)
    x, y, w, h = box
    mask[y : y + h, x : x + w] = True
    return mask


@settings(max_examples=40, deadline=None)
@given(st.lists(boxes, min_size=1, max_size=3))
def test_the_whole_is_the_union_of_its_parts(drawn: list[tuple[int, int, int, int]]) -> None:
    masks = [filled(b) for b in drawn]
    pieces = [region(n, m, (10.0 * n, -5.0)) for n, m in enumerate(masks, 1)]
    whole = with_parts(pieces[0], pieces[1:], SIZE)
    union = np.logical_or.reduce(masks)
    assert np.array_equal(whole.full_mask(SIZE), union)
    assert whole.id == 1
    assert whole.area == np.count_nonzero(union)
    slowest, fastest = pieces[0].velocity[0], pieces[-1].velocity[0]
    assert slowest - 1e-9 <= whole.velocity[0] <= fastest + 1e-9
    assert whole.velocity[1] == pytest.approx(-5.0)


@settings(max_examples=40, deadline=None)
@given(boxes, boxes)
def test_cut_ends_are_the_outermost_pixels_at_each_border(
    first: tuple[int, int, int, int], second: tuple[int, int, int, int]
) -> None:
    mask = filled(first) | filled(second)
    lines = {"top": mask[0], "bottom": mask[-1], "left": mask[:, 0], "right": mask[:, -1]}
    expected = {
        s: (int(w.min()), int(w.max())) for s, x in lines.items() if len(w := x.nonzero()[0])
    }
    assert cut_ends(region(1, mask), SIZE) == expected


class GivenMotion(MotionBehaviour):
    """Reports the regions that it is given, whatever the picture shows."""

    def __init__(self) -> None:
        super().__init__()
        self.regions: Sequence[Region] = ()

    def perceive(
        self, frame: Frame, observation: Observation, directives: Sequence[Directive]
    ) -> Iterable[Percept]:
        return [Percept("region", r, frame.time, "motion") for r in self.regions]


def perceived(behaviour: AppearanceBehaviour, number: int, places: Places) -> list[Percept]:
    frame = Frame(number, number / 15.0, picture(places, seed=number)[0])
    seen = Observation(number, frame.time, frame.size, ())
    return list(behaviour.perceive(frame, seen, ()))


def test_an_object_is_reported_with_its_piece_and_the_piece_is_not() -> None:
    motion = GivenMotion()
    behaviour = AppearanceBehaviour(shown({"part": (40, 60)}, "part"), motion)
    start: Places = {"part": (60, 40)}
    rises = [{"part": (60, 40 - 6 * k), "twin": (110, -6)} for k in range(9)]
    course = [start, *rises, *[rises[-1]] * MIN_SUPPORT]
    for number, places in enumerate(course):
        masks = picture(places)[1]
        motion.regions = [region(9, masks["twin"])] if "twin" in masks else []
        regions = [
            p.value for p in perceived(behaviour, number, places) if isinstance(p.value, Region)
        ]
    assert len(regions) == 1
    both = masks["part"] | masks["twin"]
    seen = regions[0].full_mask(SIZE)
    assert np.count_nonzero(seen & both) > 0.8 * np.count_nonzero(seen | both)


def test_the_moving_region_of_an_object_is_reported_while_the_object_is_not_recognised() -> None:
    motion = GivenMotion()
    behaviour = AppearanceBehaviour(shown({"part": (40, 60)}, "part"), motion)
    there: Places = {"part": (60, 60)}
    body = region(7, picture(there)[1]["part"])
    motion.regions = [body]
    percepts = [p for n in range(6) for p in perceived(behaviour, n, there)]
    assert {p.value.region_id for p in percepts if isinstance(p.value, Hypothesis)} == {7}
    hidden: Places = {**there, "tray": (45, 50)}  # something else is at its place
    for number in range(6, 14):
        percepts = perceived(behaviour, number, hidden)
    assert [p for p in percepts if isinstance(p.value, Hypothesis)] == []
    assert [p.value for p in percepts if isinstance(p.value, Region)] == [body]
