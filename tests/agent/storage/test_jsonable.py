from __future__ import annotations

import json
import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from visup.agent import Mind, Region, Severity, Truth
from visup.agent.storage.jsonable import to_jsonable

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: (
        st.lists(inner, max_size=3).map(tuple) | st.dictionaries(st.text(), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(values)
def test_any_value_becomes_strict_json(value: object) -> None:
    json.dumps(to_jsonable(value), allow_nan=False)


def test_numbers_are_rounded_and_non_finite_ones_become_words() -> None:
    assert to_jsonable((0.1 + 0.2, math.inf, np.float32(2.0), np.int8(3))) == [0.3, "inf", 2.0, 3]


def test_enums_are_written_as_words() -> None:
    assert to_jsonable((Severity.WARNING, Truth.UNKNOWN)) == ["warning", "unknown"]


def test_masks_and_memories_are_omitted() -> None:
    region = Region(1, (0, 0, 2, 2), np.ones((2, 2), bool), np.zeros((4, 2), np.float32), (1, 1), 4)
    assert "mask" not in to_jsonable(region)
    assert "memory" not in to_jsonable(Mind())
