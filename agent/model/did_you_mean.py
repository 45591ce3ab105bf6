"""Hints that suggest the closest known word, worded alike for every message."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from difflib import SequenceMatcher
from functools import lru_cache
from heapq import nlargest
from pathlib import Path


def closest(word: str, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The closest known word, ignoring case, or None.

    >>> closest("Convergin", ["converging", "diverging"])
    'converging'

    Args:
        word: The unknown word.
        known: The known words.
        cutoff: Least similarity, 0 to 1.
    """
    return _closest(word, tuple(known), cutoff)


@lru_cache(maxsize=256)  # the same mistake recurs, for example in each trial of a repair
def _closest(word: str, known: tuple[str, ...], cutoff: float) -> str | None:
    by_folded = {k.casefold(): k for k in known}
    near = close_matches(word.casefold(), by_folded, n=1, cutoff=cutoff)
    return by_folded[near[0]] if near else None


def close_matches(word: str, known: Iterable[str], n: int = 3, cutoff: float = 0.6) -> list[str]:
    """The same as `difflib.get_close_matches`, several times as fast where most words are unlike.

    >>> close_matches("appel", ["ape", "apple", "peach"])
    ['apple', 'ape']

    Args:
        word: The word.
        known: Words to compare it with.
        n: Most words to return.
        cutoff: Least similarity, 0 to 1.

    Returns:
        The most similar ones, best first.
    """
    matcher, letters, found = SequenceMatcher(b=word), _letters(word), []
    for other in known:
        total = len(word) + len(other)
        # No more letters can be in common than the shorter word has, or than occur in both.
        if 2 * min(len(word), len(other)) < (cutoff - _ROUNDING) * total:
            continue
        other_letters = _cached_letters(other) if len(other) < _LONG else _letters(other)
        if 2 * len(letters & other_letters) < (cutoff - _ROUNDING) * total:
            continue
        matcher.set_seq1(other)
        ratio = matcher.ratio()
        if ratio >= cutoff:
            found.append((ratio, other))
    return [other for _, other in nlargest(n, found)]


_ROUNDING = 1e-9
_LONG = 64
"""Length from which the letters of a word are not cached, characters."""


def _letters(word: str) -> frozenset[tuple[str, int]]:
    """The letters of a word, each with a number for every time that it occurs."""
    return frozenset((c, n) for c, count in Counter(word).items() for n in range(count))


_cached_letters = lru_cache(maxsize=4096)(_letters)


def closest_file(path: Path, names: Iterable[str]) -> Path | None:
    """The file next to a path that was probably meant, or None.

    Names are compared without suffixes, since equal suffixes make any two names look similar.

    >>> closest_file(Path("clips/cart.mp4"), ["carts.mp4", "short.mp4"]).as_posix()
    'clips/carts.mp4'
    >>> closest_file(Path("cart.mp4"), ["short.mp4"]) is None
    True

    Args:
        path: The missing path.
        names: Names in its folder.
    """
    near = closest(path.name, [n for n in names if closest(path.stem, [Path(n).stem])])
    return path.parent / near if near else None


def did_you_mean(word: str, known: Iterable[str], form: str = "'{}'") -> str | None:
    """A hint with the closest known word, or None."""
    near = closest(word, known)
    return f"did you mean {form.format(near)}?" if near else None
