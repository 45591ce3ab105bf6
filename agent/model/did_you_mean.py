"""Hints that name what was probably meant, in one way for every message."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from functools import lru_cache


def closest(word: str, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The known word nearest to one, whatever their cases, or None.

    >>> closest("Convergin", ["converging", "diverging"])
    'converging'

    Args:
        word: What was written.
        known: What there is.
        cutoff: How alike they must be, from 0 to 1.
    """
    return _closest(word, tuple(known), cutoff)


@lru_cache(maxsize=256)  # the same slip is often made, and each trial of a repair meets it again
def _closest(word: str, known: tuple[str, ...], cutoff: float) -> str | None:
    by_folded = {k.casefold(): k for k in known}
    near = get_close_matches(word.casefold(), by_folded, n=1, cutoff=cutoff)
    return by_folded[near[0]] if near else None


def did_you_mean(word: str, known: Iterable[str], form: str = "'{}'") -> str | None:
    """The hint that names the nearest known word, or None when none is near."""
    near = closest(word, known)
    return f"did you mean {form.format(near)}?" if near else None
