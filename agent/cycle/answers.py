"""The operator's answers: checked when given, facts in the mind from the next step on."""

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

NO_CAST: Cast = MappingProxyType({})
NONE_OF_THE_MODELS = ("unknown", UNKNOWN_OBJECT)
"""Answers meaning that an object is none of the models."""


def resolve_answer(
    mind: Mind,
    object_id: int,
    name: str,
    models: Iterable[str] = (),
    cast: Cast = NO_CAST,
) -> str:
    """The model or actor that an answer means.

    Args:
        mind: The mind.
        object_id: The object of the answer.
        name: A model, an actor, or 'unknown'.
        models: Known models that do not occur in the mind.
        cast: Actors of tasks with the models that they may be.

    Returns:
        As `resolve_model`.

    Raises:
        SettingsError: There is no such object or name.
    """
    belief = mind.objects.get(object_id)
    if belief is None:
        known = ", ".join(str(i) for i in sorted(mind.objects)) or "none yet"
        raise SettingsError(f"there is no object {object_id}", expected=f"one of: {known}")
    candidates = [c.name for c in belief.candidates]
    candidates += [n for q in mind.questions if q.object_id == object_id for n in q.names]
    return resolve_model(mind, name, models, candidates, cast)


def resolve_model(
    mind: Mind,
    name: str,
    models: Iterable[str] = (),
    own: Sequence[str] = (),
    cast: Cast = NO_CAST,
) -> str:
    """The model or actor that a name means.

    Args:
        mind: The mind, which has actors and candidate names.
        name: A model, an actor, or 'unknown'.
        models: Further known models.
        own: Models that the object may be, most likely first, for actors with several models.
        cast: Actors of tasks with the models that they may be.

    Returns:
        The model's name, or 'unknown object'; the actor's name if its models do not identify it (it has none,
        or shares them with another).

    Raises:
        SettingsError: There is no such name.
    """
    given = " ".join(name.split())
    if given in NONE_OF_THE_MODELS:
        return UNKNOWN_OBJECT
    answers_by_name = {_normalised(m): m for m in _all_models(mind) | set(models)}
    models_of_actor = {**cast, **{a: m for a, m in mind.actors.items() if m}}
    for actor, of_actor in models_of_actor.items():
        ambiguous = _is_ambiguous(actor, models_of_actor)
        answer = actor if ambiguous else _likeliest_model(of_actor, own)
        answers_by_name[_normalised(actor)] = answer
    if _normalised(given) in answers_by_name:
        return answers_by_name[_normalised(given)]
    spellings = {
        _normalised(n): n for n in (*sorted(_all_models(mind) | set(models)), *models_of_actor)
    }
    near = closest(_normalised(given), spellings)
    raise SettingsError(
        f"'{given}' is neither a model nor an actor",
        expected=f"one of: {', '.join([*sorted(spellings.values()), 'unknown'])}",
        hint=near and f"did you mean '{spellings[near]}'?",
    )


def apply_answers(mind: Mind, answers: Mapping[int, str]) -> tuple[Mind, tuple[Event, ...]]:
    """Add answers to a mind as facts; returns the mind and the events that report them.

    Args:
        mind: The mind at the beginning of a step.
        answers: Object id -> model name from `resolve_answer`.
    """
    if not answers:
        return mind, ()
    events = tuple(
        Event(
            "answer",
            mind.time,
            mind.frame_index,
            f"The operator says that object {i} is {_display_name(mind, name)}.",
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


def _all_models(mind: Mind) -> set[str]:
    """Every model that occurs in a mind."""
    named = {c.name for b in mind.objects.values() for c in b.candidates}
    named |= {n for q in mind.questions for n in q.names} | set(mind.answers.values())
    return (named | {m for models in mind.actors.values() for m in models}) - {UNKNOWN_OBJECT}


def _likeliest_model(models: Sequence[str], own: Sequence[str]) -> str:
    """The model of an actor that is likeliest for the object, else the first."""
    return next((n for n in own if n in models), models[0])


def _is_ambiguous(actor: str, cast: Cast) -> bool:
    """Whether another actor has the same models."""
    own = set(cast[actor])
    return not own or any(own & set(found) for a, found in cast.items() if a != actor)


def _normalised(name: str) -> str:
    return name.replace("_", " ").lower()


def _display_name(mind: Mind, name: str) -> str:
    if name == UNKNOWN_OBJECT:
        return "none of the models"
    actor = next((a for a, models in sorted(mind.actors.items()) if name in models), name)
    return f"the {actor.replace('_', ' ')}"
