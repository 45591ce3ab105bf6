"""What the operator says: checked when it is said, a fact in the mind from the next step on."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

from visup.agent.model.did_you_mean import closest
from visup.agent.model.errors import SettingsError
from visup.agent.model.events import Event
from visup.agent.model.mind import Mind
from visup.agent.model.object_beliefs import UNKNOWN_OBJECT

Cast = Mapping[str, tuple[str, ...]]
"""Actor -> the models that it may be."""

NOBODY_PLAYS: Cast = MappingProxyType({})
NOBODY = ("unknown", UNKNOWN_OBJECT)
"""Answers that say that an object is none of the models."""


def resolve_answer(
    mind: Mind,
    object_id: int,
    name: str,
    models: Iterable[str] = (),
    cast: Cast = NOBODY_PLAYS,
) -> str:
    """The model, or the actor, that an answer means.

    Args:
        mind: The mind.
        object_id: Whom the answer is about.
        name: A model, an actor that stands for one, or 'unknown'.
        models: Models that are known besides those that anybody has spoken of.
        cast: Actors of tasks, with the models that they may be.

    Returns:
        As of `resolve_model`.

    Raises:
        SettingsError: Nobody knows such an object or such a name.
    """
    belief = mind.objects.get(object_id)
    if belief is None:
        known = ", ".join(str(i) for i in sorted(mind.objects)) or "none yet"
        raise SettingsError(f"there is no object {object_id}", expected=f"one of: {known}")
    own = [c.name for c in belief.candidates]
    own += [n for q in mind.questions if q.object_id == object_id for n in q.names]
    return resolve_model(mind, name, models, own, cast)


def resolve_model(
    mind: Mind,
    name: str,
    models: Iterable[str] = (),
    own: Sequence[str] = (),
    cast: Cast = NOBODY_PLAYS,
) -> str:
    """The model, or the actor, that a name means.

    Args:
        mind: The mind, which knows the actors and what was spoken of.
        name: A model, an actor, or 'unknown'.
        models: Further models that are known.
        own: Models that the object may be, most likely first, for actors that stand for several.
        cast: Actors of tasks, with the models that they may be.

    Returns:
        The model's name, or 'unknown object'. The actor's own where its models do not tell it: it
        has none, or shares them with another.

    Raises:
        SettingsError: Nobody knows such a name.
    """
    said = " ".join(name.split())
    if said in NOBODY:
        return UNKNOWN_OBJECT
    meant = {_plain(m): m for m in _models(mind) | set(models)}
    played = {**cast, **{a: found for a, found in mind.actors.items() if found}}
    meant |= {_plain(a): a if _shared(a, played) else _model(played[a], own) for a in played}
    if _plain(said) in meant:
        return meant[_plain(said)]
    spelt = {_plain(n): n for n in (*sorted(_models(mind) | set(models)), *played)}
    near = closest(_plain(said), spelt)
    raise SettingsError(
        f"'{said}' is neither a model nor an actor",
        expected=f"one of: {', '.join([*sorted(spelt.values()), 'unknown'])}",
        hint=near and f"did you mean '{spelt[near]}'?",
    )


def apply_answers(mind: Mind, answers: Mapping[int, str]) -> tuple[Mind, tuple[Event, ...]]:
    """A mind that takes answers as facts, and the events that report them.

    Args:
        mind: At the beginning of a step.
        answers: Object id -> model name, as `resolve_answer` gives it.
    """
    if not answers:
        return mind, ()
    events = tuple(
        Event(
            "answer",
            mind.time,
            mind.frame_index,
            f"The operator says that object {i} is {_spoken(mind, name)}.",
            (i,),
            data=MappingProxyType({"name": name}),
        )
        for i, name in sorted(answers.items())
    )
    mind = replace(
        mind,
        answers=MappingProxyType({**mind.answers, **answers}),
        questions=tuple(q for q in mind.questions if q.object_id not in answers),
    )
    return mind, events


def _models(mind: Mind) -> set[str]:
    """Every model that anybody has spoken of."""
    named = {c.name for b in mind.objects.values() for c in b.candidates}
    named |= {n for q in mind.questions for n in q.names} | set(mind.answers.values())
    return (named | {m for models in mind.actors.values() for m in models}) - {UNKNOWN_OBJECT}


def _model(models: Sequence[str], own: Sequence[str]) -> str:
    """Which of an actor's models is meant: the likeliest of the object's names, else the first."""
    return next((n for n in own if n in models), models[0])


def _shared(actor: str, cast: Cast) -> bool:
    """Whether an actor's models do not tell it from others."""
    own = set(cast[actor])
    return not own or any(own & set(found) for a, found in cast.items() if a != actor)


def _plain(name: str) -> str:
    return name.replace("_", " ").lower()


def _spoken(mind: Mind, name: str) -> str:
    if name == UNKNOWN_OBJECT:
        return "none of the models"
    actor = next((a for a, models in sorted(mind.actors.items()) if name in models), name)
    return f"the {actor.replace('_', ' ')}"
