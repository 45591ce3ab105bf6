"""Containers of bounded memory, against plain lists."""

from __future__ import annotations

from functools import partial

from hypothesis import given, settings
from hypothesis import strategies as st

from visup.report.bounded_buffers import EvenSample, SpanRecorder, TopWeighted
from visup.report.records import StateSpan


@given(max_items=st.integers(2, 40), count=st.integers(0, 500))
@settings(max_examples=100, deadline=None)
def test_samples_of_a_stream_are_even_from_its_start_and_limited(
    max_items: int, count: int
) -> None:
    kept = EvenSample[int](max_items)
    made: list[int] = []

    def make(i: int) -> int:
        made.append(i)
        return i

    for i in range(count):
        kept.offer(partial(make, i))
    items = kept.items()
    assert len(items) <= max_items
    if count:
        stride = items[1] - items[0] if len(items) > 1 else max(count, 1)
        assert list(items) == list(range(0, count, stride))
        assert len(items) >= min(count, max_items // 2)
    assert set(items) <= set(made)
    assert len(made) <= count


@given(
    weights=st.lists(st.integers(0, 5), max_size=60),
    max_items=st.integers(1, 10),
)
@settings(max_examples=100, deadline=None)
def test_the_heaviest_items_are_kept_and_among_equals_the_earlier(
    weights: list[int], max_items: int
) -> None:
    kept = TopWeighted[tuple[int, int]](max_items, lambda x: x[1])
    for item in enumerate(weights):
        if kept.would_keep(item[1]):
            kept.add(item)
    best = sorted(enumerate(weights), key=lambda x: (-x[1], x[0]))[:max_items]
    assert list(kept.items()) == sorted(best)


STATES = st.lists(
    st.dictionaries(st.sampled_from("abc"), st.sampled_from(["on", "off"])), max_size=40
)


@given(states=STATES)
@settings(max_examples=100, deadline=None)
def test_spans_have_the_reported_value_at_each_time(states: list[dict[str, str]]) -> None:
    recorder = SpanRecorder(max_items=1000)
    for t, state in enumerate(states):
        recorder.record(float(t), {(k,): v for k, v in state.items()})
    spans = recorder.spans(float(len(states)))
    for t, state in enumerate(states):
        told = {s.subject[0]: s.value for s in spans if s.start <= t < s.end}
        assert told == state
    for a in spans:
        followers = [b for b in spans if b.subject == a.subject and b.start == a.end]
        assert all(b.value != a.value for b in followers)


def test_spans_that_do_not_fit_are_dropped() -> None:
    recorder = SpanRecorder(max_items=2)
    for t in range(6):
        recorder.record(t, {("x",): str(t)})
    assert recorder.spans(6.0) == (
        StateSpan(("x",), "0", 0, 1),
        StateSpan(("x",), "1", 1, 2),
        StateSpan(("x",), "5", 5, 6.0),
    )


def test_without_values_there_are_no_spans() -> None:
    assert SpanRecorder(max_items=2).spans(1.0) == ()
    assert EvenSample[int](2).items() == ()
