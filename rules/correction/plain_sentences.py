"""Plain sentences about objects, `the arm holds the part`, as calls: `coupled(arm, part)`."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence

from visup.rules.correction.everyday_phrases import FILLERS

LONGEST = 9
"""Most words of a sentence, including fillers."""
_BETWEEN = FILLERS | frozenset(
    [
        "with",
        "from",
        "by",
        "into",
        "onto",
        "in",
        "on",
        "and",
        "each",
        "other",
        "against",
        "toward",
        "towards",
        "between",
    ]
)

Verb = Callable[[str, int], str | None]
"""The relation between this many objects meant by a word, or None."""


def sentences(
    words: Sequence[str], names: Container[str], verb: Verb
) -> Iterator[tuple[int, tuple[str, ...]]]:
    """Leading words that state a relation of one or two objects: their number, the relation and the objects.

    >>> list(sentences("a is touching b".split(), ["a", "b"], lambda w, n: w if n == 2 else None))
    [(4, ('touching', 'a', 'b'))]

    Args:
        words: Words from the start of the sentence on.
        names: Names of objects.
        verb: The relation meant by a word.
    """
    run = list(enumerate(_run(words)))
    plain = [(n, w) for n, w in run if w in names or w not in _BETWEEN]
    # A preposition may be the relation itself: `a is on b`.
    whole = [(n, w) for n, w in run if w in names or w not in FILLERS]
    yield from _said(plain, names, verb)
    yield from _said(whole, names, verb) if whole != plain else ()


def _said(
    content: Sequence[tuple[int, str]], names: Container[str], verb: Verb
) -> Iterator[tuple[int, tuple[str, ...]]]:
    """The meaningful words of a sentence, each with its place; fillers are dropped."""
    said = [w for _, w in content]
    for shape in ((0, 1, 2), (1, 0, 2), (2, 0, 1), (1, 0), (0, 1)):
        if len(said) <= max(shape) or (content[0][0] > 0 and shape[0] > 0):
            continue
        name, things = said[shape[0]], [said[n] for n in shape[1:]]
        meant = verb(name, len(things)) if all(t in names for t in things) else None
        if meant is not None and name not in things and len(set(things)) == len(things):
            yield content[max(shape)][0] + 1, (meant, *things)


def _run(words: Sequence[str]) -> Iterator[str]:
    """The words before the first sign."""
    for word in words[:LONGEST]:
        if not word.isidentifier():
            return
        yield word


def called(said: Sequence[str]) -> str:
    """A relation of objects in source form."""
    return f"{said[0]}({', '.join(said[1:])})"


def terminals_of_call(things: int) -> tuple[str, ...]:
    """The terminals of a call with this many names."""
    return ("NAME", "LPAR", "NAME", *("COMMA", "NAME") * (things - 1), "RPAR")
