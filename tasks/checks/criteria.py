"""Checks of actor declarations: satisfiable criteria, and machines without cycles."""

from __future__ import annotations

from collections.abc import Iterator

from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.grammar.criteria import Conduct, Extent, OtherModels, PartOf, Place, Ranked
from visup.tasks.grammar.nodes import Actor, Task
from visup.tasks.grammar.structure import machines_of
from visup.tasks.grammar.units import value

OPPOSITES = ({"largest", "smallest"}, {"leftmost", "rightmost"}, {"highest", "lowest"})


def criteria_faults(task: Task, source: Source) -> Iterator[Diagnostic]:
    """One fault for each actor with unsatisfiable criteria, or that is a part of itself."""
    for actor in (*task.actors, *task.bystanders):
        why = _impossible(task, actor)
        if why:
            what = f"no object can be actor `{actor.name}`: {why}"
            expected = "criteria that one object can meet; models and colours are separated by `or`"
            yield source.fault("E236", what, actor.span, expected)
        if actor.machine == actor.name or _circular(task, actor):
            what = f"actor `{actor.name}` would be a part of itself"
            span = actor.machine.span if actor.machine is not None else actor.span
            yield source.fault("E237", what, span, "`actor gripper is part of arm`")


def _impossible(task: Task, actor: Actor) -> str:
    """Why no object can meet the criteria of an actor, or empty."""
    criteria = actor.criteria
    others = [c for c in criteria if isinstance(c, OtherModels)]
    if others:
        return f"`{' or '.join(actor.models)}` and `{others[0]}` are different models"
    for kind, what in ((Place, "places"), (Conduct, "things to do"), (PartOf, "machines")):
        several = [c for c in criteria if isinstance(c, kind)]
        if len(several) > 1:
            return f"`{several[0]}` and `{several[1]}` are two {what}"
    ranks = {c.rank for c in criteria if isinstance(c, Ranked)}
    for pair in OPPOSITES:
        if pair <= ranks:
            return f"`the {'` and `the '.join(sorted(pair))}` are two"
    sizes = [c for c in criteria if isinstance(c, Extent)]
    least = max((value(task.amount(c.amount)) for c in sizes if c.compared == "larger"), default=0)
    most = min(
        (value(task.amount(c.amount)) for c in sizes if c.compared == "smaller"), default=1e9
    )
    return (
        f"nothing is larger than {least:g} px and smaller than {most:g} px" if least >= most else ""
    )


def _circular(task: Task, actor: Actor) -> bool:
    return any(task.actor(m).machine == actor.name for m in machines_of(task, actor.name))
