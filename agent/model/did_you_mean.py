"""Hints that suggest the closest known word, worded alike for every message."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from functools import lru_cache
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
    near = get_close_matches(word.casefold(), by_folded, n=1, cutoff=cutoff)
    return by_folded[near[0]] if near else None


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
