"""Parses what-if commands: `touching 1 2 true`, `object 1 arm`, `object 2 hidden`, `rules FILE`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from visup.agent import Mind, Presence, Truth
from visup.agent.cycle.agent import Reasoners
from visup.agent.cycle.answers import resolve_answer
from visup.agent.model.did_you_mean import did_you_mean
from visup.agent.model.errors import SettingsError
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT
from visup.rules.language.parser import load_rules
from visup.rules.predicates.snapshot import RELATION_NAMES
from visup.stepping.what_if import (
    AssumedIdentity,
    AssumedPresence,
    AssumedRelation,
    Assumption,
    with_rules,
    with_tasks,
)
from visup.tasks import load_tasks

_TRUTHS = tuple(t.value for t in Truth)
_PRESENCES = tuple(p.value for p in Presence)


def parse_assumption(
    mind: Mind, words: Sequence[str], models: Iterable[str] = (), *, retract: bool = False
) -> Assumption:
    """Parse the assumption of a command.

    Args:
        mind: The present mind.
        words: `[relation] NAME IDS [TRUTH]`, `object ID NAME`, or `object ID seen|hidden|left`.
        models: Known models that do not occur in the mind.
        retract: Whether to make it unknown: an unknown relation, an unknown object.

    Raises:
        SettingsError: They are no assumption.
    """
    assumed = [w for w in re.findall(r"[^\s,()]+", " ".join(words)) if w != "relation"]
    if not assumed:
        raise SettingsError("no belief was given", expected=_EXPECTED)
    if assumed[0] in ("object", "identity", "presence"):
        return _of_object(mind, assumed[1:], models, retract)
    return _relation(mind, assumed, retract)


_EXPECTED = "such as: touching 1 2 true, object 1 arm, object 2 hidden"


def _relation(mind: Mind, words: list[str], retract: bool) -> Assumption:
    name, *rest = words
    ids = tuple(int(w) for w in rest if w.isdecimal())
    known = {*RELATION_NAMES, *(r.name for r in mind.relations)}
    if name not in known:
        hint = did_you_mean(name, known)
        raise SettingsError(f"there is no relation '{name}'", expected=_EXPECTED, hint=hint)
    for object_id in ids:
        _known(mind, object_id)
    truth = rest[-1] if rest and rest[-1] in _TRUTHS else "unknown" if retract else "true"
    if len(ids) != 2 or (rest[-1] not in _TRUTHS and not rest[-1].isdecimal()):
        what = f"'{' '.join(words)}' is not a relation of two objects"
        raise SettingsError(what, expected=_EXPECTED)
    return AssumedRelation(name, ids, Truth(truth), mind.time)


def _of_object(mind: Mind, words: list[str], models: Iterable[str], retract: bool) -> Assumption:
    if not words or not words[0].isdecimal() or (len(words) < 2 and not retract):
        raise SettingsError("an object and a belief about it are needed", expected=_EXPECTED)
    object_id = int(words[0])
    _known(mind, object_id)
    if retract:
        return AssumedIdentity(object_id, UNKNOWN_OBJECT)
    value = " ".join(words[1:])
    if value in _PRESENCES:
        return AssumedPresence(object_id, Presence(value))
    return AssumedIdentity(object_id, resolve_answer(mind, object_id, value, models))


def _known(mind: Mind, object_id: int) -> None:
    if object_id not in mind.objects:
        known = ", ".join(map(str, sorted(mind.objects))) or "none yet"
        raise SettingsError(f"there is no object {object_id}", expected=known)


def replaced_reasoners(reasoners: Reasoners, kind: str, where: str) -> Reasoners:
    """Reasoners with other rules or another task.

    Args:
        reasoners: The present reasoners.
        kind: 'rules' or 'task'.
        where: A file, or the name of a shipped task.

    Raises:
        VisupError: The file is not valid.
    """
    if kind == "rules":
        return with_rules(reasoners, load_rules(where))
    return with_tasks(reasoners, load_tasks(where))
