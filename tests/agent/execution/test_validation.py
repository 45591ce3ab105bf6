from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import (
    Contract,
    Depth,
    Frame,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
)
from visup.agent.execution.validation import check_percepts, collect_percepts
from visup.agent.model.errors import BehaviourError
from visup.testing import crossing

SHOT = crossing(1)[0]
FRAME, REGION = SHOT.frame, SHOT.regions[0]
EYE = Contract("eye", gives=("region", "hypothesis", "depth", "health", "own"), most_percepts=5)
NAN, INF = float("nan"), float("inf")


def check_own_value(value: object, kind: str = "own", **changes: Any) -> None:
    percept = replace(EYE.percept(FRAME, value, kind=kind), **changes)
    check_percepts(EYE, collect_percepts(EYE, [percept]), FRAME)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (None, "returned nothing"),
        (3, "returned an int"),
        ("text", "returned a str"),
        ({"a": 1}, "returned a dict"),
        (EYE.percept(FRAME, 1, kind="own"), "returned a Percept"),
        ([1], "reported an int"),
        ((EYE.percept(FRAME, i, kind="own") for i in count()), "more than 5 percepts"),
    ],
)
def test_other_values_than_percepts_are_refused(said: object, message: str) -> None:
    with pytest.raises(BehaviourError, match=message):
        collect_percepts(EYE, said)


@pytest.mark.parametrize(
    "changes",
    [
        {"kind": "other"},
        {"kind": None},
        {"kind": ["own"]},
        {"time": FRAME.time + 1},
        {"time": FRAME.time - 0.04},
        {"time": NAN},
        {"time": "now"},
        {"source": "somebody"},
        {"confidence": NAN},
        {"confidence": 1.01},
        {"confidence": -0.1},
        {"confidence": True},
    ],
)
def test_a_percept_with_a_wrong_field_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(BehaviourError):
        check_own_value(1, **changes)


@pytest.mark.parametrize(
    "changes",
    [
        {"id": 0},
        {"id": "one"},
        {"bbox": (0, 0, 3)},
        {"bbox": None},
        {"bbox": (0.5, 0, 3, 3)},
        {"mask": REGION.mask[:-1]},
        {"mask": REGION.mask.astype(np.uint8)},
        {"mask": np.zeros_like(REGION.mask)},
        {"mask": None},
        {"contour": np.zeros((4, 3), np.float32)},
        {"contour": np.full((4, 2), NAN, np.float32)},
        {"contour": "round"},
        {"centroid": (NAN, 1.0)},
        {"centroid": 3.0},
        {"velocity": (INF, 0.0)},
        {"velocity": (1.0, 2.0, 3.0)},
        {"area": -1.0},
        {"velocity_sigma": NAN},
        {"motion": np.eye(3)},
        {"motion": np.full((2, 3), INF)},
        {"confidence": 7.0},
    ],
)
def test_a_region_with_a_wrong_field_is_refused(changes: dict[str, Any]) -> None:
    check_own_value(REGION, "region")
    with pytest.raises(BehaviourError):
        check_own_value(replace(REGION, **changes), "region")


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        ("region", 3),
        ("region", Region),
        ("hypothesis", Hypothesis(1, "hubble", 0, NAN)),
        ("hypothesis", Hypothesis(1, "hubble", 0, 1.5)),
        ("hypothesis", Hypothesis(1, "", 0, 0.5)),
        ("hypothesis", Hypothesis(1, "hubble", 0, 0.5, direction=(0.0, NAN, 0.0))),
        ("hypothesis", Hypothesis(1, "hubble", 0, 0.5, scale=INF)),
        ("depth", Depth(1, "hubble", 0.0, 1.0)),
        ("depth", Depth(1, "hubble", NAN, 1.0)),
        ("depth", Depth(1, "hubble", 3.0, -1.0)),
        ("health", Health("fine")),  # type: ignore[arg-type]
        ("health", HealthStatus.OK),
    ],
)
def test_a_value_of_a_wrong_type_for_its_kind_is_refused(kind: str, value: object) -> None:
    with pytest.raises(BehaviourError):
        check_own_value(value, kind)


def test_one_id_for_two_regions_is_refused() -> None:
    twice = [EYE.percept(FRAME, REGION) for _ in range(2)]
    with pytest.raises(BehaviourError, match="comes twice"):
        check_percepts(EYE, twice, FRAME)


def test_one_id_for_regions_of_two_behaviours_is_refused() -> None:
    report = Report("motion", ReportState.RAN, ("region",), (EYE.percept(FRAME, REGION),))
    before = Observation(0, 0.0, FRAME.size, (report,))
    with pytest.raises(BehaviourError, match="among all behaviours"):
        check_percepts(EYE, [EYE.percept(FRAME, REGION)], FRAME, before)


@dataclass
class Reading:
    volts: float


plain = st.recursive(
    st.none() | st.booleans() | st.text(max_size=5) | st.integers() | st.floats(allow_nan=False),
    lambda part: (
        st.lists(part, max_size=3) | st.dictionaries(st.text(max_size=2), part, max_size=3)
    ),
    max_leaves=6,
)


@given(plain, st.sampled_from([NAN, INF, -INF, np.float32(NAN), np.array([1.0, NAN])]))
def test_non_finite_numbers_in_nested_values_are_refused(value: Any, bad: Any) -> None:
    finite = "inf" not in repr(value)
    if finite:
        check_own_value(value)
    for wrapped in ([value, bad], {"a": {"b": bad}}, (value, [Reading(bad)])):
        with pytest.raises(BehaviourError):
            check_own_value(wrapped)


def test_masked_arrays_may_hold_missing_values() -> None:
    check_own_value(np.ma.masked_invalid(np.array([[1.0, NAN]])))
    with pytest.raises(BehaviourError):
        check_own_value(np.array([[1.0, NAN]]))
    with pytest.raises(BehaviourError, match="array of object"):
        check_own_value(np.array([None, 3], dtype=object))


@pytest.mark.parametrize("value", [int, len, (n for n in "ab"), object(), {"a": [lambda: 0]}])
def test_values_that_are_not_data_are_refused(value: object) -> None:
    with pytest.raises(BehaviourError, match="expected: numbers, text, arrays"):
        check_own_value(value)


def test_a_recursive_value_is_refused() -> None:
    endless: list[Any] = []
    endless.append(endless)
    with pytest.raises(BehaviourError, match="nested too deep"):
        check_own_value(endless)


@given(st.binary(max_size=8) | st.floats() | st.complex_numbers() | st.dates() | plain)
def test_any_field_value_is_accepted_or_refused_with_a_message(junk: Any) -> None:
    for field in ("id", "bbox", "centroid", "area", "confidence", "contour", "motion"):
        try:
            check_own_value(replace(REGION, **{field: junk}), "region")
        except BehaviourError as refused:
            assert refused.expected  # noqa: PT017 - acceptance is an outcome too
        else:
            assert isinstance(Percept("region", junk, 0.0, "eye"), Percept)


def test_messages_about_any_value_are_short() -> None:
    with pytest.raises(BehaviourError) as caught:
        check_own_value(1, kind="x" * 10_000)
    assert len(str(caught.value)) < 300


def test_regions_are_checked_against_the_size_of_their_frame() -> None:
    small = Frame(0, 0.0, np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(BehaviourError, match="a box within"):
        check_percepts(EYE, [Percept("region", REGION, 0.0, "eye")], small)
