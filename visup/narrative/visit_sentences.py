"""Visits as sentences: one visit, or several along the same path in one."""

from __future__ import annotations

from collections.abc import Sequence

from visup.narrative.visits import ObjectVisit
from visup.rules.wording.sentences import spaced

MAX_STATIONARY_SHIFT = 0.06
"""An object that has moved no farther than this, in image diagonals, counts as stationary."""

OPPOSITE = {"left": "right", "right": "left", "top": "bottom", "bottom": "top"}
OUT_PHRASES = {
    side: f"{'to' if side in ('left', 'right') else 'at'} the {side}" for side in OPPOSITE
}

MAX_LISTED = 4
"""Maximum number of objects to list; the rest are counted."""


def object_label(visit: ObjectVisit) -> str:
    """An object by its id, with name or traits: `object 4 (blue person)`, `the arm (object 2)`."""
    if visit.name is not None:
        return f"the {spaced(visit.name)} (object {visit.id})"
    return f"object {_with_traits(visit)}"


def path_clause(visit: ObjectVisit, was: str = "was") -> str:
    """The path of an object as a verb and places: `crossed from left to right`.

    Args:
        visit: A visit of the object, or one of several along the same path.
        was: `were` for several objects.
    """
    entry, exit_side = visit.entered_from, visit.left_to
    if visit.at_end:
        entry_clause = f"came in from the {entry} and " if entry else ""
        return f"{entry_clause}{was} still in view {visit.end_place} at the end"
    if entry and exit_side:
        if entry == OPPOSITE[exit_side]:
            return f"crossed from {entry} to {exit_side}"
        back_or_out = "there again" if entry == exit_side else OUT_PHRASES[exit_side]
        return f"came in from the {entry} and went out {back_or_out}"
    if entry:
        end_place = "there" if entry in visit.end_place else visit.end_place
        return f"came in from the {entry} and {was} last seen {end_place}"
    if exit_side:
        if OPPOSITE[exit_side] in visit.start_place:
            return f"crossed from {OPPOSITE[exit_side]} to {exit_side}"
        origin = "" if exit_side in visit.start_place else f" from {_bare_place(visit.start_place)}"
        return f"went{origin} out {OUT_PHRASES[exit_side]}"
    if visit.travelled < MAX_STATIONARY_SHIFT:
        return f"moved about {visit.end_place}"
    if visit.start_place == visit.end_place:
        return f"moved a little {visit.end_place}"
    return f"went from {_bare_place(visit.start_place)} to {_bare_place(visit.end_place)}"


def visit_sentence(visit: ObjectVisit) -> str:
    """One visit as a sentence: which object, where, how long, what it came near."""
    text = f"{object_label(visit)} {path_clause(visit)}, {visit.seconds:.1f} s{_closest_clause(visit)}."
    return text[:1].upper() + text[1:]


def visits_sentence(visits: Sequence[ObjectVisit]) -> str:
    """Visits along the same path as one sentence; a single one as in `visit_sentence`.

    Args:
        visits: At least one.
    """
    by_id = {x.id: x for x in sorted(visits, key=lambda x: x.seconds)}
    visits = [by_id[i] for i in dict.fromkeys(x.id for x in visits)]
    if len(visits) == 1:
        return visit_sentence(visits[0])
    shortest, longest = min(x.seconds for x in visits), max(x.seconds for x in visits)
    duration = (
        f"{shortest:.1f} to {longest:.1f} s each" if shortest < longest else f"{longest:.1f} s"
    )
    listed = [_with_traits(x) for x in visits[:MAX_LISTED]]
    rest = len(visits) - len(listed)
    last = f"{rest} more" if rest else listed.pop()
    return f"Objects {', '.join(listed)} and {last} {path_clause(visits[0], 'were')}, {duration}."


def ongoing_visit_sentence(visit: ObjectVisit) -> str:
    """A visit that has not ended: since when the object is in view, and where it is now."""
    since = f"has been in view since {visit.since:.1f} s"
    text = f"{object_label(visit)} {since}, now {visit.end_place}{_closest_clause(visit, 'has touched')}."
    return text[:1].upper() + text[1:]


def _with_traits(visit: ObjectVisit) -> str:
    traits = " ".join(x for x in (visit.colour, visit.kind and spaced(visit.kind)) if x)
    return f"{visit.id} ({traits})" if traits else str(visit.id)


def _bare_place(words: str) -> str:
    return words.split(" ", 1)[1]


def _closest_clause(visit: ObjectVisit, touched: str = "touched") -> str:
    if visit.closest is None:
        return ""
    other, gap = visit.closest
    if gap < 0.5:
        return f", and {touched} object {other} in the picture"
    return f", closest to object {other} at {gap:.0f} px"
