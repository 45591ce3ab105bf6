"""Boxes from and to `supervision.Detections`."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Mind, ObjectBelief, Presence
from visup.agent.model.errors import SettingsError
from visup.agent.model.object_beliefs import Candidate
from visup.percepts.detections import Detection, from_supervision, to_supervision
from visup.testing import region_of


@dataclass
class Detections:
    """As `supervision.Detections`, which need not be installed."""

    xyxy: Any
    mask: Any = None
    confidence: Any = None
    class_id: Any = None
    tracker_id: Any = None
    data: dict[str, Any] = field(default_factory=dict)


class Library:
    """As the module."""

    Detections = Detections


def test_boxes_are_taken_with_what_is_known_of_them() -> None:
    told = Detections(
        np.array([[1, 2, 4, 8], [5, 5, 5, 9], [0, 0, 2, 2]], np.float32),
        confidence=np.array([0.5, 1.0, 0.25]),
        tracker_id=np.array([0, 4, -1]),
        data={"class_name": np.array(["cup", "cup", "hand"])},
    )
    assert from_supervision(told) == (
        Detection(1, (1, 2, 3, 6), 0.5, "cup"),
        Detection(0, (0, 0, 2, 2), 0.25, "hand"),
    )
    assert from_supervision(Detections(np.empty((0, 4)))) == ()
    assert from_supervision(Detections(np.array([[0, 0, 1, 1]]))) == (Detection(0, (0, 0, 1, 1)),)


def mind(*objects: tuple[int, str, int, int]) -> Mind:
    size = (64, 48)
    beliefs = []
    for number, name, x, y in objects:
        mask = np.tri(6, 8, dtype=bool)
        region = region_of(mask, number, at=(x, y), size=size)
        named = (Candidate(name, 1.0, 1.0, 0.9),)
        made = ObjectBelief(number, region, Presence.SEEN, 1.0, 1.0, confirmed=True)
        beliefs.append(replace(made, candidates=named, unknown=0.1))
    return Mind(time=1.0, frame_size=size).with_objects(*beliefs)


@given(
    st.lists(
        st.tuples(st.sampled_from(["arm", "cup"]), st.integers(0, 50), st.integers(0, 40)),
        max_size=4,
    )
)
def test_what_is_in_view_goes_out_and_comes_back(things: list[tuple[str, int, int]]) -> None:
    # `sys.modules` is put back at once: a fixture would live on between examples.
    before = sys.modules.get("supervision")
    sys.modules["supervision"] = Library  # type: ignore[assignment]
    try:
        believed = mind(*((n, *t) for n, t in enumerate(things, start=1)))
        made = to_supervision(believed)
    finally:
        sys.modules.pop("supervision")
        if before is not None:
            sys.modules["supervision"] = before
    assert made.mask.shape == (len(things), 48, 64)
    assert [int(m.sum()) for m in made.mask] == [round(b.region.area) for b in believed.present()]
    back = from_supervision(made)
    assert [d.name for d in back] == [name for name, _, _ in things]
    assert [d.box for d in back] == [tuple(b.region.bbox) for b in believed.present()]
    assert [d.track - 1 for d in back] == [b.id for b in believed.present()]


def test_without_the_library_it_is_said_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "supervision", None)
    with pytest.raises(SettingsError, match="supervision") as refused:
        to_supervision(mind())
    assert "pip install supervision" in str(refused.value)


def test_the_library_itself_takes_what_is_made() -> None:
    supervision = pytest.importorskip("supervision", reason="supervision is not installed")
    made = to_supervision(mind((1, "arm", 2, 3), (2, "cup", 20, 30)))
    assert isinstance(made, supervision.Detections)
    assert len(made[made.tracker_id == 2]) == 1
    assert [d.name for d in from_supervision(made)] == ["arm", "cup"]
