"""The casting of a task from step to step: which object plays which actor, and when that may change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from visup.agent import Binding, Mind, Presence
from visup.agent.model.fast_replace import replace
from visup.tasks.casting.equals import Settled, among_equals
from visup.tasks.casting.fitness import Role, fits
from visup.tasks.casting.matching import match
from visup.tasks.grammar.nodes import Task
from visup.tasks.verification.settings import TaskSettings


@dataclass(frozen=True, slots=True)
class Casting:
    """The casting of one task at one time.

    Attributes:
        bindings: Its actors, each with its object.
        rival: A better casting that would take an actor from an object that is still present: object id by
            actor; may be empty.
        rival_since: Time since when that has been better, seconds.
        settled: Actors that stay with their objects among several equal ones.
    """

    bindings: tuple[Binding, ...]
    rival: tuple[int | None, ...]
    rival_since: float
    settled: Settled = frozenset()


def recast(
    task: Task, mind: Mind, before: Casting, acting: tuple[str, ...], settings: TaskSettings
) -> Casting:
    """The casting of the next step.

    One that takes an actor from an object that is still present must be better for `settings.switch_s` to be
    accepted.

    Args:
        task: The task.
        mind: The present mind.
        before: The casting of the step before.
        acting: Actors of the active steps, which are matched first.
        settings: Time constants.
    """
    casting = _matched(task, mind, before, acting, settings)
    bindings, settled = among_equals(casting.bindings, before.settled, task, mind, settings)
    return replace(casting, bindings=bindings, settled=settled)


def _matched(
    task: Task, mind: Mind, before: Casting, acting: tuple[str, ...], settings: TaskSettings
) -> Casting:
    """The casting of the next step by the looks and criteria of single objects."""
    found = match(task, mind, before.bindings, acting, settings)
    pairs = zip(before.bindings, found, strict=False)
    if not any(_changes_hands(a, b, mind) for a, b in pairs):
        return Casting(found, (), mind.time)
    rival = tuple(b.object_id for b in found)
    since = before.rival_since if rival == before.rival else mind.time
    if mind.time - since >= settings.switch_s:
        return Casting(found, (), mind.time)
    playing = {b.actor: b.object_id for b in before.bindings if b.object_id is not None}
    kept = tuple(_refreshed(task, b, mind, playing) for b in before.bindings)
    return Casting(kept, rival, since)


def _changes_hands(before: Binding, now: Binding, mind: Mind) -> bool:
    """Whether an actor passes from an object that is still present to another one."""
    if before.object_id is None or before.guessed or before.object_id == now.object_id:
        return False
    belief = mind.objects.get(before.object_id)
    return belief is not None and belief.presence is not Presence.LEFT


def _refreshed(task: Task, binding: Binding, mind: Mind, playing: Mapping[str, int]) -> Binding:
    """The same binding with its present strength."""
    belief = None if binding.object_id is None else mind.objects.get(binding.object_id)
    if belief is None:
        return replace(binding, object_id=None, strength=0.0)
    if binding.guessed:
        return binding
    (now,) = fits(Role(task, binding.actor, mind, playing), binding.models, [belief])
    return replace(binding, strength=now)
