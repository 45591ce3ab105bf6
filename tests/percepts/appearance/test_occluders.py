"""What lies before another thing is not that thing's, if it has not its colours."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.percepts.appearance.scenes import SIZES, picture, thing
from tests.percepts.appearance.test_bodies import TOOL, TRAY, scene
from visup.percepts.appearance.models.blob import Blob, overlap_of_smaller, without
from visup.percepts.appearance.models.pose import PatchPose
from visup.percepts.appearance.tracking.redetection import RedetectionCandidate, assign_candidates
from visup.percepts.appearance.tracking.verification import Match

AT, SIDE = (60, 60), 14


def full(x: int, y: int, width: int, height: int) -> Blob:
    return Blob((x, y, x + width, y + height), np.ones((height, width), dtype=bool))


@pytest.mark.parametrize(("put_before", "known"), [(True, True), (True, False), (False, True)])
def test_a_patch_within_another_thing_is_taken_where_it_lies_before_it(
    put_before: bool, known: bool
) -> None:
    image, _ = picture({"tray": AT})
    x, y = AT[0] + 25, AT[1] + 13
    if put_before:
        image[y : y + SIDE, x : x + SIDE] = thing("tool")[4 : 4 + SIDE, 4 : 4 + SIDE]
    match = Match(PatchPose(x + SIDE / 2, y + SIDE / 2, 0.3), 0.8, 0.8)
    seen = full(x, y, SIDE, SIDE) if known else None
    place = RedetectionCandidate("tool", 0, TOOL.appearance, match, 0.8, seen)
    tray = full(*AT, *SIZES["tray"]), TRAY.appearance
    assert bool(assign_candidates(scene(image), [place], [tray])) is (put_before and known)


BLOBS = st.builds(full, *(st.integers(0, 30) for _ in "xy"), *(st.integers(1, 20) for _ in "wh"))


@given(BLOBS, BLOBS)
def test_a_blob_without_another_has_nothing_of_it_and_all_else(a: Blob, b: Blob) -> None:
    left = without(a, b)
    shared = a.area - left.area
    assert overlap_of_smaller(left, b) == 0.0
    assert shared == pytest.approx(overlap_of_smaller(a, b) * min(a.area, b.area))
    assert a.mask.all()
