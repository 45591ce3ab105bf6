"""A life in a line, and lives of the same course in one."""

from __future__ import annotations

from collections.abc import Sequence

from visup.rules.wording.sentences import spaced
from visup.story.lives import ObjectLife

STAYED = 0.06
"""An object that has moved no farther than this, in image diagonals, has stayed where it was."""

OPPOSITE = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}
OUT = {side: f"{'to' if side in ('left', 'right') else 'at'} the {side}" for side in OPPOSITE}

MOST_NAMED = 4
"""Most objects to list; the rest are counted."""


def who(life: ObjectLife) -> str:
    """An object with its id, and what else is known of it: `object 4 (blue person)`, `the arm (object 2)`."""
    if life.name is not None:
        return f"the {spaced(life.name)} (object {life.id})"
    return f"object {_with_traits(life)}"


def course(life: ObjectLife, was: str = "was") -> str:
    """What an object did from its coming to its going, as a verb and places.

    Args:
        life: Of the object, or of one of several that did the same.
        was: `were` when several are spoken of.
    """
    came, went = life.came_from, life.went_to
    if life.at_end:
        begun = f"came in from the {came} and " if came else ""
        return f"{begun}{was} still in view {life.ended_at} at the end"
    if came and went:
        if came == OPPOSITE[went]:
            return f"crossed from {came} to {went}"
        return (
            f"came in from the {came} and went out {OUT[went] if came != went else 'there again'}"
        )
    if came:
        seen_last = "there" if came in life.ended_at else life.ended_at
        return f"came in from the {came} and {was} last seen {seen_last}"
    if went:
        if OPPOSITE[went] in life.begun_at:
            return f"crossed from {OPPOSITE[went]} to {went}"
        origin = "" if went in life.begun_at else f" from {_place(life.begun_at)}"
        return f"went{origin} out {OUT[went]}"
    if life.travelled < STAYED:
        return f"moved about {life.ended_at}"
    if life.begun_at == life.ended_at:
        return f"moved a little {life.ended_at}"
    return f"went from {_place(life.begun_at)} to {_place(life.ended_at)}"


def life_sentence(life: ObjectLife) -> str:
    """One life in one line: which object, where, how long, what it came near."""
    text = f"{who(life)} {course(life)}, {life.seconds:.1f} s{_nearest(life)}."
    return text[:1].upper() + text[1:]


def lives_sentence(lives: Sequence[ObjectLife]) -> str:
    """Lives with the same course in one line; a single one as in `life_sentence`.

    Args:
        lives: At least one.
    """
    each = {x.id: x for x in sorted(lives, key=lambda x: x.seconds)}
    lives = [each[i] for i in dict.fromkeys(x.id for x in lives)]
    if len(lives) == 1:
        return life_sentence(lives[0])
    shortest, longest = min(x.seconds for x in lives), max(x.seconds for x in lives)
    lasted = f"{shortest:.1f} to {longest:.1f} s each" if shortest < longest else f"{longest:.1f} s"
    shown = [_with_traits(x) for x in lives[:MOST_NAMED]]
    rest = len(lives) - len(shown)
    last = f"{rest} more" if rest else shown.pop()
    return f"Objects {', '.join(shown)} and {last} {course(lives[0], 'were')}, {lasted}."


def stay_sentence(life: ObjectLife) -> str:
    """Of an object that stays: since when it is in view, and where it is now."""
    since = f"has been in view since {life.since:.1f} s"
    text = f"{who(life)} {since}, now {life.ended_at}{_nearest(life, 'has touched')}."
    return text[:1].upper() + text[1:]


def _with_traits(life: ObjectLife) -> str:
    traits = " ".join(x for x in (life.colour, life.kind and spaced(life.kind)) if x)
    return f"{life.id} ({traits})" if traits else str(life.id)


def _place(words: str) -> str:
    return words.split(" ", 1)[1]


def _nearest(life: ObjectLife, touched: str = "touched") -> str:
    if life.closest is None:
        return ""
    other, gap = life.closest
    if gap < 0.5:
        return f", and {touched} object {other} in the picture"
    return f", closest to object {other} at {gap:.0f} px"
