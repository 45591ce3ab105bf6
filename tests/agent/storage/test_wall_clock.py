"""Times of the wall beside the seconds of the source: kept as anchors, told in UTC."""

from __future__ import annotations

import json
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from visup.agent.storage.wall_clock import TOLERANCE_S, RecordStamp, WallClock, utc_text

NOW = 1795455235.0
STEPS = st.lists(st.tuples(st.floats(0.01, 100.0), st.floats(-50.0, 50.0)), max_size=20)


@given(STEPS)
def test_the_clock_is_accurate_within_its_tolerance(steps: list[tuple[float, float]]) -> None:
    """Whoever asks at once is told the time as it was, however often the wall's clock is set."""
    clock, time, offset = WallClock(), 0.0, NOW
    for later, jump in steps:
        time, offset = time + later, offset + jump
        clock = clock.anchored(time, offset + time)
        told = clock.seconds(time)
        assert told is not None
        assert abs(told - (offset + time)) <= TOLERANCE_S
    assert WallClock.read(json.loads(json.dumps(clock.anchors))) == clock
    assert len(clock.anchors) <= 1 + sum(abs(jump) > 0 for _, jump in steps)


@given(st.lists(st.floats(0.01, 100.0), min_size=1, max_size=20), st.floats(-0.4, 0.4))
def test_one_anchor_is_enough_while_the_clocks_agree(steps: list[float], off: float) -> None:
    clock, time = WallClock(), 0.0
    for number, later in enumerate(steps):
        time += later
        clock = clock.anchored(time, NOW + time + (off if number % 2 else 0.0))
    assert len(clock.anchors) == 1


@given(st.floats(0.0, 4e9))
def test_times_are_written_in_utc_with_their_zone(seconds: float) -> None:
    text = utc_text(seconds)
    assert text.endswith("Z")
    read = datetime.fromisoformat(text.replace("Z", "+00:00"))
    assert read.tzinfo == UTC
    assert abs(read.timestamp() - seconds) <= 1.1e-3


@given(st.floats(0.0, 4e9), st.floats(0.0, 4e9))
def test_times_sort_as_text(a: float, b: float) -> None:
    assert (utc_text(a) <= utc_text(b)) or a > b


@pytest.mark.parametrize(
    "told",
    [
        *(None, 3, "x", [3], [[1]], [[0, "x"]], [[0, True]]),
        *([[1.0, 5.0], [0.0, 6.0]], [[0.0, 1e300]], [[0.0, float("nan")]]),
    ],
)
def test_an_invalid_clock_gives_no_times(told: object) -> None:
    assert WallClock.read(told).text(3.0) is None


def test_a_stamp_has_camera_host_and_time() -> None:
    stamp = RecordStamp("cell", WallClock(((0.0, NOW),)), now=lambda: NOW + 60.0)
    told = stamp.of(1.5)
    assert told["camera"] == "cell"
    assert told["host"]
    assert told["at"] == "2026-11-23T17:33:56.500Z"
    assert "at" not in stamp.of(None)
    live = RecordStamp("cell", live=True, now=lambda: NOW + 60.0)
    assert live.of(None)["at"] == "2026-11-23T17:34:55.000Z"
    assert RecordStamp().of(1.5) == {}
