"""Words that are alike: the same as of the standard library, in less time."""

from __future__ import annotations

from difflib import get_close_matches

from hypothesis import given
from hypothesis import strategies as st

from visup.agent.model.did_you_mean import close_matches

WORDS = st.text("abcé_ ", max_size=9) | st.sampled_from(["", "converging", "diverging", "x" * 300])


@given(WORDS, st.lists(WORDS, max_size=8), st.integers(1, 4), st.sampled_from([0.0, 0.4, 0.6, 1.0]))
def test_close_matches_equal_those_of_difflib(
    word: str, known: list[str], n: int, cutoff: float
) -> None:
    near = [w[:-1] for w in known] + [w + word for w in known]
    for words in (known, near, [*near, word]):
        assert close_matches(word, words, n, cutoff) == get_close_matches(word, words, n, cutoff)
