from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Coupling, Mind, Observation, Region, Relation, Report, ReportState, Truth


@given(st.integers(-6, 14), st.integers(-6, 14), st.integers(1, 4), st.integers(1, 4))
def test_a_full_mask_has_the_crop_at_its_position_only(x: int, y: int, w: int, h: int) -> None:
    crop = np.random.default_rng(abs(x + 7 * y)).random((h, w)) > 0.5
    region = Region(1, (x, y, w, h), crop, np.zeros((0, 2), np.float32), (0, 0), float(crop.sum()))
    full = region.full_mask((12, 10))
    assert full.shape == (10, 12)
    pixels = {(int(r) + y, int(c) + x) for r, c in np.argwhere(crop)}
    assert {(int(r), int(c)) for r, c in np.argwhere(full)} == {
        (r, c) for r, c in pixels if 0 <= r < 10 and 0 <= c < 12
    }


def test_observing_nothing_differs_from_not_observing() -> None:
    looked = Report("eye", ReportState.RAN, ("region",))
    rested = Report("eye", ReportState.RESTED, ("region",))
    assert Observation(0, 0.0, (1, 1), (looked,)).observed("region")
    assert not Observation(0, 0.0, (1, 1), (rested,)).observed("region")


def test_relations_and_couplings_are_found_whatever_the_order_of_objects() -> None:
    relation = Relation("touching", (1, 2), Truth.TRUE, 0.0)
    mind = Mind(relations=(relation,), couplings=(Coupling((1, 2), 0.0),))
    assert mind.relation("touching", 2, 1) is relation
    assert mind.relation("touching", 1, 3) is None
    assert mind.coupled(2, 1)
    assert not mind.coupled(1, 3)
