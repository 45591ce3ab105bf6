"""Synonyms: words of everyday speech and of other tools for words of both languages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from types import MappingProxyType

from visup.agent.model.did_you_mean import closest

MISSPELLING = 0.8
"""Similarity from which an unknown word is a misspelling of a known one, whatever its parts mean."""

_MEANT = (
    ("touching coupled", "touch contact collide collision hit bump crash meet push insert strike"),
    ("coupled", "couple attach connect join grasp grab grip pick lift carry take hold dock fasten"),
    ("held_by coupled", "grasped held carried"),
    ("decoupled", "release detach drop put place undock separate unfasten"),
    ("converging", "converge approach bring goto reach come enter"),
    ("converging close_to", "nearing"),
    ("close_to converging", "near close adjacent beside"),
    ("far_from apart", "far distant"),
    ("diverging", "diverge leave leaving retreat withdraw recede depart moving_apart"),
    ("moving_clearly", "moves_clearly clearly_moving clearly_moves"),
    ("moving", "move motion"),
    ("resting not_moving", "rest still stationary stop stopped static"),
    ("seen present", "visible present appear shown detected exist"),
    ("lost gone", "gone left away disappear vanish absent missing"),
    ("inside in_zone", "in within contained"),
    ("in_zone inside", "zone area_of"),
    ("on north_of", "above upon atop over ontop on_top on_top_of"),
    ("south_of", "below under beneath underneath"),
    ("west_of", "left left_of leftof"),
    ("east_of", "right right_of rightof"),
    ("gap", "distance dist separation clearance spacing between"),
    ("speed", "velocity rate"),
    ("closing_speed", "approach_speed closing"),
    ("spin", "rotation turn rotate angular_speed"),
    ("area", "size extent"),
    ("overlap", "iou intersection"),
    ("objects", "count number"),
    ("heading", "direction orientation bearing"),
    ("position_x", "x"),
    ("position_y", "y"),
    ("named", "name kind class type label is_a"),
    ("confidence", "score probability certainty"),
    ("time_to_contact", "ttc"),
)
"""(meanings, likeliest first; words with these meanings)."""


@lru_cache(maxsize=1024)
def stem(word: str) -> str:
    """The stem of a word: `moves`, `moved` and `moving` give `mov`."""
    return re.sub(r"(?:ings?|ed|es|s|e)$", "", word.casefold())


def _by_stem() -> Mapping[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for meant, said in _MEANT:
        for word in said.split():
            found[stem(word)] = (*found.get(stem(word), ()), *meant.split())
    return MappingProxyType(found)


SYNONYMS: Mapping[str, tuple[str, ...]] = _by_stem()
"""Stem of a word -> possible meanings."""


def synonym(name: str, known: Iterable[str]) -> str | None:
    """The known word meant by a whole name, or by a part of it; None without one.

    >>> synonym("moves", ["moving", "gap"]), synonym("distance_to", ["moving", "gap"])
    ('moving', 'gap')

    Args:
        name: The written name.
        known: The known words.
    """
    words = tuple(known)
    forms = {stem(word): word for word in words}
    for part in dict.fromkeys((name, *name.split("_"))):
        if stem(part) in forms:
            return forms[stem(part)]
        meant = next((w for w in SYNONYMS.get(stem(part), ()) if w in words), None)
        if meant is not None:
            return meant
    return None


def meant_word(name: str, known: Iterable[str]) -> str | None:
    """The known word meant by an unknown one: the same misspelt, else a synonym, else the closest.

    >>> meant_word("near_moving_actr", ["near_moving_actor", "converging"])
    'near_moving_actor'
    >>> meant_word("near_it", ["near_moving_actor", "converging"])
    'converging'

    Args:
        name: The written name.
        known: The known words.
    """
    words = tuple(known)
    return closest(name, words, MISSPELLING) or synonym(name, words) or closest(name, words)


OF_TASKS: Mapping[str, str] = MappingProxyType(
    {
        "outside": "not reaching",
        "apart": "not touching",
        "decoupled": "not coupled",
        "held_by": "coupled",
        "present": "not lost",
        "gone": "lost",
    }
)
"""Actions of tasks that rules have no word for, and what says the same."""


_NEGATED = re.compile(r"^(?:un|in|dis|non_?|not_?)(?=[a-z])")


def negated_synonym(name: str, objects: Sequence[str], known: Iterable[str]) -> str | None:
    """What an unknown fact says: an action of tasks, or `is_person(a)`; None if it is neither.

    >>> negated_synonym("outside", ["a", "bay"], ["reaching"])
    'not reaching(a, bay)'
    >>> negated_synonym("is_person", ["a"], ["named"])
    'named(a, person)'
    >>> negated_synonym("unhealthy", [], ["healthy"])
    'not healthy()'

    Args:
        name: The written name.
        objects: Its arguments.
        known: The known words.
    """
    said, words = ", ".join(objects), tuple(known)
    if name in OF_TASKS:
        return f"{OF_TASKS[name]}({said})"
    opposite = _NEGATED.sub("", name)
    if opposite != name and opposite in words:
        return f"not {opposite}({said})"
    bare = name.removeprefix("is_")
    if bare in (name, "", *words) or len(objects) != 1:
        return None
    meant = synonym(bare, words)
    return f"named({said}, {bare})" if meant is None else f"{meant}({said})"
