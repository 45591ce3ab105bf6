"""Sentences for people: 'Object 2, believed to be the satellite, appears to be ...' (after the paper, 1)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache

from visup.agent.model.memory import MemoryKey
from visup.agent.model.mind import Mind
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT

REPORTED_LIKELIHOOD = 0.7
"""Likelihood from which on the identity of an object is reported; see `VoteSettings.report_likelihood`."""

REPORTED_NAMES: MemoryKey[Mapping[int, str] | None] = MemoryKey("rules.told_names", None)
"""Object id -> the identity last reported; None where identities are not reported. The reasoner that counts
votes maintains it."""

KIND_NAMES: MemoryKey[tuple[str, ...]] = MemoryKey("rules.kind_names", ())
"""Class labels given by detectors, in order; maintained by the reasoner that counts votes."""

SURE, LIKELY = 0.95, 0.5
"""Confidence from which on sentences say 'is', and 'appears to be'; below that, 'may be'."""

# Verb and infinitive. A verb in braces in a template is graded by its confidence.
_SINGULAR = {
    "is": "be",
    "enters": "enter",
    "leaves": "leave",
    "comes": "come",
    "begins": "begin",
    "reappears": "reappear",
}
_PLURAL = {"are": "be"}
VERBS = frozenset(_SINGULAR) | frozenset(_PLURAL)
_MENTION = re.compile(r"\{(\w+)\}")
_DOUBLED_COMMA = re.compile(r",(?=\s*[,.;:!?])")


def believed_name(mind: Mind, object_id: int) -> str | None:
    """Name of an object: its actor in a task, else an actor bound to its model, else the model.

    Args:
        mind: The mind.
        object_id: Any object id.

    Returns:
        A name, or None when the object is not identified.
    """
    for task in mind.tasks:
        for binding in task.bindings:
            if binding.object_id == object_id:
                return binding.actor
    belief = mind.objects.get(object_id)
    if belief is None or belief.name == UNKNOWN_OBJECT:
        return None
    return role_or_model(mind, belief.name)


def spoken_name(mind: Mind, object_id: int) -> str | None:
    """The name of an object in sentences: as `believed_name`, but only once the name has been reported.

    A momentary lead in the votes is not reported, since names that come and go would make the narrative
    contradict itself: an object is only renamed once that has been reported.

    Args:
        mind: The mind.
        object_id: Any object id.

    Returns:
        A name, or None if none was reported.
    """
    name, reported = believed_name(mind, object_id), mind.recall(REPORTED_NAMES)
    played = any(b.object_id == object_id for task in mind.tasks for b in task.bindings)
    if name is None or played or reported is None or object_id in mind.answers:
        return name
    return role_or_model(mind, reported[object_id]) if object_id in reported else None


def is_of_kind(mind: Mind, object_id: int) -> bool:
    """Whether only the class of an object is known, from a detector, and it plays no actor of a task.

    There may be several of a class: each is 'a person', and none is 'the person'.
    """
    belief, kinds = mind.objects.get(object_id), mind.recall(KIND_NAMES)
    if belief is None or belief.name not in kinds:
        return False
    return all(b.object_id != object_id for task in mind.tasks for b in task.bindings)


def individual_name(mind: Mind, object_id: int) -> str | None:
    """The individual name of an object: its spoken name, unless that is a class label."""
    return None if is_of_kind(mind, object_id) else spoken_name(mind, object_id)


def role_or_model(mind: Mind, model: str) -> str:
    """Name of an object of a model: the actor that is bound to the model, else the model."""
    return next((a for a, models in sorted(mind.actors.items()) if model in models), model)


def describe(mind: Mind, object_id: int) -> str:
    """An object in words, as a person would first mention it.

    Args:
        mind: The mind.
        object_id: Any object id.

    Returns:
        Such as 'object 2, believed to be the satellite' ('a person', where only its kind is known),
        'object 2, in the part of the gripper' if a task casts it as that although it looks different, or
        'object 3' when it is not identified.
    """
    name = spoken_name(mind, object_id)
    if name is None:
        return f"object {object_id}"
    if is_of_kind(mind, object_id):
        return f"object {object_id}, believed to be {indefinite(spaced(name))}"
    how = "believed to be" if _looks_like(mind, object_id, name) else "in the part of"
    return f"object {object_id}, {how} the {spaced(name)}"


def _looks_like(mind: Mind, object_id: int, name: str) -> bool:
    """Whether an object may be what it is called; a task may cast one that is clearly something else."""
    belief = mind.objects.get(object_id)
    if belief is None or belief.name == UNKNOWN_OBJECT:
        return False
    bindings = (b for task in mind.tasks for b in task.bindings if b.object_id == object_id)
    first = next(bindings, None)
    if first is None:
        return True  # called by its reported name
    models = first.models if first else ()
    same = belief.name in models or role_or_model(mind, belief.name) == name
    return same or belief.confidence < REPORTED_LIKELIHOOD


def short(mind: Mind, object_id: int) -> str:
    """An object in two words, for lists and evidence: 'the satellite' or 'object 3'."""
    name = individual_name(mind, object_id)
    return f"the {spaced(name)}" if name is not None else f"object {object_id}"


def seems(confidence: float) -> str:
    """The verb for a confidence: 'is', 'appears to be' or 'may be'."""
    return graded("is", confidence)


def graded(verb: str, confidence: float) -> str:
    """A verb graded by confidence.

    Args:
        verb: One of `VERBS`.
        confidence: 0 to 1.

    Example:
        >>> [graded("leaves", c) for c in (1.0, 0.8, 0.3)]
        ['leaves', 'appears to leave', 'may leave']
        >>> graded("are", 0.8)
        'appear to be'
    """
    infinitive = _SINGULAR.get(verb) or _PLURAL[verb]
    if confidence >= SURE:
        return verb
    appears = "appears" if verb in _SINGULAR else "appear"
    return f"{appears} to {infinitive}" if confidence >= LIKELY else f"may {infinitive}"


def sentence(mind: Mind, template: str, *ids: int, confidence: float = 0.8) -> str:
    """A sentence about objects.

    Args:
        mind: The mind.
        template: Text with `{0}`, `{1}`, ... for the objects in the order of `ids`, and a verb of
            `VERBS`, such as `{is}`, for what its confidence grades. An object's first mention
            describes it, later ones say 'it' when it is the only one, else what `short` calls it.
        ids: The objects.
        confidence: 0 to 1; how strong the verb is.

    Returns:
        The sentence, with a capital and the commas that the descriptions need.
    """
    mentioned: list[int] = []

    def fill(match: re.Match[str]) -> str:
        word = match.group(1)
        if word in VERBS:
            return graded(word, confidence)
        if not word.isdecimal() or int(word) >= len(ids):
            return match.group(0)
        return _mention(mind, ids[int(word)], mentioned)

    return tidy(_MENTION.sub(fill, template))


@lru_cache(maxsize=256)
def with_names(template: str, names: tuple[str, ...]) -> str:
    """A template with its named objects numbered: '{a}' becomes '{0}' for names ('a', ...)."""

    def number(match: re.Match[str]) -> str:
        word = match.group(1)
        return f"{{{names.index(word)}}}" if word in names else match.group(0)

    return _MENTION.sub(number, template)


def mentions(template: str) -> tuple[str, ...]:
    """Words in braces of a template, in order."""
    return tuple(_MENTION.findall(template))


def tidy(text: str) -> str:
    """Fix the commas around 'believed to be', and start with a capital."""
    text = _DOUBLED_COMMA.sub("", text)
    return text[:1].upper() + text[1:]


def spaced(name: str) -> str:
    """A name as written by people: underscores become blanks."""
    return name.replace("_", " ")


def indefinite(noun: str) -> str:
    """A noun with its article.

    >>> indefinite("person"), indefinite("elephant")
    ('a person', 'an elephant')
    """
    return f"{'an' if noun[:1].lower() in 'aeiou' and noun else 'a'} {noun}"


def with_article(mind: Mind, model: str) -> str:
    """Name of an object of a model, with its article."""
    name = role_or_model(mind, model)
    of_kind = name == model and model in mind.recall(KIND_NAMES)
    return indefinite(spaced(name)) if of_kind else f"the {spaced(name)}"


def _mention(mind: Mind, object_id: int, mentioned: list[int]) -> str:
    if object_id in mentioned:
        return "it" if len(mentioned) == 1 else short(mind, object_id)
    mentioned.append(object_id)
    words = describe(mind, object_id)
    return f"{words}," if "," in words else words
