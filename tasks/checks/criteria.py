"""Checks of actors: satisfiable criteria, machines without cycles, and that those declared take part."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

from visup.agent.model.did_you_mean import did_you_mean
from visup.rules.formula.units import Span
from visup.rules.language.diagnostics import Diagnostic, Source
from visup.tasks.grammar.criteria import Conduct, Extent, OtherModels, PartOf, Place, Ranked
from visup.tasks.grammar.nodes import Actor, Name, Task
from visup.tasks.grammar.structure import machines_of
from visup.tasks.grammar.units import value

MAX_COMPARED = 500
"""Most names that are compared with each other."""
MIN_SIMILARITY = 0.85
"""Similarity from which two names are considered the same."""
CONTRARY_RANKS = ({"largest", "smallest"}, {"leftmost", "rightmost"}, {"highest", "lowest"})


def criteria_faults(task: Task, source: Source) -> Iterator[Diagnostic]:
    """One fault for each actor with unsatisfiable criteria, or that is a part of itself."""
    for actor in (*task.actors, *task.bystanders):
        reason = _contradiction(task, actor)
        if reason:
            what = f"no object can be actor `{actor.name}`: {reason}"
            expected = "criteria that one object can meet; models and colours are separated by `or`"
            yield source.fault("E236", what, actor.span, expected)
        if actor.machine == actor.name or _circular(task, actor):
            what = f"actor `{actor.name}` would be a part of itself"
            span = actor.machine.span if actor.machine is not None else actor.span
            yield source.fault("E237", what, span, "`actor gripper is part of arm`")


def _contradiction(task: Task, actor: Actor) -> str:
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
    for pair in CONTRARY_RANKS:
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


@dataclass(frozen=True)
class ActorUseCheck:
    """Checks which actors take part, by the actions that name them.

    Attributes:
        task: The tree.
        source: For positions.
        uses: Every action of the file: its name, its actors, its place.
        undefined: Names of stages that are referred to and not defined.
    """

    task: Task
    source: Source
    uses: Sequence[tuple[str, tuple[Name, ...], Span]]
    undefined: Collection[str]

    def misspelt_actors(self) -> Iterator[Diagnostic]:
        """Probable misspellings: actors named once that resemble another one declared or named more often."""
        machines = [a.machine for a in self.task.actors if a.machine is not None]
        counts = Counter(str(a) for _, actors, _ in self.uses for a in actors)
        counts.update(map(str, machines))
        declared = {a.name for a in self.task.actors} | {z.name for z in self.task.zones}
        reliable = [
            o for o in dict.fromkeys((*declared, *counts)) if o in declared or counts[o] > 1
        ]
        if len(reliable) > MAX_COMPARED:
            return
        for actors in (*(actors for _, actors, _ in self.uses), machines):
            for actor in actors:
                name = str(actor)
                if name in declared or counts[name] > 1:
                    continue
                intended = next((o for o in reliable if _is_misspelling(name, o)), None)
                if intended is not None:
                    what = f"actor `{name}` is named only here"
                    yield self.source.fault(
                        "E214", what, actor.span, hint=f"did you mean `{intended}`?"
                    )

    def unused_actors(self) -> Iterator[Diagnostic]:
        """Declared actors that no action names."""
        named = {str(a) for _, actors, _ in self.uses for a in actors}
        named |= {m for a in named for m in machines_of(self.task, a)}
        named |= {a for stage in self.undefined for a in re.findall(r"\w+", stage)}
        for actor in self.task.actors:
            if actor.span.file or actor.name in named:
                continue  # an included file may define more than is used
            if not any(_is_misspelling(n, actor.name) for n in named):
                what = f"actor `{actor.name}` is declared but takes no part"
                # The actors of `for each of 4 legs` are written nowhere themselves.
                written = actor.span.length == len(actor.name)
                hint = did_you_mean(actor.name, named, "`{}`") if written else None
                yield self.source.fault("E213", what, actor.span, "an action with this actor", hint)


def _is_misspelling(name: str, other: str) -> bool:
    """Whether one name is probably a misspelling of another; `arm1` is none of `arm2`."""
    if name == other or name.rstrip("0123456789_") == other.rstrip("0123456789_"):
        return False
    transposed = len(name) > 3 and name[0] == other[0] and sorted(name) == sorted(other)
    return (
        transposed
        or SequenceMatcher(None, name.casefold(), other.casefold()).ratio() >= MIN_SIMILARITY
    )
