"""Hints that name what was probably meant, in one way for every message."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path


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


def closest_file(path: Path, names: Iterable[str]) -> Path | None:
    """The file beside a path that was probably meant, or None.

    Endings are often the same, and make any two names look alike: names must be near without theirs.

    >>> closest_file(Path("clips/cart.mp4"), ["carts.mp4", "short.mp4"]).as_posix()
    'clips/carts.mp4'
    >>> closest_file(Path("cart.mp4"), ["short.mp4"]) is None
    True

    Args:
        path: What was written.
        names: What there is in its folder.
    """
    near = closest(path.name, [n for n in names if closest(path.stem, [Path(n).stem])])
    return path.parent / near if near else None


def did_you_mean(word: str, known: Iterable[str], form: str = "'{}'") -> str | None:
    """The hint that names the nearest known word, or None when none is near."""
    near = closest(word, known)
    return f"did you mean {form.format(near)}?" if near else None
