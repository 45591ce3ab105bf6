"""Hysteresis against a dumb twin that looks at the whole history."""

import itertools

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from visup.rules.smoothing.hysteresis import UNKNOWN, advance, unknown_states

DT, LEAST = 0.1, 0.3


def by_history(wanted: list[int]) -> int:
    """What was wanted when the state before had not been for `LEAST`, unless unknown came later.

    From unknown one code must have been wanted for so long.
    """
    state = UNKNOWN
    for end in range(len(wanted)):
        tail = wanted[max(0, end - 3) : end + 1]
        long = len(tail) == 4 and UNKNOWN not in tail
        left = len(set(tail)) == 1 if state == UNKNOWN else state not in tail
        if wanted[end] == UNKNOWN or (long and left):
            state = wanted[end]
    return state


@settings(max_examples=150, deadline=None)
@given(st.lists(st.sampled_from([UNKNOWN, 0, 1, 2]), min_size=1, max_size=40))
def test_a_state_is_what_its_history_says(wanted: list[int]) -> None:
    states = unknown_states((1,), -DT)
    for i, code in enumerate(wanted):
        states = advance(states, np.array([code], dtype=np.int8), i * DT, LEAST)
        assert states.state[0] == by_history(wanted[: i + 1])


@settings(max_examples=50, deadline=None)
@given(st.lists(st.sampled_from([0, 1]), min_size=4, max_size=60))
def test_states_of_less_than_the_least_duration_never_show(wanted: list[int]) -> None:
    states, shown = unknown_states((1,), 0.0), []
    for i, code in enumerate(wanted):
        states = advance(states, np.array([code], dtype=np.int8), i * DT, LEAST)
        shown.append(int(states.state[0]))
    changes = [i for i in range(1, len(shown)) if shown[i] != shown[i - 1]]
    assert all(b - a >= 3 for a, b in itertools.pairwise(changes))


def test_selection_keeps_old_pairs_and_starts_new_ones_unknown() -> None:
    states = unknown_states((2, 3), 0.0)
    states = advance(states, np.array([[0, 1, 2], [2, 0, 1]], dtype=np.int8), 1.0, 0.0)
    chosen = states.select(np.array([2, -1, 0, -1]), 2.0)
    assert chosen.state.tolist() == [[2, -1, 0, -1], [1, -1, 2, -1]]
    assert chosen.since[:, 0].tolist() == [1.0, 1.0]
    assert chosen.since[:, 1].tolist() == [2.0, 2.0]
