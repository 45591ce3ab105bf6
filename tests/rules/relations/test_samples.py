"""Samples of many minds in one memory: no history is changed by what comes after it."""

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from visup.agent.storage.checkpoint import dump_state, load_state
from visup.rules.geometry.regions import FAN
from visup.rules.relations.samples import ROOM, SampleWindow, extended, without_oldest

Row = tuple[float, *tuple[NDArray[Any], ...]]


def row(time: float) -> Row:
    """A sample of one object, told apart by its time."""
    return (
        time,
        np.full((1, FAN), time),
        np.full((1, FAN), round(time) % 2 == 0),
        np.full((1, 1), -time),
        np.full(1, 10 * time),
        np.full((1, 2), 20 * time),
        np.full((1, 3), 30 * time),
    )


def empty() -> SampleWindow:
    blank = np.zeros((0, 1, FAN))
    shapes = (1, 1), (1,), (1, 2), (1, 3)
    separation, depth, drift, image = (np.zeros((0, *n)) for n in shapes)
    return SampleWindow((1,), np.zeros(0), blank, blank > 0, separation, depth, drift, image)


def holds(history: SampleWindow, times: list[float]) -> bool:
    """Whether a history is what a plain list of its samples would be."""
    rows = [row(t) for t in times]
    wanted = [np.array([r[k] for r in rows]) for k in range(7)]
    return all(
        np.array_equal(a, w.reshape(a.shape)) for a, w in zip(history.arrays, wanted, strict=True)
    )


STEPS = st.lists(
    st.tuples(st.integers(0, 10**6), st.sampled_from(["add", "drop", "freeze"])), max_size=60
)


@settings(deadline=None)
@given(STEPS, st.integers(0, ROOM + 3))
def test_histories_that_branch_and_forget_stay_as_plain_lists(
    steps: list[tuple[int, str]], begun: int
) -> None:
    """Any history made so far may go on, be shortened, or be written to a file and read back."""
    first, times = empty(), [float(t) for t in range(begun)]
    for t in times:
        first = extended(first, row(t))
    made = [(first, times)]
    for number, (pick, what) in enumerate(steps):
        history, known = made[pick % len(made)]
        if what == "add":
            time = 1000.0 + number
            made.append((extended(history, row(time)), [*known, time]))
        elif what == "drop":
            made.append((without_oldest(history, min(2, len(known))), known[2:]))
        else:
            made.append((load_state(dump_state(history)), known))
    assert all(holds(history, known) for history, known in made)


def test_minds_in_a_row_share_the_memory_of_their_samples() -> None:
    """A hundred kept histories of a window of 30 samples take less than a tenth of their length."""
    history, kept = empty(), []
    for t in range(150):
        history = extended(without_oldest(history, max(0, len(history.times) - 29)), row(float(t)))
        kept.append(history)
    memory = {id(h.support.base): h.support.base for h in kept[50:]}
    assert all(m is not None for m in memory.values())
    taken = sum(m.nbytes for m in memory.values() if m is not None)
    assert taken < 0.1 * sum(h.support.nbytes for h in kept[50:])
