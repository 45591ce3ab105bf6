"""The codec of percepts: what is read back is what was seen, to the last bit."""

from __future__ import annotations

import dataclasses
import json
import math
import zlib
from contextlib import suppress
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.paths import ROOT
from visup.agent import (
    AlertCondition,
    Depth,
    Health,
    HealthStatus,
    Hypothesis,
    Observation,
    Percept,
    Region,
    Report,
    ReportState,
    Severity,
)
from visup.agent.model.errors import OutputError
from visup.agent.storage.codec import (
    decode,
    encode,
    pack_observation,
    unpack_observation,
)
from visup.agent.storage.mask_codec import (
    chain_to_contour,
    contour_to_chain,
    mask_to_runs,
    runs_to_mask,
)

numbers = st.floats(allow_nan=False)
masks = st.tuples(st.integers(1, 12), st.integers(1, 12)).flatmap(lambda s: arrays(bool, s))
walks = st.lists(st.sampled_from([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, -1), (0, -1), (1, -1)]))
contours = st.one_of(
    walks.map(lambda w: np.cumsum([(5, 7), *w], axis=0).astype(np.float32)),
    arrays(np.float32, st.tuples(st.integers(0, 9), st.just(2))),
)


@st.composite
def regions(draw: st.DrawFn) -> Region:
    mask = draw(masks)
    h, w = mask.shape
    motion = draw(st.none() | arrays(np.float64, (2, 3), elements=numbers))
    return Region(
        id=draw(st.integers(1, 10**6)),
        bbox=(draw(st.integers(-5, 9)), draw(st.integers(0, 9)), w, h),
        mask=mask,
        contour=draw(contours),
        centroid=(draw(numbers), draw(numbers)),
        area=draw(numbers),
        velocity=(draw(numbers), draw(numbers)),
        motion=motion,
        cut=draw(st.booleans()),
        visible_since=draw(st.none() | numbers),
    )


hypotheses = st.builds(
    Hypothesis,
    region_id=st.integers(1, 9),
    name=st.text(max_size=9),
    view=st.integers(0, 99),
    similarity=numbers,
    rotation=st.none() | numbers,
    scale=st.none() | numbers,
    direction=st.none() | st.tuples(numbers, numbers, numbers),
)
leaves = st.none() | st.booleans() | st.integers() | numbers | st.text(max_size=5) | st.binary()
keys = st.text(max_size=4) | st.integers() | st.tuples(st.integers(), st.text(max_size=2))
plugin_values = st.recursive(
    leaves,
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.tuples(inner, inner)
        | st.dictionaries(keys, inner, max_size=3)
        | st.frozensets(st.integers(), max_size=3)
    ),
    max_leaves=8,
)


def observation_of(*values: tuple[str, Any]) -> Observation:
    percepts = tuple(Percept(kind, value, 1.25, "eye", 0.5) for kind, value in values)
    report = Report("eye", ReportState.RAN, tuple({k for k, _ in values}), percepts)
    return Observation(7, 1.25, (640, 480), (report, Report("ear", ReportState.FAILED, ("x",))))


def equal_values(a: Any, b: Any) -> bool:
    """Equal in type and to the last bit, arrays too."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return bool(a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes())
    if dataclasses.is_dataclass(a):
        names = [f.name for f in dataclasses.fields(a)]
        return all(equal_values(getattr(a, n), getattr(b, n)) for n in names)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(equal_values, a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(equal_values(a[k], b[k]) for k in a)
    if isinstance(a, float):
        return a == b and math.copysign(1.0, a) == math.copysign(1.0, b)
    return bool(a == b)


@settings(max_examples=60)
@given(st.lists(regions(), max_size=3), st.lists(hypotheses, max_size=3))
def test_regions_and_hypotheses_round_trip(
    given_regions: list[Region], given_hypotheses: list[Hypothesis]
) -> None:
    values = [("region", r) for r in given_regions] + [("hypothesis", h) for h in given_hypotheses]
    seen = observation_of(*values)
    assert equal_values(unpack_observation(pack_observation(seen)), seen)


@settings(max_examples=80)
@given(plugin_values)
def test_plain_values_of_plug_ins_round_trip(value: Any) -> None:
    seen = observation_of(("own", value))
    assert equal_values(unpack_observation(pack_observation(seen)), seen)


@pytest.mark.parametrize(
    "value",
    [
        Depth(1, "a", 2.0, math.inf),
        Health(HealthStatus.FROZEN, "It does not change."),
        AlertCondition("x", (1, 2), Severity.CRITICAL, "Why.", ("a", "b"), "k"),
        np.float32(0.1),
        np.array([[1, 2], [3, 4]], np.uint16),
        np.array(3.5),
        {"$": "looks like a tag"},
        {"$": "tuple", "of": [1]},
        -0.0,
        {1, 2},
    ],
)
def test_records_and_arrays_round_trip(value: Any) -> None:
    assert equal_values(decode(json.loads(json.dumps(encode(value)))), value)


def test_a_read_only_mapping_round_trips() -> None:
    back = decode(encode(MappingProxyType({"a": 1})))
    assert isinstance(back, MappingProxyType)
    assert dict(back) == {"a": 1}


@given(masks)
def test_run_lengths_encode_masks(mask: np.ndarray[Any, np.dtype[np.bool_]]) -> None:
    """Against a loop over the pixels."""
    lengths, value = [0], False
    for pixel in mask.ravel():
        if pixel != value:
            lengths.append(0)
            value = bool(pixel)
        lengths[-1] += 1
    assert mask_to_runs(mask) == lengths
    assert (runs_to_mask(lengths, mask.shape) == mask).all()


MOVES = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]


def chain_by_hand(points: list[list[float]]) -> dict[str, Any] | None:
    for value in (v for point in points for v in point):
        negative_zero = value == 0.0 and math.copysign(1.0, value) < 0.0
        if not abs(value) < 2.0**24 or value != math.floor(value) or negative_zero:
            return None
    moves = [(x - u, y - v) for (u, v), (x, y) in pairwise(points)]
    if any(m not in MOVES for m in moves):
        return None
    digits = "".join(str(MOVES.index((int(x), int(y)))) for x, y in moves)
    return {"$": "chain", "from": [int(v) for v in points[0]], "of": digits}


odd_values = st.sampled_from([math.nan, math.inf, -math.inf, -0.0, 0.5, 3.0, 2.0**24])
starts = st.sampled_from([0, 5, -3, 2**24 - 3, 3 - 2**24])


@given(
    st.tuples(starts, starts),
    st.lists(st.sampled_from([*MOVES, *MOVES, (0, 0), (2, 0)]), max_size=6),
    st.none() | st.tuples(st.integers(0, 6), st.integers(0, 1), odd_values),
)
def test_chain_codes_encode_contours(
    start: tuple[int, int], moves: list[tuple[int, int]], odd: tuple[int, int, float] | None
) -> None:
    """Against a loop over the points."""
    contour = np.cumsum([start, *moves], axis=0).astype(np.float32)
    if odd is not None:
        contour[odd[0] % len(contour), odd[1]] = odd[2]
    chain = chain_by_hand(contour.tolist())
    assert contour_to_chain(contour) == chain
    if chain is not None:
        assert equal_values(chain_to_contour(chain), contour)


@pytest.mark.parametrize("lengths", [[3], [5, -1], [[2, 2]], [2**62, 2**62], ["a"], [1.5, 2.5]])
def test_runs_that_do_not_fill_the_box_are_refused(lengths: Any) -> None:
    with pytest.raises((ValueError, TypeError)):
        runs_to_mask(lengths, (2, 2))


class Strange:
    pass


def test_kinds_of_a_value_that_cannot_be_encoded_are_unobserved() -> None:
    back = unpack_observation(pack_observation(observation_of(("own", Strange()), ("other", 1))))
    assert back.reports[0].state is ReportState.RESTED
    assert "Strange" in back.reports[0].error
    assert not back.observed("own")
    assert not back.observed("other")


REGION = Region(
    1,
    (0, 0, 2, 2),
    np.ones((2, 2), bool),
    np.array([[0, 0], [1, 0], [1, 1]], np.float32),
    (0.5, 0.5),
    4.0,
)


@settings(max_examples=150)
@given(st.data())
def test_damaged_bytes_raise_no_other_errors(data: st.DataObject) -> None:
    good = pack_observation(observation_of(("region", REGION), ("own", {"a": (1, b"x")})))
    at = data.draw(st.integers(0, len(good) - 1))
    bad = good[:at] + data.draw(st.binary(max_size=3)) + good[at + 1 :]
    with suppress(OutputError):
        assert equal_values(unpack_observation(bad), unpack_observation(good))


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4),
    lambda v: (
        st.lists(v, max_size=3)
        | st.dictionaries(st.sampled_from(["$", "of", "a", "dtype", "shape"]), v, max_size=3)
    ),
    max_leaves=6,
)


@settings(max_examples=200)
@given(json_values, st.sampled_from(["time", "frame_index", "frame_size", "reports", "value"]))
def test_invalid_documents_raise_no_other_errors(value: Any, place: str) -> None:
    told = {"frame_index": 1, "time": 0.5, "frame_size": [4, 4], "reports": []}
    if place == "value":
        percept = ["own", value, 0.5, "eye", 1.0]
        told["reports"] = [{"behaviour": "eye", "state": "ran", "gives": [], "percepts": [percept]}]
    else:
        told[place] = value
    with suppress(OutputError):
        assert isinstance(unpack_observation(zlib.compress(json.dumps(told).encode())), Observation)


def test_a_decompression_bomb_does_not_fill_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("visup.agent.storage.codec.LARGEST_STEP_BYTES", 10**5)
    with pytest.raises(OutputError, match="too large"):
        unpack_observation(zlib.compress(b" " * 10**7))


def test_the_schema_in_the_docs_is_that_of_the_code() -> None:
    from visup.agent.storage.schema import schema_text

    path = ROOT / "docs" / "step.schema.json"
    assert path.read_text() == schema_text()


@settings(max_examples=30)
@given(st.lists(regions(), max_size=2), hypotheses, plugin_values)
def test_every_document_conforms_to_the_schema(
    found: list[Region], one: Hypothesis, own: Any
) -> None:
    from visup.agent.storage.codec import to_document
    from visup.agent.storage.schema import StepDocument

    values = [("region", r) for r in found] + [("hypothesis", one), ("own", own)]
    text = json.dumps(to_document(observation_of(*values)))
    StepDocument.model_validate_json(text)
